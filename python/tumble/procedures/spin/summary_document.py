"""JSON that `tumble spin` prints."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from tumble.foundation.printed import Printed, PrintedGravity, PrintedParameter, PrintedResult
from tumble.foundation.recording import FloatArray
from tumble.procedures.spin.live import LiveStepKind, Pace
from tumble.procedures.spin.result import BiasEstimate
from tumble.procedures.spin.summary import SCHEMA


class PrintedSpan(Printed):
    """A stretch of the log, s of its clock."""

    start: float
    end: float


class RefusedSpan(PrintedSpan):
    """A stretch that is no spin."""

    reason: str


class PrintedSpin(PrintedSpan):
    """One spin: rests, and turns between them."""

    label: str
    rests: list[PrintedSpan]
    turned_clockwise: float
    """rad."""
    turned_counter_clockwise: float
    """rad."""
    heading_span: float
    """rad."""
    rate: float
    """rad/s."""
    turning_time: float
    """s."""
    method: Literal["level-free", "published"]
    level_free: BiasEstimate
    published: BiasEstimate
    gyroscope_bias: BiasEstimate
    up: FloatArray
    """(3,) unit vector in the case frame."""
    parameters: list[PrintedParameter]
    slow_turn: PrintedParameter
    chi_square: float
    degrees_of_freedom: int
    widening: float
    """Factor on the sigmas because residuals exceed the noise."""
    covariance: FloatArray
    warnings: list[str]


class SpinDocument(PrintedResult):
    """Biases of a robot's IMU from a turn on the spot."""

    schema_: Literal["tumble-spin-result/1"] = Field(SCHEMA, alias="schema")
    verdict: Literal["calibrated", "partly calibrated", "model not met", "not calibrated"]
    name: str
    source: str
    gravity: PrintedGravity
    options: dict[str, Any]
    calibration_hash: str
    """sha256 of the calibration that was applied first; empty if there was none."""
    accelerometer_bias: BiasEstimate
    gyroscope_bias: BiasEstimate
    covariance: FloatArray
    agreement: PrintedParameter
    spins: list[PrintedSpin]
    refused: list[RefusedSpan]
    calibration: dict[str, Any]
    """Content of the calibration file."""


class SpinEventLine(Printed):
    """Event of a live spin; the last one is the result, or what was wrong."""

    event: LiveStepKind
    time: float | None
    """s of the stream's clock; null while no sample has come."""
    state: str
    """`still` while the robot is to stand, `spin` while it is to turn, then `done` or `failed`."""
    still: float
    """s at rest."""
    still_wanted: float
    turned: float
    """rad, both directions."""
    turned_wanted: float
    rate: float
    """rad/s."""
    at_rest: bool
    pace: Pace
    """Pace of the turn against the requested rate; `none` while the robot stands or is to stand."""
