"""The page of one target: what it shows, gathered from the result as text and pictures for the template."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from tumble.foundation.results import INTERVAL, Rest, TriadResult
from tumble.foundation.units import CalibratedTriad
from tumble.procedures.turntable.report import text
from tumble.procedures.turntable.report.budgets import (
    BudgetSection,
    DecisionSection,
    budget_sections,
    decision_section,
)
from tumble.procedures.turntable.report.field import FieldSection, field_section
from tumble.procedures.turntable.report.improvement import improvement
from tumble.procedures.turntable.report.off_diagonals import OffDiagonalRow, off_diagonal_rows
from tumble.procedures.turntable.report.rates import ResponseSection, response_section
from tumble.procedures.turntable.report.readings import axis_reading_figure, deviations, rms
from tumble.procedures.turntable.result import AxisReading, PoseResult, TargetResult, TurntableResult
from tumble.report.figures import recording_figure, residual_figure
from tumble.report.numbers import exact, measurement, readable_scale, significant
from tumble.report.page import Picture
from tumble.report.parameters import (
    NoiseRow,
    ParameterGroup,
    PrintedMatrix,
    g_sensitivity,
    limited_groups,
    matrices,
    noise_rows,
    parameter_groups,
)
from tumble.report.rests import RestRow, rest_rows
from tumble.report.text import temperature_sentence
from tumble.report.whisker import Ruler, whisker


@dataclass(frozen=True, slots=True)
class ParameterSection:
    """The table of one triad: its parameters and whatever else of it has limits."""

    name: str
    groups: tuple[ParameterGroup, ...]
    limited: bool
    inherited: bool
    """Indicates whether the share of the reference is known."""


@dataclass(frozen=True, slots=True)
class TriadSection:
    """Further contents of the page on one triad."""

    name: str
    residuals: Picture
    matrices: tuple[PrintedMatrix, ...]
    g_sensitivity: PrintedMatrix | None
    noise: tuple[NoiseRow, ...]


@dataclass(frozen=True, slots=True)
class PoseRow:
    """One pose as printed."""

    name: str
    up: str
    rests: str
    error: str
    picture: Markup


@dataclass(frozen=True, slots=True)
class TargetPage:
    """Data for the template of a target's page."""

    name: str
    serial: str
    source: str
    verdict: str
    sentence: str
    highlights: tuple[tuple[str, str], ...]
    unobserved: tuple[str, ...]
    warnings: tuple[str, ...]
    parameters: tuple[ParameterSection, ...]
    decision: DecisionSection | None
    budgets: tuple[BudgetSection, ...]
    triads: tuple[TriadSection, ...]
    readings: tuple[Picture, ...]
    no_readings: str
    off_diagonals: tuple[OffDiagonalRow, ...]
    mounting: str
    responses: ResponseSection | None
    uncertainty: str
    field: FieldSection | None
    recording: Picture | None
    rests: tuple[RestRow, ...]
    poses: tuple[PoseRow, ...]
    clock: str
    method: tuple[tuple[str, str], ...]


def target_page(result: TurntableResult, target: TargetResult) -> TargetPage:
    """Gathers the page of `target`, one of `result.targets`."""
    return TargetPage(
        name=target.name,
        serial=target.serial,
        source=target.source,
        verdict=target.verdict,
        sentence=text.verdict_sentence(target),
        highlights=_highlights(result, target),
        unobserved=tuple(text.unobserved_sentences(target)),
        warnings=target.warnings,
        parameters=tuple(_parameter_sections(target)),
        decision=decision_section(target),
        budgets=budget_sections(target),
        triads=tuple(_triad_section(triad) for triad in target.triads),
        readings=tuple(_reading_picture(result, target, reading) for reading in target.axis_readings),
        no_readings=_why_no_readings(result, target),
        off_diagonals=off_diagonal_rows(target.off_diagonals),
        mounting=text.mounting_sentence(result.reference),
        responses=response_section(target.responses),
        uncertainty=text.uncertainty_sentence(result),
        field=field_section(target.field),
        recording=_recording(target),
        rests=rest_rows(target.rests, target.log.time),
        poses=pose_rows(result.poses),
        clock=text.clock_sentence(target.clock),
        method=method(result, target),
    )


def pose_rows(poses: Sequence[PoseResult]) -> tuple[PoseRow, ...]:
    """Prints the table error of each pose, on a common ruler."""
    ends = [pose.table_error_angle + INTERVAL * pose.table_error_sigma for pose in poses]
    ruler = Ruler.from_zero(ends)
    return tuple(
        PoseRow(
            name=pose.name,
            up=", ".join(exact(round(float(component), 3)) for component in pose.up_table),
            rests=", ".join(str(index + 1) for index in pose.rests) or "none",
            error=measurement(pose.table_error_angle, pose.table_error_sigma),
            picture=whisker(
                ruler,
                pose.table_error_angle,
                max(0.0, pose.table_error_angle - INTERVAL * pose.table_error_sigma),
                end,
                None,
                alarm=False,
            ),
        )
        for pose, end in zip(poses, ends, strict=True)
    )


