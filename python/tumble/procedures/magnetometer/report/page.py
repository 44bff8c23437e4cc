"""The page of a calibrated magnetometer: field before and after, directions covered, parameters."""

from __future__ import annotations

from dataclasses import dataclass

from tumble.foundation.log_time import LogTime
from tumble.procedures.magnetometer.report.figures import (
    dip_figure,
    influence_figure,
    norm_figure,
    sphere_figure,
)
from tumble.procedures.magnetometer.report.text import method_lines, next_sentences, sentences
from tumble.procedures.magnetometer.result import FieldPoint, MagnetometerResult
from tumble.report.groups import group_title
from tumble.report.identity import Identity
from tumble.report.numbers import measurement, significant
from tumble.report.page import Picture, ResultPage
from tumble.report.parameters import (
    ParameterGroup,
    PrintedMatrix,
    matrices,
    parameter_groups,
    printed_group,
)


@dataclass(frozen=True, slots=True)
class PrintedPoint:
    """A rest or stretch as printed."""

    number: str
    span: str
    before: str
    after: str
    dip: str
    remark: str


@dataclass(frozen=True, slots=True)
class MagnetometerPage:
    """Data for the template."""

    name: str
    serial: str
    verdict: str
    sentences: tuple[str, ...]
    advice: tuple[str, ...]
    warnings: tuple[str, ...]
    place: str
    """`rest` or `stretch`."""
    sphere: Picture
    influence: Picture
    norm: Picture
    dip: Picture | None
    points: tuple[PrintedPoint, ...]
    fit: str
    groups: tuple[ParameterGroup, ...]
    matrices: tuple[PrintedMatrix, ...]
    method: tuple[tuple[str, str], ...]


def magnetometer_page(result: MagnetometerResult) -> MagnetometerPage:
    """Gathers the page."""
    triad = result.magnetometer
    return MagnetometerPage(
        name=result.name,
        serial=result.serial,
        verdict=result.verdict,
        sentences=tuple(sentences(result)),
        advice=tuple(next_sentences(result)),
        warnings=result.warnings,
        place="rest" if result.at_rest else "stretch",
        sphere=Picture(
            sphere_figure(result, "sphere"),
            "Direction of the field in the case, seen from +z and, right, through the unit from +z; equal "
            "areas show equal parts of the sphere. Dark: places without which a parameter would change by "
            "more than its sigma. Hollow: the direction that would help most, where one would lower the "
            "largest sigma by a tenth or more.",
        ),
        influence=Picture(
            influence_figure(result, "influence"),
            "By how many of its sigmas the parameter that changes most would change without each.",
        ),
        norm=Picture(
            norm_figure(result, "norm"),
            "Length of the field minus its strength. Bars: one sigma of noise. Circles below: by a fit that "
            "had not seen that direction, which is what to expect of new data.",
        ),
        dip=_dip(result),
        points=tuple(_points(result.points, result.log.time)),
        fit=f"Chi-square {triad.chi_square:.4g} for {triad.degrees_of_freedom} degrees of freedom.",
        groups=parameter_groups_of(result),
        matrices=matrices(triad),
        method=method_lines(result),
    )


def parameter_groups_of(result: MagnetometerResult) -> tuple[ParameterGroup, ...]:
    """Prints the parameters of the triad, the response to current, and the field."""
    others = [list(result.current)] if result.current else []
    others += [[result.strength], [result.dip]]
    printed = (
        printed_group(
            group_title(group[0].name.rpartition(" ")[0] or group[0].name), group, [None] * len(group)
        )
        for group in others
    )
    return (*parameter_groups(result.magnetometer, ()), *printed)


def _dip(result: MagnetometerResult) -> Picture | None:
    if not result.aligned:
        return None
    return Picture(
        dip_figure(result, "dip"),
        "Dip of the field at each rest minus that of all, which is one dip where no iron is near. Hollow: "
        "left out as disturbed.",
    )


def _points(points: tuple[FieldPoint, ...], time: LogTime) -> tuple[PrintedPoint, ...]:
    return tuple(
        PrintedPoint(
            str(number),
            time.span(point.start, point.end),
            significant(point.before, 3),
            measurement(point.after, point.sigma),
            measurement(point.dip, point.dip_sigma) if point.dip == point.dip else "",
            "disturbed" if point.disturbed else "",
        )
        for number, point in enumerate(points, 1)
    )


def _identity(result: MagnetometerResult) -> Identity:
    return Identity(
        "Magnetometer", result.name, result.serial, result.provenance, result.software, result.log.time.date
    )


MAGNETOMETER_REPORT = ResultPage(
    "tumble.procedures.magnetometer.report", "magnetometer.html.j2", magnetometer_page, _identity
)
