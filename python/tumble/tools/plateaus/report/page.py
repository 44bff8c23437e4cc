"""The page of a calibration over temperature: curves, coefficients, tests, method."""

from __future__ import annotations

from dataclasses import dataclass

from tumble.foundation.units import CalibratedTriad
from tumble.report.identity import Identity
from tumble.report.page import Picture, ResultPage
from tumble.tools.plateaus.report.figures import curves_figure
from tumble.tools.plateaus.report.text import (
    COLUMNS,
    Rows,
    axis_rows,
    constant_sentences,
    method_lines,
    parameter_rows,
    prediction_rows,
    score_rows,
    sentences,
)
from tumble.tools.plateaus.result import PlateausResult, TriadOverTemperature


@dataclass(frozen=True, slots=True)
class PlateausSection:
    """Everything shown of one triad."""

    name: CalibratedTriad
    picture: Picture
    parameters: Rows
    orders: tuple[str, ...]
    scores: Rows
    predictions: Rows


@dataclass(frozen=True, slots=True)
class PlateausPage:
    """Data for the template of the page."""

    name: str
    serial: str
    verdict: str
    sentences: tuple[str, ...]
    constant: tuple[str, ...]
    warnings: tuple[str, ...]
    columns: tuple[str, ...]
    rows: Rows
    triads: tuple[PlateausSection, ...]
    method: tuple[tuple[str, str], ...]


def plateaus_page(result: PlateausResult) -> PlateausPage:
    """Gathers the page."""
    return PlateausPage(
        name=result.name,
        serial=result.serial,
        verdict=result.verdict,
        sentences=tuple(sentences(result)),
        constant=tuple(constant_sentences(result)),
        warnings=result.warnings,
        columns=COLUMNS,
        rows=axis_rows(result),
        triads=tuple(_section(triad) for triad in result.triads),
        method=method_lines(result),
    )


def _section(triad: TriadOverTemperature) -> PlateausSection:
    caption = (
        "Each calibration minus the result at the reference. Filled: reached by warming; hollow: by cooling. "
        "Lines: the curve that is stored and its 95 % interval, with half the hysteresis where that is clear."
    )
    scores = score_rows(triad)
    highest = max((len(cells) for _, cells in scores), default=0)
    return PlateausSection(
        name=triad.triad,
        picture=Picture(curves_figure(triad, f"curves-{triad.triad}"), caption),
        parameters=parameter_rows(triad),
        orders=tuple(str(order) for order in range(1, highest + 1)),
        scores=scores,
        predictions=prediction_rows(triad),
    )


def _identity(result: PlateausResult) -> Identity:
    return Identity("Plateaus", result.name, result.serial, result.provenance, result.software)


PLATEAUS_REPORT = ResultPage("tumble.tools.plateaus.report", "plateaus.html.j2", plateaus_page, _identity)
