"""Record of an attempt: its figures, and the statements of the report on it."""

from __future__ import annotations

import math

from tumble.foundation.results import Parameter, TriadResult
from tumble.foundation.words import count_of
from tumble.procedures.turntable.record import RecordedParameter, TargetRecord
from tumble.procedures.turntable.report import text
from tumble.procedures.turntable.report.improvement import improvement
from tumble.procedures.turntable.result import TargetResult, TurntableResult
from tumble.report.numbers import significant


def record_of(
    batch: TurntableResult,
    target: TargetResult,
    stem: str,
    *,
    attempt: int = 1,
    key: str = "",
    calibration_sha256: str = "",
    page: bool = True,
    columns: dict[str, str] | None = None,
) -> TargetRecord:
    """Keeps an attempt at a target of `batch`; `stem`, the other arguments are as `TargetRecord` has them."""
    gain = improvement(target, batch.gravity)
    reference, made = batch.reference, target.provenance
    return TargetRecord(
        target=target.name,
        stem=stem,
        attempt=attempt,
        date=made.date,
        verdict=target.verdict,
        reason=text.reason(target),
        sentence=text.verdict_sentence(target),
        serial=target.serial,
        operator=made.operator,
        station=made.station,
        source=target.source,
        log_sha256=target.log.sha256,
        duration=target.log.duration,
        missing_samples=target.missing_samples,
        temperature=target.temperature,
        reference=reference.name,
        reference_serial=reference.serial,
        reference_sha256=reference.log.sha256,
        reference_calibration=reference.calibration_hash,
        software=batch.software,
        key=key,
        calibration_sha256=calibration_sha256,
        page=page,
        warnings=target.warnings,
        remarks=_remarks(target),
        fits=(_fit(target.accelerometer), _fit(target.gyroscope)),
        before=gain.before if gain else None,
        after=gain.after if gain else None,
        parameters=() if target.failure else _parameters(target),
        checks=target.checks,
        probability=target.decision.probability if target.decision is not None else None,
        columns=columns or {},
    )


def _parameters(target: TargetResult) -> tuple[RecordedParameter, ...]:
    found = [_parameter(triad, each) for triad in target.triads for each in triad.parameters]
    shown = (figure for response in target.responses for figure in response.figures())
    found += [RecordedParameter(f"gyroscope {name}", "ppm", value, sigma) for name, value, sigma in shown]
    return tuple(found)


def _parameter(triad: TriadResult, found: Parameter) -> RecordedParameter:
    shown = found.observable and math.isfinite(found.sigma)
    value, sigma = (float(found.value), float(found.sigma)) if shown else (None, None)
    return RecordedParameter(f"{triad.triad} {found.name}", found.unit, value, sigma, found.inherited)


def _remarks(target: TargetResult) -> str:
    hidden = "not all observable" if text.unobserved_sentences(target) else ""
    warned = count_of("warning", len(target.warnings)) if target.warnings else ""
    return ", ".join(filter(None, (hidden, warned)))


def _fit(triad: TriadResult | None) -> str:
    if triad is None:
        return "none"
    if triad.degrees_of_freedom <= 0 or not math.isfinite(triad.chi_square):
        return "cannot be tested"
    return significant(triad.chi_square / triad.degrees_of_freedom, 2)
