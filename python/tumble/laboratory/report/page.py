"""The page of a unit over time: due dates, drift, control charts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tumble.foundation.provenance import provenance_now
from tumble.foundation.units import CALIBRATED_TRIADS
from tumble.foundation.words import count_of
from tumble.laboratory.history import UnitHistory
from tumble.laboratory.report.figures import drawn, unit_figure
from tumble.laboratory.text import (
    DRIFT_COLUMNS,
    DUE_COLUMNS,
    drift_rows,
    due_rows,
    due_sentence,
    signal_sentences,
)
from tumble.report.identity import Identity
from tumble.report.page import Picture, ResultPage

Rows = tuple[tuple[str, ...], ...]
_CAPTION = (
    "Each value less that of an ideal unit where limits are stated, else less the mean, with its 95 % "
    "interval, without what the reference leaves on all alike; dashed the limits, dotted the 95 % interval "
    "predicted for the true value after the last calibration."
)


@dataclass(frozen=True, slots=True)
class HistoryTable:
    """Rows under columns."""

    columns: tuple[str, ...]
    rows: Rows


@dataclass(frozen=True, slots=True)
class HistoryPage:
    """Content of the page, as the template shows it."""

    title: str
    headline: str
    due: HistoryTable | None
    pictures: tuple[Picture, ...]
    drift: HistoryTable
    signals: tuple[str, ...]
    method: tuple[tuple[str, str], ...]


def history_page(history: UnitHistory) -> HistoryPage:
    """Gather the page."""
    due = tuple(due_rows(history))
    return HistoryPage(
        title=_name(history),
        headline=due_sentence(history),
        due=HistoryTable(DUE_COLUMNS, due) if due else None,
        pictures=tuple(_pictures(history)),
        drift=HistoryTable(DRIFT_COLUMNS, tuple(drift_rows(history))),
        signals=tuple(signal_sentences(history)),
        method=tuple(_method(history)),
    )


def _pictures(history: UnitHistory) -> Iterator[Picture]:
    for triad in CALIBRATED_TRIADS:
        if found := drawn(history.parameters, triad):
            yield Picture(unit_figure(found, f"history-{triad}", triad), f"{triad.capitalize()}. {_CAPTION}")


def _method(history: UnitHistory) -> Iterator[tuple[str, str]]:
    yield "drift", "random walk; q by restricted maximum likelihood, pooled over the units of the model"
    yield "pooled", count_of("unit", history.pooled)
    yield "due", "when the probability of being within the limit falls below 95 %"
    yield "control chart", "individuals and moving range, Western Electric rules"


def _name(history: UnitHistory) -> str:
    unit = history.unit
    made = " ".join(str(unit[key]) for key in ("manufacturer", "model") if unit[key])
    return " · ".join(filter(None, [str(unit["name"]), str(unit["serial"]), made]))


def _identity(history: UnitHistory) -> Identity:
    from tumble import _core

    unit = history.unit
    software = f"tumble {_core.__version__}"
    return Identity("History", str(unit["name"]), str(unit["serial"]), provenance_now(), software)


HISTORY_REPORT = ResultPage("tumble.laboratory.report", "history.html.j2", history_page, _identity)
