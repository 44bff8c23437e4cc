"""Options that a manifest may state for an input: what describes it, and files to read; never where to write.

Whoever writes a job is trusted with programs and places, whoever writes a manifest with what to read.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
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
def options_of_inputs(procedure: str) -> frozenset[str]:
    """Returns the options of a procedure, by their whole names without `--`, that a manifest may state."""
    return frozenset(_harmless(command_line_for([procedure]).commands[procedure].params))


def _harmless(parameters: list[Any]) -> Iterator[str]:
    """Yields the names of the options that neither write to a place nor work on live sources."""
    for each in parameters:
        names = {name[2:] for name in (*each.opts, *each.secondary_opts) if name.startswith("--")}
        is_place = _PLACE.search(each.metavar or "") is not None
        if getattr(each, "rich_help_panel", None) != LIVE and (not is_place or names <= READ):
            yield from names
