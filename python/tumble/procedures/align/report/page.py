"""The page of an alignment: where the units sit, how they are turned, and how far their clocks are apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble.foundation.results import Parameter
from tumble.foundation.words import count_of
from tumble.procedures.align.report.figures import places_figure
from tumble.procedures.align.result import AlignResult, UnitAlignment
from tumble.report.identity import Identity, serials
from tumble.report.numbers import fixed, readable_scale, significant
from tumble.report.page import Picture, ResultPage
from tumble.report.parameters import ParameterGroup, PrintedMatrix, printed_group

_CLOCK = ("time offset", "clock skew")


@dataclass(frozen=True, slots=True)
class AlignedUnitSection:
    """Everything shown of one secondary."""

    name: str
    anchor: str
    sentence: str
    matrix: PrintedMatrix
    groups: tuple[ParameterGroup, ...]


@dataclass(frozen=True, slots=True)
class AlignPage:
    """Data for the template of the page."""

    name: str
    verdict: str
    headline: str
    unobserved: tuple[str, ...]
    warnings: tuple[str, ...]
    places: Picture | None
    units: tuple[AlignedUnitSection, ...]
    method: tuple[tuple[str, str], ...]


def align_page(result: AlignResult) -> AlignPage:
    """Gathers the page."""
    return AlignPage(
        name=result.primary,
        verdict=result.verdict,
        headline=_headline(result),
        unobserved=tuple(unobserved_sentences(result)),
        warnings=(
            *(f"{unit.name}: {line}" for unit in result for line in unit.warnings),
            *result.warnings,
        ),
        places=_places(result),
        units=tuple(_section(unit, number) for number, unit in enumerate(result.units, start=1)),
        method=_method(result),
    )


def _headline(result: AlignResult) -> str:
    units = f"{count_of('unit', len(result.units))} beside {result.primary}"
    if result.verdict == "aligned":
        return f"Rotation and lever arm of {units} were found."
    return f"The motion did not show all rotations and lever arms of {units}."


def unobserved_sentences(result: AlignResult) -> list[str]:
    """Describes unobservable values, with their reasons; common ones of several units in one sentence."""
    by_reason: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for unit in result:
        hidden = [parameter for parameter in unit.parameters if not parameter.observable]
        for reason in dict.fromkeys(parameter.reason for parameter in hidden):
            names = tuple(parameter.name for parameter in hidden if parameter.reason == reason)
            by_reason.setdefault((reason, names), []).append(unit.name)
    everyone = len(result.units)
    return [
        f"{'' if len(units) == everyone else ', '.join(units) + ': '}{', '.join(names)}: {reason}"
        for (reason, names), units in by_reason.items()
    ]


def _section(unit: UnitAlignment, number: int) -> AlignedUnitSection:
    return AlignedUnitSection(
        name=unit.name,
        anchor=f"unit-{number}",
        sentence=_sentence(unit),
        matrix=_matrix(unit),
        groups=tuple(_groups(unit)),
    )


def _sentence(unit: UnitAlignment) -> str:
    rate = readable_scale("rad/s", unit.gyroscope_residual)
    sentence = (
        f"{count_of('window', unit.pairs)} of {unit.window:g} s. Rates of both units correlate by "
        f"{unit.correlation:.4f}; over a window they differ by "
        f"{significant(rate.factor * unit.gyroscope_residual, 2)} {rate.unit}"
    )
    if not np.isfinite(unit.accelerometer_residual):
        return f"{sentence}."
    force = readable_scale("m/s^2", unit.accelerometer_residual)
    figure = significant(force.factor * unit.accelerometer_residual, 2)
    return f"{sentence}, specific forces by {figure} {force.unit}."


def _matrix(unit: UnitAlignment) -> PrintedMatrix:
    meaning = "sensor from primary"
    if unit.sensor_from_primary is None:
        return PrintedMatrix("R", meaning, reason=unit.parameter("rotation x").reason)
    rows = tuple(tuple(fixed(float(value), 6) for value in row) for row in unit.sensor_from_primary)
    return PrintedMatrix("R", meaning, rows)


def _groups(unit: UnitAlignment) -> list[ParameterGroup]:
    kinds: dict[str, list[Parameter]] = {}
    for parameter in unit.parameters:
        # Offset and skew have units of their own.
        kind = parameter.name if parameter.name in _CLOCK else parameter.name.rpartition(" ")[0]
        kinds.setdefault(kind, []).append(parameter)
    return [printed_group(kind, members, [None] * len(members)) for kind, members in kinds.items()]


def _places(result: AlignResult) -> Picture | None:
    known = [unit for unit in result if np.isfinite(unit.lever_arm).all()]
    if not known:
        return None
    left_out = [unit.name for unit in result if not np.isfinite(unit.lever_arm).all()]
    rest = f" Not observable, so not drawn: {', '.join(left_out)}." if left_out else ""
    return Picture(
        places_figure(result.primary, known, "places"),
        f"Places in the case frame of {result.primary}, which is at zero, with 2-sigma ellipses; seen along "
        f"z, and along y.{rest}",
    )


def _method(result: AlignResult) -> tuple[tuple[str, str], ...]:
    options = ", ".join(f"{name} {value}" for name, value in result.options.items())
    return (
        (
            "Clock and rotation",
            "from angular rates alone; sensor_from_primary leads from the primary's case frame",
        ),
        ("Lever arm", "from specific forces, with the rotation and the clock that the rates gave"),
        ("Sigmas", "from the residuals: how much the result changes as each sixtieth of the log is left out"),
        ("Options", options),
        ("Source", result.source),
        ("Software", result.software),
    )


def _identity(result: AlignResult) -> Identity:
    return Identity(
        "Alignment",
        result.primary,
        serials(result.serials),
        result.provenance,
        result.software,
        result.time.date,
    )


ALIGN_REPORT = ResultPage("tumble.procedures.align.report", "align.html.j2", align_page, _identity)
