"""The page of a drift over temperature: curves, orders, parameters, method."""

from __future__ import annotations

from dataclasses import dataclass

from tumble.foundation.units import Triad
from tumble.procedures.thermal.report.figures import drift_figure
from tumble.procedures.thermal.report.text import (
    COLUMNS,
    axis_rows,
    method_lines,
    parameter_rows,
    score_rows,
    sentences,
    unseen,
)
from tumble.procedures.thermal.result import ThermalResult
from tumble.report.identity import Identity
from tumble.report.page import Picture, ResultPage


@dataclass(frozen=True, slots=True)
class ThermalSection:
    """Everything shown of one triad."""

    name: Triad
    picture: Picture
    parameters: tuple[tuple[str, tuple[str, ...]], ...]
    scores: tuple[tuple[str, tuple[str, ...]], ...]


@dataclass(frozen=True, slots=True)
class ThermalPage:
    """Data for the template of the page."""

    name: str
    serial: str
    verdict: str
    sentences: tuple[str, ...]
    unseen: tuple[str, ...]
    warnings: tuple[str, ...]
    columns: tuple[str, ...]
    rows: tuple[tuple[str, tuple[str, ...]], ...]
    triads: tuple[ThermalSection, ...]
    method: tuple[tuple[str, str], ...]


def thermal_page(result: ThermalResult) -> ThermalPage:
    """Gathers the page."""
    return ThermalPage(
        name=result.name,
        serial=result.serial,
        verdict=result.verdict,
        sentences=tuple(sentences(result)),
        unseen=tuple(unseen(result)),
        warnings=result.warnings,
        columns=COLUMNS,
        rows=axis_rows(result),
        triads=tuple(_section(result, triad) for triad in result.triads),
        method=method_lines(result),
    )


def _section(result: ThermalResult, triad: Triad) -> ThermalSection:
    caption = (
        "Above: means over stretches at rest, minus the reading in the same pose at the reference. Filled: "
        "while warming; hollow: while cooling. Lines: the curve that is stored and its 95 % interval, with "
        "half the hysteresis where that is clear. Below: the same minus the curve."
    )
    axes = result.of_triad(triad)
    return ThermalSection(
        name=triad,
        picture=Picture(drift_figure(axes, result.blocks, f"drift-{triad}"), caption),
        parameters=parameter_rows(result, triad),
        scores=score_rows(axes),
    )


def _identity(result: ThermalResult) -> Identity:
    return Identity("Thermal", result.name, result.serial, result.provenance, result.software, result.started)


THERMAL_REPORT = ResultPage("tumble.procedures.thermal.report", "thermal.html.j2", thermal_page, _identity)
