"""JSON that `tumble compare` prints."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from tumble.foundation.printed import Printed, PrintedResult
from tumble.foundation.recording import FloatArray
from tumble.tools.compare.result import JointTest, MotionError
from tumble.tools.compare.summary import SCHEMA


class Compared(Printed):
    """One of the calibrations."""

    name: str
    file: str
    serial: str
    date: str


class PrintedDifference(Printed):
    """One parameter in both calibrations."""

    parameter: str
    first: float
    second: float
    difference: float
    sigma: float
    sigmas: float
    unit: str
    reason: str
    """Why it is not compared, where it is not."""


class PrintedPair(Printed):
    """The first calibration and another."""

    first: str
    second: str
    verdict: Literal["same", "differ", "cannot be told"]
    probability: float
    joint: JointTest | None
    temperature: JointTest | None
    groups: list[JointTest]
    motion: list[MotionError]
    parameters: list[PrintedDifference]
    notes: list[str]


class PrintedHistory(Printed):
    """One parameter over years."""

    parameter: str
    rate: float
    sigma: float
    unit: str
    calibrations: int
    widening: float
    years: FloatArray
    values: FloatArray
    sigmas: FloatArray


class CompareDocument(PrintedResult):
    """Comparison of calibrations within their uncertainties."""

    schema_: Literal["tumble-compare-result/1"] = Field(SCHEMA, alias="schema")
    verdict: Literal["same", "differ", "cannot be told"]
    calibrations: list[Compared]
    pairs: list[PrintedPair]
    history: list[PrintedHistory]
    notes: list[str]
    options: dict[str, Any]
