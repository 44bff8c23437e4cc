"""The options that state the Earth's field, shared by the commands that calibrate magnetometers."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from typing import Annotated

import typer

from tumble.cli.options import Options
from tumble.foundation.days import day_of
from tumble.foundation.errors import ProcedureError
from tumble.procedures.magnetometer.earth_field import EarthField, earth_field


@dataclass(frozen=True, slots=True, kw_only=True)
class EarthFieldOptions(Options):
    """The Earth's field, or the place and day that it follows from, and what disturbs it."""

    field: Annotated[
        float | None,
        typer.Option(metavar="UT", help="Strength of the Earth's field in uT.", show_default=False),
    ] = None
    field_uncertainty: Annotated[
        float | None,
        typer.Option(
            metavar="UT",
            help="1-sigma of it, which the scales inherit; 0 with --field, else that of the model.",
            show_default=False,
        ),
    ] = None
    longitude: Annotated[
        float | None,
        typer.Option(
            help="Longitude in degrees, with --latitude, to work out the Earth's field.", show_default=False
        ),
    ] = None
    day: Annotated[
        str | None,
        typer.Option(
            "--date",
            metavar="YYYY-MM-DD",
            help="Day of the session, for the Earth's field; today if not given.",
            show_default=False,
        ),
    ] = None
    current: Annotated[
        bool,
        typer.Option("--current", help="Fit the response to the current, or throttle, in the log."),
    ] = False

    def at(self, latitude: float | None, height: float | None) -> EarthField:
        """Returns the field at a place; raises `ProcedureError` where it is stated twice, or half."""
        return earth_field(
            self.field,
            uncertainty=self.field_uncertainty,
            latitude=latitude,
            longitude=self.longitude,
            height=height,
            day=self.stated_day,
        )

    def refuse_without(self, option: str) -> None:
        """Raises `ProcedureError` where any of them is given although nothing asks for a magnetometer."""
        given = {
            "--field": self.field,
            "--field-uncertainty": self.field_uncertainty,
            "--longitude": self.longitude,
            "--date": self.day,
            "--current": self.current or None,
        }
        for name, value in given.items():
            if value is not None:
                raise ProcedureError(f"{name} is about a magnetometer, which needs {option}")

    @property
    def stated_day(self) -> date | None:
        """Day of the session; raises `ProcedureError` where it is none."""
        found = None if self.day is None else day_of(self.day)
        if found is None and self.day is not None:
            raise ProcedureError(f"--date {self.day}: give the day as YYYY-MM-DD")
        return found
