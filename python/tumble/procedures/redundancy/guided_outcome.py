"""Outcome of a watched set: one verdict, the known faults that remained, and each unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from tumble.foundation.message import Message, message
from tumble.procedures.redundancy.report.text import known_fault_sentences, output_sentences, unit_state
from tumble.procedures.redundancy.result import RedundancyResult
from tumble.tools.guided.furthest import furthest_from_ideal
from tumble.tools.guided.outcome import RunOutcome, RunVerdict, UnitOutcome

VERDICTS: Mapping[str, RunVerdict] = {
    "pass": "passed",
    "calibrated": "passed",
    "not calibrated": "warned",
    "fail": "failed",
}
"""By the verdict of the procedure."""
UNITS: Mapping[str, RunVerdict] = {
    "healthy": "passed",
    "adopted": "passed",
    "restored": "passed",
    "unhealthy": "failed",
    "disagree": "failed",
}
"""By the state of a unit at the end; `warned` for others."""


def outcome_of(result: RedundancyResult, files: Mapping[str, Path], lost: Sequence[str]) -> RunOutcome:
    """Returns the outcome of a result whose files were written; `lost` describes missing samples."""
    read = result.from_start()
    verdict = VERDICTS[result.verdict]
    sentences = [*known_fault_sentences(read), *output_sentences(read), *lost, *result.warnings]
    return RunOutcome(
        verdict="warned" if lost and verdict == "passed" else verdict,
        reasons=tuple(map(Message, sentences)),
        units=tuple(_of_unit(result, read, unit, files) for unit in (result.primary, *result.secondaries)),
        files={"report": files["report"], "events": files["events"]},
    )


def _of_unit(
    result: RedundancyResult, read: RedundancyResult, unit: str, files: Mapping[str, Path]
) -> UnitOutcome:
    word, details = unit_state(read, unit)
    errors = [error for error in result.errors if error.unit == unit]
    return UnitOutcome(
        name=unit,
        serial=result.serials.get(unit, ""),
        verdict=UNITS.get(word, "warned"),
        word=word,
        reasons=(message("{details}", details=details),) if details else (),
        furthest=furthest_from_ideal(
            (f"{error.sensor} {each.name}", each)
            for error in errors
            for each in error.parameters()
            if each.name.startswith("bias")
        ),
        calibration=files.get(unit),
        page=files["report"],
    )
