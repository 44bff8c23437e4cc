"""The page of a batch: the reference, the table, every target in a line, each parameter over all targets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from tumble.recording import FloatArray
from tumble.report.figures import recording_figure
from tumble.report.numbers import MINUS, measurement, readable_scale, significant
from tumble.report.page import Picture
from tumble.report.rests import RestRow, rest_rows
from tumble.report.text import VERDICT_TITLES, count_of, temperature_sentence
from tumble.results import TriadResult
from tumble.turntable.report import text
from tumble.turntable.report.batch_figures import distribution_figure, improvement_figure, strip_groups
from tumble.turntable.report.improvement import improvement
from tumble.turntable.report.target_page import PoseRow, method, pose_rows, recording_caption
from tumble.turntable.result import ReferenceResult, TargetResult, TurntableResult

_SEVERITY = {"not calibrated": 0, "model not met": 1, "fail": 2, "calibrated": 3, "pass": 4}


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


@dataclass(frozen=True, slots=True)
class DistributionSection:
    """The distributions of one triad."""

    triad: str
    figures: tuple[Markup, ...]


@dataclass(frozen=True, slots=True)
class BatchPage:
    """What the template of the batch page is given."""

    title: str
    verdicts: tuple[tuple[str, int], ...]
    warnings: tuple[str, ...]
    reference: tuple[tuple[str, str], ...]
    targets: tuple[TargetRow, ...]
    failures: tuple[TargetRow, ...]
    limited: bool
    improvement: Markup | None
    distributions: tuple[DistributionSection, ...]
    poses: tuple[PoseRow, ...]
    mounting_reason: str
    recording: Picture | None
    rests: tuple[RestRow, ...]
    method: tuple[tuple[str, str], ...]


def batch_page(result: TurntableResult, pages: Sequence[str]) -> BatchPage:
    """Gather the batch page; `pages` are the file names of the targets' own."""
    rows = [_target_row(result, target, page) for target, page in zip(result.targets, pages, strict=True)]
    order = sorted(range(len(rows)), key=lambda index: _urgency(result.targets[index]))
    verdicts = [row.verdict for row in rows]
    return BatchPage(
        title=f"Turntable calibration of {count_of('target', len(result.targets))}",
        verdicts=tuple(
            (verdict, verdicts.count(verdict)) for verdict in VERDICT_TITLES if verdict in verdicts
        ),
        warnings=result.warnings,
        reference=_reference_lines(result.reference),
        targets=tuple(rows[index] for index in order),
        failures=tuple(rows[index] for index in order if rows[index].verdict not in ("pass", "calibrated")),
        limited=any(target.checks for target in result.targets),
        improvement=improvement_figure(result, "gain"),
        distributions=_distributions(result.targets),
        poses=pose_rows(result.poses),
        mounting_reason=result.reference.mounting_reason,
        recording=_recording(result.reference),
        rests=rest_rows(result.reference.rests),
        method=method(result, None),
    )


def _target_row(result: TurntableResult, target: TargetResult, page: str) -> TargetRow:
    gain = improvement(target, result.gravity)
    return TargetRow(
        name=target.name,
        serial=target.serial,
        page=page,
        verdict=target.verdict,
        sentence=text.verdict_sentence(target),
        worst=_closest(target),
        error=gain.text() if gain else "not known",
        fits=(_fit(target.accelerometer), _fit(target.gyroscope)),
        remarks=_remarks(target),
    )


def _closest(target: TargetResult) -> str:
    check = text.worst(target.checks)
    if check is None:
        return "not calibrated" if target.failure else "no limits given"
    return f"{check.parameter}, {text.used_share(check)} of its limit"


def _remarks(target: TargetResult) -> str:
    hidden = "not all observable" if text.unobserved_sentences(target) else ""
    warned = count_of("warning", len(target.warnings)) if target.warnings else ""
    return ", ".join(filter(None, (hidden, warned)))


def _urgency(target: TargetResult) -> tuple[int, float]:
    """Worst first: by verdict, then by the share of the limit that is used."""
    check = text.worst(target.checks)
    return _SEVERITY[target.verdict], -text.limit_share(check) if check else math.inf


def _fit(triad: TriadResult | None) -> str:
    if triad is None:
        return "none"
    if triad.degrees_of_freedom <= 0 or not math.isfinite(triad.chi_square):
        return "cannot be tested"
    return significant(triad.chi_square / triad.degrees_of_freedom, 2)


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


def _distributions(targets: Sequence[TargetResult]) -> tuple[DistributionSection, ...]:
    groups = strip_groups(targets)
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
    figure = recording_figure(reference.trace, reference.rests, "rec")
    return Picture(figure, recording_caption(reference.rests))
