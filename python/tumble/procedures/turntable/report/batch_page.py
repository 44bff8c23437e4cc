"""The page of a batch: the reference, the table, every target in a line, each parameter over all targets."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from tumble.foundation.provenance import Provenance
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of
from tumble.procedures.turntable.record import TargetRecord
from tumble.procedures.turntable.report import text
from tumble.procedures.turntable.report.batch_figures import (
    StripGathering,
    StripGroup,
    best_first,
    distribution_figure,
    improvement_figure,
)
from tumble.procedures.turntable.report.improvement import IMPROVEMENT_TITLE, Improvement
from tumble.procedures.turntable.report.target_page import PoseRow, method, pose_rows, recording_caption
from tumble.procedures.turntable.result import GOOD, WORST_FIRST, ReferenceResult, TurntableResult
from tumble.report.figures import recording_figure
from tumble.report.limits import limit_share, used_share
from tumble.report.numbers import MINUS, measurement, readable_scale, significant
from tumble.report.page import Picture
from tumble.report.rests import RestRow, rest_rows
from tumble.report.text import VERDICT_TITLES, temperature_sentence

_SEVERITY = {verdict: k for k, verdict in enumerate(WORST_FIRST)}


@dataclass(frozen=True, slots=True)
class TargetRow:
    """One target as a line of the table."""

    name: str
    serial: str
    page: str
    verdict: str
    sentence: str
    worst: str
    error: str
    fits: tuple[str, str]
    remarks: str
    date: str
    attempt: int


def _serials(rows: Sequence[TargetRow]) -> str:
    """Prints the serial of a single target; of more they stand in the table."""
    if len(rows) == 1:
        return rows[0].serial
    stated = sum(bool(row.serial) for row in rows)
    return f"{stated} of {len(rows)} stated, in the table" if stated else ""


def _listed(names: set[str]) -> str:
    return ", ".join(sorted(filter(None, names)))


@dataclass(frozen=True, slots=True)
class DistributionSection:
    """The distributions of one triad."""

    triad: str
    figures: tuple[Markup, ...]


@dataclass(frozen=True, slots=True)
class BatchPage:
    """Data for the template of the batch page."""

    title: str
    serials: str
    provenance: Provenance
    """Provenance of the last attempt, and all operators and stations."""
    verdicts: tuple[tuple[str, int], ...]
    warnings: tuple[str, ...]
    reference: tuple[tuple[str, str], ...]
    targets: tuple[TargetRow, ...]
    failures: tuple[TargetRow, ...]
    limited: bool
    improvement: Markup | None
    improvement_title: str
    distributions: tuple[DistributionSection, ...]
    poses: tuple[PoseRow, ...]
    mounting_reason: str
    recording: Picture | None
    rests: tuple[RestRow, ...]
    method: tuple[tuple[str, str], ...]


def batch_page(batch: TurntableResult, records: Iterable[TargetRecord]) -> BatchPage:
    """Gathers the page of all targets on record; `batch` is what those of the last run share.

    Records are taken one by one and not kept, so that there may be any number.
    """
    urgencies: list[tuple[int, float]] = []
    rows: list[TargetRow] = []
    pairs: list[tuple[str, Improvement]] = []
    strips = StripGathering()
    limited = False
    dates, operators, stations = {""}, {""}, {""}
    for record in records:
        dates.add(record.date)
        operators.add(record.operator)
        stations.add(record.station)
        rows.append(_target_row(record))
        urgencies.append(_urgency(record))
        gain = _improvement(record)
        pairs += [] if gain is None else [(record.target, gain)]
        strips.add(record)
        limited = limited or bool(record.checks)
    order = sorted(range(len(rows)), key=urgencies.__getitem__)
    verdicts = [row.verdict for row in rows]
    return BatchPage(
        title=f"Turntable calibration of {count_of('target', len(rows))}",
        serials=_serials(rows),
        provenance=Provenance(max(dates), _listed(operators), _listed(stations)),
        verdicts=tuple(
            (verdict, verdicts.count(verdict)) for verdict in VERDICT_TITLES if verdict in verdicts
        ),
        warnings=batch.warnings,
        reference=_reference_lines(batch.reference),
        targets=tuple(rows[index] for index in order),
        failures=tuple(rows[index] for index in order if rows[index].verdict not in GOOD),
        limited=limited,
        improvement=improvement_figure(best_first(pairs), "gain"),
        improvement_title=IMPROVEMENT_TITLE,
        distributions=_distributions(strips.groups()),
        poses=pose_rows(batch.poses),
        mounting_reason=batch.reference.mounting_reason,
        recording=_recording(batch.reference),
        rests=rest_rows(batch.reference.rests, batch.reference.log.time),
        method=method(batch, None),
    )


def _target_row(record: TargetRecord) -> TargetRow:
    gain = _improvement(record)
    return TargetRow(
        name=record.target,
        serial=record.serial,
        page=f"{record.stem}.html" if record.page else "",
        verdict=record.verdict,
        sentence=record.sentence,
        worst=_closest(record),
        error=gain.numbers() if gain else "not known",
        fits=record.fits,
        remarks=record.remarks,
        date=record.date,
        attempt=record.attempt,
    )


def _improvement(record: TargetRecord) -> Improvement | None:
    known = record.before is not None and record.after is not None
    return Improvement(record.before or 0.0, record.after or 0.0) if known else None


def _closest(record: TargetRecord) -> str:
    check = text.worst(record.checks)
    if check is None:
        return "no limits given" if record.parameters else "not calibrated"
    return f"{check.parameter}, {used_share(check)} of its limit"


def _urgency(record: TargetRecord) -> tuple[int, float]:
    """Worst first: by verdict, then by the share of the limit that is used."""
    check = text.worst(record.checks)
    return _SEVERITY[record.verdict], -limit_share(check) if check else math.inf


def _reference_lines(reference: ReferenceResult) -> tuple[tuple[str, str], ...]:
    residual = readable_scale("m/s^2", reference.norm_residual)
    found = residual.quantity(significant(residual.factor * reference.norm_residual, 2))
    return (
        ("Name", " · ".join(filter(None, (reference.name, reference.serial, reference.source)))),
        ("Accelerometer bias", _vector(reference.bias, reference.bias_sigma, "m/s^2")),
        (f"Residual of |r {MINUS} b| {MINUS} g", f"{found} rms over the rests"),
        ("Gyroscope bias", _vector(reference.gyroscope_bias, reference.gyroscope_bias_sigma, "rad/s")),
        ("Mounting angle", text.mounting_sentence(reference)),
        ("Temperature", temperature_sentence(reference.temperature)),
    )


def _vector(values: FloatArray, sigma: FloatArray, unit: str) -> str:
    scale = readable_scale(unit, max(abs(float(value)) for value in values))
    parts = (
        f"{axis} {measurement(scale.factor * float(v), scale.factor * float(s), scale.unit)}"
        for axis, v, s in zip("xyz", values, sigma, strict=True)
    )
    return ", ".join(parts)


def _distributions(groups: Sequence[StripGroup]) -> tuple[DistributionSection, ...]:
    found = {group.triad: None for group in groups}
    return tuple(
        DistributionSection(
            triad=triad,
            figures=tuple(
                distribution_figure(group, f"{triad}-{number}")
                for number, group in enumerate(groups)
                if group.triad == triad
            ),
        )
        for triad in found
    )


def _recording(reference: ReferenceResult) -> Picture | None:
    if len(reference.trace.time) == 0:
        return None
    figure = recording_figure(reference.trace, reference.rests, reference.log.time, "rec")
    return Picture(figure, recording_caption(reference.rests))
