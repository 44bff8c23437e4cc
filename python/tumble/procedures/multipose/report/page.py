"""The page of a multi-pose calibration: what it shows, gathered from the result as text and pictures."""

from __future__ import annotations

from dataclasses import dataclass

from tumble.foundation.results import TriadResult
from tumble.procedures.multipose.report.ferraris import ComparedRow, compared
from tumble.procedures.multipose.report.figures import (
    influence_figure,
    norm_figure,
    sphere_figure,
    turn_figure,
)
from tumble.procedures.multipose.report.text import method_lines, next_sentences, sentences
from tumble.procedures.multipose.result import MultiposeResult
from tumble.report.figures import recording_figure
from tumble.report.identity import Identity
from tumble.report.page import Picture, ResultPage
from tumble.report.parameters import (
    NoiseRow,
    ParameterGroup,
    PrintedMatrix,
    matrices,
    noise_rows,
    parameter_groups,
)
from tumble.report.rests import RestRow, rest_rows


@dataclass(frozen=True, slots=True)
class MultiposeSection:
    """Everything printed of one triad."""

    name: str
    fit: str
    groups: tuple[ParameterGroup, ...]
    matrices: tuple[PrintedMatrix, ...]
    noise: tuple[NoiseRow, ...]


@dataclass(frozen=True, slots=True)
class MultiposePage:
    """Data for the template."""

    name: str
    serial: str
    verdict: str
    sentences: tuple[str, ...]
    advice: tuple[str, ...]
    warnings: tuple[str, ...]
    sphere: Picture
    influence: Picture
    norm: Picture
    turns: Picture | None
    no_gyroscope: str
    triads: tuple[MultiposeSection, ...]
    ferraris: tuple[ComparedRow, ...]
    recording: Picture
    rests: tuple[RestRow, ...]
    method: tuple[tuple[str, str], ...]


def multipose_page(result: MultiposeResult) -> MultiposePage:
    """Gathers the page."""
    return MultiposePage(
        name=result.name,
        serial=result.serial,
        verdict=result.verdict,
        sentences=tuple(sentences(result)),
        advice=tuple(next_sentences(result)),
        warnings=result.warnings,
        sphere=Picture(
            sphere_figure(result, "sphere"),
            "Which direction of the case was up at each rest, seen from +z and, right, through the unit from "
            "+z; equal areas show equal parts of the sphere, the edge is where z is level. Dark: rests "
            "without which a parameter would change by more than its sigma. Hollow: the one that would help "
            "most, where one would lower the largest sigma by a tenth or more.",
        ),
        influence=Picture(
            influence_figure(result, "influence"),
            "By how many of its sigmas the parameter that changes most would change without each rest.",
        ),
        norm=Picture(
            norm_figure(result, "norm"),
            "Length of specific force at each rest minus gravity. Bars: one sigma of noise. Circles below: "
            "by a fit that had seen no rest in that orientation, which is what to expect of new data.",
        ),
        turns=_turns(result),
        no_gyroscope=result.gyroscope_reason,
        triads=tuple(
            MultiposeSection(
                triad.triad,
                f"Chi-square {triad.chi_square:.4g} for {triad.degrees_of_freedom} degrees of freedom.",
                parameter_groups(triad, ()),
                matrices(triad),
                noise_rows(triad),
            )
            for triad in _printed_triads(result)
        ),
        ferraris=tuple(compared(result)),
        recording=Picture(
            recording_figure(result.trace, result.rests, result.log.time, "rec"),
            "Means over short segments. Shaded: rests, numbered as above.",
        ),
        rests=rest_rows(result.rests, result.log.time),
        method=method_lines(result),
    )


def _printed_triads(result: MultiposeResult) -> tuple[TriadResult, ...]:
    return (*result.triads, *(() if result.magnetometer is None else result.magnetometer.triads))


def _turns(result: MultiposeResult) -> Picture | None:
    if not result.turns:
        return None
    return Picture(
        turn_figure(result, "turns"),
        "Angle between gravity as the gyroscope turned it from one rest to the next, and as the calibrated "
        "accelerometer found it there.",
    )


def _identity(result: MultiposeResult) -> Identity:
    return Identity(
        "Multi-pose", result.name, result.serial, result.provenance, result.software, result.log.time.date
    )


MULTIPOSE_REPORT = ResultPage(
    "tumble.procedures.multipose.report", "multipose.html.j2", multipose_page, _identity
)
