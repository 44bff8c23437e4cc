"""Options that a manifest may state for an input: what describes it, and files to read; never where to write.

Whoever writes a job is trusted with programs and places, whoever writes a manifest with what to read.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from tumble.cli.commands import command_line_for
from tumble.cli.live_options import LIVE

READ = frozenset(
    {
        *("calibration", "reference-calibration", "reference-certificate", "reference-signer"),
        *("poses", "limits", "sections", "settings", "factory", "aiding"),
    }
)
"""Options whose place is read, and nothing else."""
_PLACE = re.compile(r"\b(FILE|DIR|URL|TO|SOURCE|DRIVER|ADDRESS)\b")
"""Words by which help names the value of an option that is a place."""


@cache
def options_of_inputs(procedure: str) -> Mapping[str, bool]:
    """Returns the options of a procedure that a manifest may state, by their whole names without `--`.

    A true one is a flag, which takes no value.
    """
    return dict(_harmless(command_line_for([procedure]).commands[procedure].params))


def unfit_value(value: object, *, is_flag: bool) -> str:
    """Returns what a value of an option has to be, where it is none; empty where it is one."""
    if is_flag:
        return "" if isinstance(value, bool) else "true or false"
    each = value if isinstance(value, list) else [value]
    is_fit = all(isinstance(one, str | int | float) and not isinstance(one, bool) for one in each)
    return "" if is_fit else "a text, a number, or a list of these"


def _harmless(parameters: list[Any]) -> Iterator[tuple[str, bool]]:
    """Yields the options that neither write to a place nor work on live sources, and if they are flags."""
    for each in parameters:
        names = {name[2:] for name in (*each.opts, *each.secondary_opts) if name.startswith("--")}
        is_place = _PLACE.search(each.metavar or "") is not None
        if getattr(each, "rich_help_panel", None) != LIVE and (not is_place or names <= READ):
            yield from ((name, bool(getattr(each, "is_flag", False))) for name in sorted(names))
