"""The option `--json` of all commands that print anything."""

from __future__ import annotations

from typing import Annotated, TypeAlias

import typer

JsonOption: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Print JSON instead of text; live events and samples a line each.")
]
