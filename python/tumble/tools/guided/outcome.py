"""Outcome of a run: one verdict, its reasons, and the files that were written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeAlias

from tumble.foundation.message import Message

RunVerdict: TypeAlias = Literal["passed", "warned", "failed", "not observable"]
"""`warned` has a result that somebody should look at; `not observable` has none."""
VERDICTS: tuple[RunVerdict, ...] = ("not observable", "failed", "warned", "passed")
"""The worst first."""


@dataclass(frozen=True, slots=True)
class FurthestParameter:
    """A parameter that is furthest out against its limit or its sigma."""

    name: str
    """`accelerometer bias x`."""
    unit: str
    value: float
    """NaN where it is not observable."""
    sigma: float
    limit: float | None = None
    """Largest magnitude that is allowed; None where there is no limit."""
    within: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitOutcome:
    """Outcome of one unit."""

    name: str
    serial: str = ""
    verdict: RunVerdict
    word: str
    """Verdict in the words of the procedure: `conditional pass`."""
    reasons: tuple[Message, ...] = ()
    """The worst first."""
    furthest: tuple[FurthestParameter, ...] = ()
    """The furthest out first, five at most."""
    calibration: Path | None = None
    """Calibration file."""
    page: Path | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOutcome:
    """Outcome of a run, after its files were written."""

    verdict: RunVerdict
    """That of the worst unit."""
    reasons: tuple[Message, ...] = ()
    """Reasons that concern no unit alone, the worst first."""
    units: tuple[UnitOutcome, ...] = ()
    """The calibrated units, in their order."""
    files: Mapping[str, Path] = field(default_factory=dict)
    """Files of the run by what they are: `report`, `summary`."""
    complete: bool = True
    """Indicates whether all that was asked for was shown."""


def worst(verdicts: tuple[RunVerdict, ...]) -> RunVerdict:
    """Returns the worst verdict; `not observable` of none."""
    return next((each for each in VERDICTS if each in verdicts), "not observable")
