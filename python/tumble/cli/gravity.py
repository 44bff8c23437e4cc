"""The options that state local gravity, shared by the commands that calibrate accelerometers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypedDict

import typer

from tumble.cli.options import Options
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import ProcedureError


class StatedGravity(TypedDict):
    """Local gravity as procedures take it."""

    gravity: float | None
    latitude: float | None
    height: float | None
    gravity_uncertainty: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class GravityOptions(Options):
    """Local gravity, or the place that it follows from."""

    latitude: Annotated[
        float | None, typer.Option(help="Latitude in degrees, to work out local gravity.")
    ] = None
    height: Annotated[
        float | None, typer.Option(help="Height above the ellipsoid in m, with --latitude.")
    ] = None
    gravity: Annotated[
        float | None, typer.Option(help=f"Local gravity in m/s^2; {STANDARD_GRAVITY:g} if not given.")
    ] = None
    gravity_uncertainty: Annotated[
        float | None,
        typer.Option(
            metavar="M/S^2",
            help="1-sigma of local gravity, which the scale of accelerometers inherits; 0 with --gravity and "
            "0.00035 with --latitude and --height if not given.",
            show_default=False,
        ),
    ] = None

    def stated(self) -> StatedGravity:
        """Returns them; raises `ProcedureError` for gravity given twice, or a height without latitude."""
        if self.gravity is not None and (self.latitude is not None or self.height is not None):
            raise ProcedureError("--gravity and --latitude or --height exclude each other; give one of them")
        if self.height is not None and self.latitude is None:
            raise ProcedureError("--height needs --latitude to work out gravity; give both")
        return {
            "gravity": self.gravity,
            "latitude": self.latitude,
            "height": self.height,
            "gravity_uncertainty": self.gravity_uncertainty,
        }
