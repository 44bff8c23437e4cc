"""The page of calibrations that were held against each other, and over time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tumble.foundation.units import CALIBRATED_TRIADS
from tumble.report.identity import Identity, serials
from tumble.report.page import Picture, ResultPage
from tumble.tools.compare.report.figures import history_figure, sigmas_figure
from tumble.tools.compare.report.text import (
    HISTORY_COLUMNS,
    MOTION_COLUMNS,
    PARAMETER_COLUMNS,
    TEST_COLUMNS,
    differs_sentence,
    drift_sentence,
    hidden,
    history_rows,
    matters_sentences,
    method_lines,
    motion_rows,
    parameter_rows,
    sentences,
    test_cells,
    tests_of,
    verdict_sentence,
)
from tumble.tools.compare.result import CompareResult, Pair

Rows = tuple[tuple[str, tuple[str, ...]], ...]


@dataclass(frozen=True, slots=True)
class ComparedTable:
    """Rows under columns."""

    title: str
    columns: tuple[str, ...]
    rows: Rows


@dataclass(frozen=True, slots=True)
class PairSection:
    """Everything shown of two calibrations."""

    name: str
    verdict: str
    differs: str
    matters: tuple[str, ...]
    picture: Picture | None
    sentence: str
    sentences: tuple[str, ...]
    hidden: tuple[str, ...]
    notes: tuple[str, ...]
    tables: tuple[ComparedTable, ...]


@dataclass(frozen=True, slots=True)
class ComparePage:
    """Data for the template of the page."""

    title: str
    verdict: str
    pairs: tuple[PairSection, ...]
    drift: str
    pictures: tuple[Picture, ...]
    history: ComparedTable | None
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    method: tuple[tuple[str, str], ...]


def compare_page(result: CompareResult) -> ComparePage:
    """Gathers the page."""
    rows = tuple(history_rows(result.history))
    return ComparePage(
        title=" · ".join(result.names),
        verdict=result.verdict,
        pairs=tuple(_section(pair, number) for number, pair in enumerate(result.pairs, start=1)),
        drift=drift_sentence(result),
        pictures=tuple(_pictures(result)),
        history=ComparedTable("parameter", HISTORY_COLUMNS, rows) if rows else None,
        warnings=result.warnings,
        notes=result.notes,
        method=method_lines(result),
    )


def _section(pair: Pair, number: int) -> PairSection:
    return PairSection(
        name=pair.name,
        verdict=pair.verdict,
        differs=differs_sentence(pair),
        matters=tuple(matters_sentences(pair)),
        picture=_picture(pair, number),
        sentence=verdict_sentence(pair),
        sentences=tuple(sentences(pair)),
        hidden=tuple(hidden(pair)),
        notes=pair.notes,
        tables=(
            ComparedTable("as an error", MOTION_COLUMNS, motion_rows(pair)),
            ComparedTable(
                "tested together",
                TEST_COLUMNS,
                tuple((each.name, test_cells(each)) for each in tests_of(pair)),
            ),
            ComparedTable(
                "parameter",
                (pair.first, pair.second, *PARAMETER_COLUMNS[2:]),
                tuple(parameter_rows(pair)),
            ),
        ),
    )


def _picture(pair: Pair, number: int) -> Picture | None:
    compared = [each for each in pair.differences if each.compared]
    if not compared:
        return None
    caption = f"Each parameter of {pair.second} minus that of {pair.first}, in sigmas of the difference."
    return Picture(sigmas_figure(compared, f"sigmas-{number}"), caption)


def _pictures(result: CompareResult) -> Iterator[Picture]:
    caption = (
        "Each calibration minus the mean of all, with its 95 % interval; the straight line that fits "
        "best, and, dotted, its 95 % interval."
    )
    for triad in CALIBRATED_TRIADS:
        if found := [each for each in result.history if each.name.startswith(triad)]:
            yield Picture(history_figure(found, f"history-{triad}"), f"{triad.capitalize()}. {caption}")


def _identity(result: CompareResult) -> Identity:
    known = serials(tuple(zip(result.names, result.serials, strict=True)))
    return Identity("Compare", " · ".join(result.names), known, result.provenance, result.software)


COMPARE_REPORT = ResultPage("tumble.tools.compare.report", "compare.html.j2", compare_page, _identity)
