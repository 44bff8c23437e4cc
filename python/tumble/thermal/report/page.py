"""The page of a drift over temperature: curves, orders, parameters, method."""

from __future__ import annotations

from dataclasses import dataclass

from tumble.report.identity import Identity
from tumble.report.page import Picture, ResultPage
from tumble.thermal.report.figures import drift_figure
from tumble.thermal.report.text import (
    COLUMNS,
    cells,
    method_lines,
    parameter_rows,
    score_rows,
    sentences,
    unseen,
)
from tumble.thermal.result import ThermalResult
from tumble.units import Triad


@dataclass(frozen=True, slots=True)
class TriadSection:
    """Everything shown of one triad."""

    name: Triad
    picture: Picture
    parameters: tuple[tuple[str, tuple[str, ...]], ...]
    scores: tuple[tuple[str, tuple[str, ...]], ...]


@dataclass(frozen=True, slots=True)
class ThermalPage:
    """What the template of the page is given."""

    name: str
    serial: str
    verdict: str
    sentences: tuple[str, ...]
    unseen: tuple[str, ...]
    warnings: tuple[str, ...]
    columns: tuple[str, ...]
    rows: tuple[tuple[str, tuple[str, ...]], ...]
    triads: tuple[TriadSection, ...]
    method: tuple[tuple[str, str], ...]


def thermal_page(result: ThermalResult) -> ThermalPage:
    """Gather the page."""
    return ThermalPage(
        name=result.name,
        serial=result.serial,
        verdict=result.verdict,
        sentences=tuple(sentences(result)),
        unseen=tuple(unseen(result)),
        warnings=result.warnings,
        columns=COLUMNS,
        rows=tuple((axis.name, cells(axis)) for axis in result.axes),
        triads=tuple(_section(result, triad) for triad in result.triads),
        method=method_lines(result),
    )


def _section(result: ThermalResult, triad: Triad) -> TriadSection:
    caption = (
        "Above: means over stretches at rest, less what was read in the same pose at the reference. Filled: "
        "while warming; hollow: while cooling. Lines: the curve that is stored and its 95 % interval, with "
        "half the hysteresis where that is clear. Below: the same less the curve."
    )
    return TriadSection(
        name=triad,
        picture=Picture(drift_figure(result.of_triad(triad), result.blocks, f"drift-{triad}"), caption),
        parameters=parameter_rows(result, triad),
        scores=score_rows(result.of_triad(triad)),
    )


def _identity(result: ThermalResult) -> Identity:
    return Identity("Thermal", result.name, result.serial, result.provenance, result.software)


THERMAL_REPORT = ResultPage("tumble.thermal.report", "thermal.html.j2", thermal_page, _identity)