def method(result: TurntableResult, target: TargetResult | None) -> tuple[tuple[str, str], ...]:
    """Returns names and values that a reader needs in order to repeat the calibration."""
    reference = result.reference
    carried = f"sha256 {reference.calibration_hash}" if reference.calibration_hash else "none"
    lines = [
        ("Procedure", "turntable: targets calibrated against a co-mounted reference"),
        ("Truth", f"{result.truth}: {text.TRUTHS[result.truth]}"),
        ("Gravity", text.gravity_sentence(result)),
        ("Reference", " · ".join(filter(None, (reference.name, reference.serial, reference.source)))),
        ("Calibration of the reference", carried),
        ("Uncertainty of the reference", text.uncertainty_sentence(result)),
        *_certificate(result),
        ("Temperature of the reference", temperature_sentence(reference.temperature)),
        ("Samples missing in the log of the reference", str(reference.missing_samples)),
    ]
    if target is not None:
        lines += [
            ("Target", " · ".join(filter(None, (target.name, target.serial, target.source)))),
            ("Temperature of the target", temperature_sentence(target.temperature)),
            ("Samples missing in the log of the target", str(target.missing_samples)),
            *_origin(target),
        ]
    lines += [(f"Option {name}", _option(value)) for name, value in result.options.items()]
    return (*lines, ("Software", result.software or "not stated"))


def _certificate(result: TurntableResult) -> list[tuple[str, str]]:
    stated = result.reference.certificate
    if stated is None:
        return []
    until = f", holds until {stated.due}" if stated.due else ""
    unit = " ".join(filter(None, (stated.manufacturer, stated.model, stated.serial)))
    of = f" of {unit}" if unit else ""
    rows = [
        ("Certificate of the reference", f"{stated.number}{of}, {stated.laboratory}, {stated.date}{until}"),
        ("Its signature", stated.signature),
    ]
    return [(name, value) for name, value in rows if value]


def _origin(target: TargetResult) -> list[tuple[str, str]]:
    made, log = target.provenance, target.log
    lines = [
        ("Date", made.date.replace("T", " ").replace("Z", " UTC")),
        ("Operator", made.operator),
        ("Station", made.station),
        ("Duration of the log", f"{log.duration:.1f} s" if log.duration else ""),
        ("SHA-256 of the log", log.sha256),
    ]
    return [(name, value) for name, value in lines if value]


def recording_caption(rests: Sequence[Rest]) -> str:
    """Describes the recording's figure, and why rests were left out."""
    caption = "Means over short segments. Shaded: rests used, with number and pose."
    unused = [
        f"rest {n}: {rest.remark or 'no reason stated'}" for n, rest in enumerate(rests, 1) if not rest.used
    ]
    return caption + (f" Hatched: rests not used ({'; '.join(unused)})." if unused else "")


def _highlights(result: TurntableResult, target: TargetResult) -> tuple[tuple[str, str], ...]:
    gain = improvement(target, result.gravity)
    used = sum(rest.used for rest in target.rests)
    tiles = [("Error of |specific force| at rest, before → after", gain.text())] if gain else []
    tiles.append(("Rests used, of those found", f"{used} of {len(target.rests)}"))
    fits = (
        ("Accelerometer fit", target.accelerometer),
        ("Gyroscope fit", target.gyroscope),
        ("Magnetometer fit", target.magnetometer),
    )
    for name, triad in fits:
        if triad is not None:
            tiles.append((name, text.fit_in_brief(triad)))
    return tuple(tiles)


def _parameter_sections(target: TargetResult) -> Iterator[ParameterSection]:
    triads: tuple[tuple[CalibratedTriad, TriadResult | None], ...] = (
        ("accelerometer", target.accelerometer),
        ("gyroscope", target.gyroscope),
        ("magnetometer", target.magnetometer),
    )
    for name, triad in triads:
        estimated = parameter_groups(triad, target.checks) if triad else ()
        groups = (*estimated, *limited_groups(name, triad, target.checks))
        if groups:
            rows = [row for group in groups for row in group.rows]
            limited, inherited = any(row.limit for row in rows), any(row.inherited for row in rows)
            yield ParameterSection(name, groups, limited, inherited)


def _triad_section(triad: TriadResult) -> TriadSection:
    return TriadSection(
        name=triad.triad,
        residuals=Picture(residual_figure(triad, f"res-{triad.triad}"), text.chi_square_sentence(triad)),
        matrices=matrices(triad),
        g_sensitivity=g_sensitivity(triad),
        noise=noise_rows(triad),
    )


def _reading_picture(result: TurntableResult, target: TargetResult, reading: AxisReading) -> Picture:
    states = deviations(target, reading, result.reference.mounting)
    figures = [f"{name} {_force(rms(deviation))}" for name, deviation in states.items()]
    caption = f"Root mean square deviation from the ideal: {', '.join(figures)}."
    return Picture(axis_reading_figure(reading, states, f"axis-{reading.axis}"), caption)


def _force(value: float) -> str:
    scale = readable_scale("m/s^2", value)
    return scale.quantity(significant(scale.factor * value, 2))


def _option(value: object) -> str:
    match value:
        case bool():
            return "yes" if value else "no"
        case None | "":
            return "not set"
        case _:
            return str(value)


def _why_no_readings(result: TurntableResult, target: TargetResult) -> str:
    if target.failure:
        return "The target was not calibrated, so there are no readings to compare."
    return text.mounting_sentence(result.reference)


def _recording(target: TargetResult) -> Picture | None:
    if len(target.trace.time) == 0:
        return None
    return Picture(
        recording_figure(target.trace, target.rests, target.log.time, "rec"), recording_caption(target.rests)
    )
