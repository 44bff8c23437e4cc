"""Write the settings in docs/how-to/redundancy.md from the model, or with --check say if they are stale."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tumble.redundancy.explain import default_text, typed_choices
from tumble.redundancy.settings import explain
from tumble.report.numbers import readable_unit

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "redundancy.md"
BEGIN, END = "<!-- settings -->\n", "<!-- /settings -->\n"


def table() -> str:
    """Give a table for each group of settings."""
    lines: list[str] = []
    group = ""
    for setting in explain():
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


def main() -> int:
    """Write or check; the exit code is 1 where the page is out of date."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing, fail where the page is stale")
    check = parser.parse_args().check
    text = PAGE.read_text(encoding="utf-8")
    head, rest = text.split(BEGIN)
    tail = rest.split(END)[1]
    renewed = head + BEGIN + table() + END + tail
    if check and renewed != text:
        print(f"{PAGE.name}: settings out of date; run python scripts/write_settings.py", file=sys.stderr)
        return 1
    PAGE.write_text(renewed, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
