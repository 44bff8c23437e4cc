"""JSON that `tumble plateaus` prints."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from tumble.foundation.printed import Printed, PrintedResult
from tumble.foundation.units import CalibratedTriad
from tumble.tools.plateaus.result import Constancy, PlateauFacts, PolynomialScore, Prediction
from tumble.tools.plateaus.summary import SCHEMA


class PrintedTriad(Printed):
    """The fit of one triad."""

    triad: CalibratedTriad
    chi_square: float
    degrees_of_freedom: int
    widening: dict[str, float]
    """Factors on the sigmas of each group of parameters."""
    orders: dict[str, list[PolynomialScore]]
    """By parameter: `bias x`, `scale z`."""
    constancies: list[Constancy]
    predictions: list[Prediction]


class PlateausDocument(PrintedResult):
    """Calibration of a unit over temperature."""

    schema_: Literal["tumble-plateaus-result/1"] = Field(SCHEMA, alias="schema")
    verdict: Literal["measured", "partly measured", "model not met"]
    name: str
    serial: str
    reference: float
    """degC, at which M and b hold."""
    range: tuple[float, float]
    """Lowest and highest plateau, degC."""
    plateaus: list[PlateauFacts]
    options: dict[str, Any]
    triads: list[PrintedTriad]
    parameters: list[dict[str, Any]]
    """The result as a table, a line a parameter."""
    calibration: dict[str, Any]
    """Content of the calibration file."""
