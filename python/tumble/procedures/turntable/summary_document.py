"""JSON that `tumble turntable` prints."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

from pydantic import Field

from tumble.foundation.printed import Printed, PrintedGravity, PrintedResult, event_model
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import LimitCheck
from tumble.procedures.turntable.live import TurntableStep
from tumble.procedures.turntable.result import UncertaintySources
from tumble.procedures.turntable.summary import SCHEMA

TargetVerdict: TypeAlias = Literal[
    "pass",
    "conditional pass",
    "conditional fail",
    "fail",
    "calibrated",
    "model not met",
    "not calibrated",
]


class Mounting(Printed):
    """Mounting of the reference on the table."""

    rotation_vector: FloatArray
    sigma: FloatArray


class PrintedReference(Printed):
    """Figures of the reference."""

    name: str
    serial: str
    calibration_hash: str
    """sha256 of the calibration that was applied first; empty if there was none."""
    sha256: str
    """Digest of its log."""
    missing_samples: int
    bias: FloatArray
    """(3,) m/s^2."""
    bias_sigma: FloatArray
    mounting: Mounting | None
    mounting_reason: str
    """Why the mounting angle was not estimated; empty if it was."""
    uncertainty: UncertaintySources
    certificate: dict[str, Any] | None
    """Certificate to which the results are traceable, as calibration files state it."""


class PrintedPose(Printed):
    """Distance of the table from a pose, deg."""

    name: str
    table_error_angle: float
    sigma: float


class PrintedTarget(Printed):
    """The last attempt at a target."""

    name: str
    source: str
    serial: str
    attempt: int
    date: str
    """UTC, ISO 8601."""
    operator: str
    station: str
    sha256: str
    """Digest of its log."""
    duration: float
    """s."""
    missing_samples: int
    verdict: TargetVerdict
    reason: str
    """Why it has no calibration, or is not within its limits."""
    warnings: list[str]
    checks: list[LimitCheck]
    probability: float | None
    """Least probability of conformity of a parameter; null without a decision rule."""
    calibration: dict[str, Any] | None
    """Content of the calibration file; null for targets of earlier runs."""
    calibration_sha256: str
    """Digest of the calibration file; empty where there is none."""


class TurntableDocument(PrintedResult):
    """All targets of a batch."""

    schema_: Literal["tumble-turntable-result/1"] = Field(SCHEMA, alias="schema")
    verdict: TargetVerdict
    """That of the worst target of the run."""
    truth: str
    gravity: PrintedGravity
    options: dict[str, Any]
    limits: dict[str, Any]
    reference: PrintedReference
    poses: list[PrintedPose]
    targets: list[PrintedTarget]


TurntableEvent = event_model(TurntableStep)
"""Event of a live session, one line each; the last one is the result, or what was wrong."""
