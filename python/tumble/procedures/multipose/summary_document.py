"""JSON that `tumble multipose` prints."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from tumble.foundation.printed import Printed, PrintedGravity, PrintedResult, event_model
from tumble.procedures.magnetometer.result import FieldPoint, NextField
from tumble.procedures.magnetometer.summary_document import FieldErrors
from tumble.procedures.multipose.live import MultiposeStep
from tumble.procedures.multipose.result import (
    Faces,
    NextOrientation,
    NextTurn,
    NominalScale,
    PoseFit,
    TurnFit,
)
from tumble.procedures.multipose.summary import SCHEMA


class NormErrors(Printed):
    """Distance of the length of specific force at rest from gravity, m/s^2."""

    before: float
    after: float
    held_out: float
    """Error at poses that were left out of the fit."""


class AngleErrors(Printed):
    """Angle by which gravity is turned wrongly between rests, deg."""

    before: float
    after: float


class PrintedRest(Printed):
    """A stretch in which the unit stood still, s of the clock of the log."""

    start: float
    end: float
    used: bool
    remark: str


class MagnetometerAtRests(Printed):
    """Magnetometer at the same rests; its parameters are among those of all."""

    strength_source: str
    expected_dip: float | None
    """deg, by the World Magnetic Model; null where the place is not known."""
    directions: int
    coverage: float
    """Share of all directions that the field was met from, within 30 deg."""
    norm: FieldErrors
    points: list[FieldPoint]
    next_field: NextField | None


class MultiposeDocument(PrintedResult):
    """Calibration of a unit that was held still in many orientations."""

    schema_: Literal["tumble-multipose-result/1"] = Field(SCHEMA, alias="schema")
    verdict: Literal["calibrated", "partly calibrated", "model not met"]
    name: str
    source: str
    gravity: PrintedGravity
    options: dict[str, Any]
    norm: NormErrors
    angle: AngleErrors
    directions: int
    tolerance: float
    nominal_scale: NominalScale | None
    parameters: list[dict[str, Any]]
    """The result as a table, a line a parameter."""
    gyroscope_reason: str
    """Why the gyroscope could not be calibrated; empty if it was."""
    magnetometer: MagnetometerAtRests | None
    magnetometer_reason: str
    """Why the magnetometer could not be calibrated although it was asked for; else empty."""
    poses: list[PoseFit]
    turns: list[TurnFit]
    next_orientation: NextOrientation | None
    next_turn: NextTurn | None
    faces: Faces | None
    rests: list[PrintedRest]
    start: str
    """sha256 of the calibration that it is added to; empty if there was none."""
    calibration: dict[str, Any]
    """Content of the calibration file."""


MultiposeEvent = event_model(MultiposeStep)
"""Event of a live session, one line each; the last one is the result, or what was wrong."""
