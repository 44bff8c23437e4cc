"""The option that names the calibration which a procedure builds on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

StartOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--start",
        metavar="FILE",
        help="Calibration of the unit to build on: what is found replaces that part of it, all else of it is "
        "used and kept.",
        show_default=False,
    ),
]
