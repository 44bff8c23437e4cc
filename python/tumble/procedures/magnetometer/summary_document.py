"""JSON that `tumble magnetometer` prints."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from tumble.foundation.printed import Printed, PrintedResult
from tumble.foundation.results import Parameter
from tumble.procedures.magnetometer.result import FieldPoint, NextField
from tumble.procedures.magnetometer.summary import SCHEMA


class FieldErrors(Printed):
    """Length of the field minus its strength, root mean square, uT."""

    before: float
    after: float
    held_out: float
    """Error in directions that were left out of the fit."""


class MagnetometerDocument(PrintedResult):
    """Calibration of a magnetometer by the Earth's field."""

    schema_: Literal["tumble-magnetometer-result/1"] = Field(SCHEMA, alias="schema")
    verdict: Literal["calibrated", "partly calibrated", "model not met"]
    name: str
    source: str
    serial: str
    options: dict[str, Any]
    strength: Parameter
    strength_source: str
    """`free`, `given`, or model, place and date that it follows from."""
    dip: Parameter
    expected_dip: float | None
    """deg, by the World Magnetic Model; null where the place is not known."""
    norm: FieldErrors
    directions: int
    coverage: float
    """Share of all directions that the field was met from, within 30 deg."""
    scatter: float | None
    """uT, of a sample, where the unit was turned; else null."""
    correlated: float | None
    """Samples that are worth one independent reading, where the unit was turned; else null."""
    parameters: list[dict[str, Any]]
    """The result as a table, a line a parameter."""
    points: list[FieldPoint]
    next_field: NextField | None
    start: str
    """sha256 of the calibration that it is added to; empty if there was none."""
    calibration: dict[str, Any]
    """Content of the calibration file."""
