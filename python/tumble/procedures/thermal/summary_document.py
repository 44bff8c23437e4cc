"""JSON that `tumble thermal` prints."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from tumble.foundation.printed import PrintedResult
from tumble.foundation.results import Parameter
from tumble.procedures.thermal.result import AxisDrift, ThermalBlocks
from tumble.procedures.thermal.summary import SCHEMA


class ThermalDocument(PrintedResult):
    """Change of bias and scale of a unit with temperature."""

    schema_: Literal["tumble-thermal-result/1"] = Field(SCHEMA, alias="schema")
    verdict: Literal["measured", "partly measured"]
    name: str
    sources: list[str]
    serial: str
    reference: float
    """degC, at which the drift is zero."""
    range: tuple[float, float]
    """Lowest and highest, degC."""
    thermometer_step: float
    """K."""
    lag: Parameter
    start: str
    """sha256 of the calibration that it is added to; empty if there was none."""
    options: dict[str, Any]
    blocks: ThermalBlocks
    axes: list[AxisDrift]
    parameters: list[dict[str, Any]]
    """The result as a table, a line a parameter."""
    calibration: dict[str, Any]
    """Content of the calibration file."""
