"""Write what is made from the tables of settings, or with --check report what is stale.

The tables in docs/how-to/redundancy.md, the bounds that the core looks after, the stub of the Python models
and the structs of C: names, units, bounds and meanings from crates/tumble-lab/src/setting_table.rs, defaults
from the core.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from made_files import ROOT, page_with, write_or_check
from settings_in_c import MIRRORS, text_of
from settings_in_core import PATH as BOUNDS
from settings_in_core import bounds
from settings_in_python import STUB, stub

from tumble.foundation import setting_models
from tumble.foundation.setting_table import explain
from tumble.procedures.redundancy.explain import default_text, typed_choices
from tumble.report.numbers import readable_unit

PAGE = ROOT / "docs" / "how-to" / "redundancy.md"


def table() -> str:
    """Returns a table for each group of settings."""
    lines: list[str] = []
    group = ""
    for setting in explain("redundancy"):
        if setting.group != group:
            group = setting.group
            lines += [
                "",
                f"**{group.capitalize()}**",
                "",
                "| setting | default | unit | meaning |",
                "|---|---|---|---|",
            ]
        meaning = setting.meaning.replace("\n", " ")
        words = [meaning, *([f"One of {typed_choices(setting)}."] if setting.choices else [])]
        default = f"`{default_text(setting)}`"
        lines.append(f"| `{setting.name}` | {default} | {readable_unit(setting.unit)} | {' '.join(words)} |")
    return "\n".join([*lines, "", ""])


def made() -> Iterator[tuple[Path, str]]:
    """Returns every file that is made, or holds what is made, and its text."""
    yield PAGE, page_with(PAGE, "settings", table())
    yield BOUNDS, bounds()
    yield STUB, stub({"redundancy": setting_models.MonitorSettings, "spin": setting_models.SpinSettings})
    for mirror in MIRRORS:
        yield mirror.path, text_of(mirror)


if __name__ == "__main__":
    sys.exit(write_or_check(made(), __doc__, __file__))
