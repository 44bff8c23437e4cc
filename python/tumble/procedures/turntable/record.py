"""Record of each attempt at a target: enough for summary and report without its recording."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from tumble.foundation.bounded_json import json_line, parse_json
from tumble.foundation.documents import made_of
from tumble.foundation.file_names import file_stem
from tumble.foundation.plain import finite
from tumble.foundation.results import LimitCheck, Verdict
from tumble.procedures.turntable.result import GOOD


@dataclass(frozen=True, slots=True)
class RecordedParameter:
    """One estimated number."""

    name: str
    """Name with its triad: `accelerometer bias x`."""
    unit: str
    value: float | None
    """Value; None where the data did not show it."""
    sigma: float | None
    inherited: float | None = None
    """1-sigma, within `sigma`, that the reference leaves on all its targets alike; None where not stated."""


@dataclass(frozen=True, slots=True)
class TargetRecord:
    """One attempt at one target, as a line of `batch.jsonl`."""

    target: str
    stem: str
    """Name of its files, without their endings."""
    attempt: int
    """Number of the attempt, from 1."""
    date: str
    verdict: Verdict
    reason: str
    """Reason why it failed or has no calibration; empty where neither is so."""
    sentence: str
    """Sentence of the report on the verdict."""
    serial: str
    operator: str
    station: str
    source: str
    log_sha256: str
    duration: float
    """s."""
    missing_samples: int
    temperature: tuple[float, float, float] | None
    """Lowest, mean and highest at rest, degC."""
    reference: str
    reference_serial: str
    reference_sha256: str
    """SHA-256 of the reference's recording."""
    reference_calibration: str
    """sha256 of the calibration that was applied to the reference; empty if there was none."""
    software: str
    key: str
    """sha256 of everything that the result follows from: another run of the same key finds the same."""
    calibration_sha256: str
    """SHA-256 of the calibration file; empty where there is none."""
    page: bool
    """Indicates whether it has a page of its own."""
    warnings: tuple[str, ...]
    remarks: str
    """Remarks of the report beside it, a word or two."""
    fits: tuple[str, str]
    """Chi-square over degrees of freedom, accelerometer and gyroscope, as printed."""
    before: float | None
    after: float | None
    """m/s^2: error of |specific force| at rest without and with the calibration."""
    parameters: tuple[RecordedParameter, ...]
    checks: tuple[LimitCheck, ...]
    probability: float | None = None
    """Least probability of conformity of a parameter; None without a decision rule."""
    columns: dict[str, str] = field(default_factory=dict)
    """Further columns of the manifest, by name."""

    @property
    def fails(self) -> bool:
        """Returns whether it has no calibration, or one that is known to be wrong."""
        return self.verdict not in GOOD

    def line(self) -> str:
        """Prints it as one line of JSON."""
        return json_line(finite(asdict(self)))

    @classmethod
    def from_line(cls, line: str | bytes) -> TargetRecord:
        """Reads a line; raises `ValueError` where it is not one of these."""
        try:
            content: dict[str, Any] = parse_json(line)
            known = {each.name for each in fields(cls)}
            kept = {name: value for name, value in content.items() if name in known}
            found = made_of(cls, kept | {"checks": [_check(each) for each in content["checks"]]})
        except (TypeError, KeyError, AttributeError) as error:
            raise ValueError(f"no record of a target: {error}") from error
        if found.stem != file_stem(found.stem):
            raise ValueError(f"no record of a target: {found.stem!r} is no name of a file")
        return found


def _check(content: dict[str, Any]) -> dict[str, Any]:
    value = content["value"]
    return content | {"value": math.nan if value is None else value}
