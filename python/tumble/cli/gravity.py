"""The options that state local gravity, shared by the commands that calibrate accelerometers."""

from __future__ import annotations

from typing import Annotated, TypeAlias

import typer

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import ProcedureError

LatitudeOption: TypeAlias = Annotated[
    float | None, typer.Option(help="Latitude in degrees, to work out local gravity.")
]
HeightOption: TypeAlias = Annotated[
    float | None, typer.Option(help="Height above the ellipsoid in m, with --latitude.")
]
GravityOption: TypeAlias = Annotated[
    float | None, typer.Option(help=f"Local gravity in m/s^2; {STANDARD_GRAVITY:g} if not given.")
]


def check_gravity(latitude: float | None, height: float | None, gravity: float | None) -> None:
    """Raise `ProcedureError` where gravity is said twice, or a height without a latitude."""
    if gravity is not None and (latitude is not None or height is not None):
        raise ProcedureError("--gravity and --latitude or --height exclude each other; give one of them")
    if height is not None and latitude is None:
        raise ProcedureError("--height needs --latitude to work out gravity; give both")
