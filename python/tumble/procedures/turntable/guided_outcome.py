"""Outcome of a turntable session: a verdict a target, its reasons, and the parameters furthest out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

from tumble.foundation.message import Message, message
from tumble.procedures.turntable.batch import CALIBRATION_ENDING, PAGE_ENDING
from tumble.procedures.turntable.command_run import TurntableRun
from tumble.procedures.turntable.record import RecordedParameter, TargetRecord
from tumble.procedures.turntable.result import GOOD
from tumble.tools.guided.outcome import FurthestParameter, RunOutcome, RunVerdict, UnitOutcome, worst

VERDICTS: dict[str, RunVerdict] = {
    "conditional pass": "warned",
    "partly calibrated": "warned",
    "not calibrated": "not observable",
}
"""Verdicts of targets that are neither passed nor failed for an operator."""
MOST_FURTHEST = 5
"""Parameters that are shown beside a verdict."""


def outcome_of(run: TurntableRun, files: Mapping[str, Path], *, complete: bool) -> RunOutcome:
    """Makes the outcome of a run whose files are written."""
    units = tuple(_unit(record, run.batch.folder) for record in run.batch.latest())
    return RunOutcome(
        verdict=worst(tuple(unit.verdict for unit in units)),
        reasons=tuple(message(warning) for warning in run.shared.warnings),
        units=units,
        files=files,
        complete=complete,
    )


def _unit(record: TargetRecord, folder: Path) -> UnitOutcome:
    calibration = folder / f"{record.stem}{CALIBRATION_ENDING}"
    page = folder / f"{record.stem}{PAGE_ENDING}"
    return UnitOutcome(
        name=record.target,
        serial=record.serial,
        verdict=_verdict(record),
        word=record.verdict,
        reasons=tuple(_reasons(record)),
        furthest=tuple(_furthest(record)),
        calibration=calibration if record.calibration_sha256 else None,
        page=page if record.page else None,
    )


def _verdict(record: TargetRecord) -> RunVerdict:
    if record.verdict in VERDICTS:
        return VERDICTS[record.verdict]
    return "passed" if record.verdict in GOOD else "failed"


def _reasons(record: TargetRecord) -> Iterator[Message]:
    if record.reason:
        yield message(record.reason)
    yield from (message(warning) for warning in record.warnings)


def _furthest(record: TargetRecord) -> Iterator[FurthestParameter]:
    """Returns parameters by their share of the limit or, without limits, by their share of their sigma."""
    limits = {check.parameter: check for check in record.checks}

    def share(each: RecordedParameter) -> float:
        check = limits.get(each.name)
        if each.value is None:
            return math.inf if check is not None else -1.0
        if limits:
            return abs(each.value) / check.limit if check is not None and check.limit > 0.0 else -1.0
        return abs(each.value) / each.sigma if each.sigma else -1.0

    shown = [each for each in record.parameters if share(each) >= 0.0]
    for each in sorted(shown, key=share, reverse=True)[:MOST_FURTHEST]:
        check = limits.get(each.name)
        yield FurthestParameter(
            each.name,
            each.unit,
            math.nan if each.value is None else each.value,
            math.nan if each.sigma is None else each.sigma,
            check.limit if check is not None else None,
            within=check is None or check.passed,
        )
