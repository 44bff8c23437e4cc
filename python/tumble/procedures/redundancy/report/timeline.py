"""The events of a replay as spans and marks on one axis of time: modes, health, source, rests."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.procedures.redundancy.known_faults import COVERED
from tumble.procedures.redundancy.result import Figure, RedundancyEvent, RedundancyResult
from tumble.procedures.redundancy.spans import (
    ISOLATING,
    Disagreement,
    Span,
    between,
    disagreements,
    of_unit,
    unhealthy_spans,
)

WAITING, COLLECTING = "waiting for motion", "collecting"
MARKED = ("triggered", "adopted", "refused", "abandoned", "withheld", "restored", "record rejected")
"""Events that stand as a mark on the time line."""

_ENDS_A_CALIBRATION = ("fitted", "adopted", "refused", "abandoned")


@dataclass(frozen=True, slots=True)
class Lane:
    """States of one unit over time."""

    unit: str
    modes: tuple[Span, ...]
    """`WAITING` and `COLLECTING`; none for the primary."""
    unhealthy: tuple[Span, ...]
    source: tuple[Span, ...]
    """Where it was the source of the output."""
    marks: tuple[RedundancyEvent, ...]


@dataclass(frozen=True, slots=True)
class TimeLine:
    """Everything on one axis of time, s."""

    start: float
    end: float
    rests: tuple[Span, ...]
    no_source: tuple[Span, ...]
    lanes: tuple[Lane, ...]
    """Primary first."""
    jumps: tuple[float, ...]
    """Where the common clock jumped."""
    disagreements: tuple[Disagreement, ...] = ()


@dataclass(slots=True)
class Evaluations:
    """One kind of check of one sensor of one unit, at every evaluation: lists of equal length."""

    time: list[float] = field(default_factory=list)
    deviation: list[float] = field(default_factory=list)
    threshold: list[float] = field(default_factory=list)
    exceeded: list[bool] = field(default_factory=list)


def time_line(result: RedundancyResult) -> TimeLine:
    """Arranges the events of a replay over time."""
    start, end = shown_range(result)
    return TimeLine(
        start=start,
        end=end,
        rests=rests(result.events, end),
        no_source=tuple(Span(span.start, span.end) for span in result.selected if not span.unit),
        lanes=tuple(_lane(result, unit, end) for unit in (result.primary, *result.secondaries)),
        jumps=tuple(event.time for event in result.events if event.event == "time jumped"),
        disagreements=tuple(disagreements(result.events, end)),
    )


def shown_range(result: RedundancyResult) -> tuple[float, float]:
    """Returns the time that holds all events, s; never empty, so that it can be an axis."""
    times = [result.start, result.end, *(event.time for event in result.events)]
    finite = [time for time in times if math.isfinite(time)] or [0.0]
    start, end = min(finite), max(finite)
    return start, end if end > start else start + 1.0


def rests(events: Sequence[RedundancyEvent], end: float) -> tuple[Span, ...]:
    """Returns where the platform stood still; a rest without an end lasts to the end of the replay."""
    return between(events, ("rest began",), ("rest ended", "time jumped"), end)


def evaluations(result: RedundancyResult, unit: str, sensor: str) -> dict[str, Evaluations]:
    """Gathers the evaluations of one sensor by check (`norm`, `vector`); magnitudes, SI."""
    found: dict[str, Evaluations] = {}
    for event in of_unit(result.events, unit):
        if event.event != "evaluated" or event.figures.get("sensor") != sensor:
            continue
        series = found.setdefault(str(event.figures.get("check", "norm")), Evaluations())
        series.time.append(event.time)
        series.deviation.append(abs(number(event.figures.get("deviation"))))
        series.threshold.append(number(event.figures.get("threshold")))
        series.exceeded.append(bool(event.figures.get("exceeded", False)))
    return found


def is_verdict(event: RedundancyEvent) -> bool:
    """Returns whether an event isolates a faulty unit, and states the evidence."""
    return event.event == "unhealthy" and event.figures.get("reason") in (*ISOLATING, "refuted")


def number(figure: Figure | None) -> float:
    """Returns a figure as a number; NaN where it is none."""
    return float(figure) if isinstance(figure, (int, float)) else math.nan


def merged(spans: Iterable[Span], shortest_gap: float) -> list[Span]:
    """Joins spans of a kind whose gaps are too short to be seen, so that thousands stay drawable."""
    joined: list[Span] = []
    for span in spans:
        if joined and joined[-1].kind == span.kind and span.start - joined[-1].end < shortest_gap:
            last = joined.pop()
            span = Span(last.start, max(last.end, span.end), span.kind)
        joined.append(span)
    return joined


def inside(time: FloatArray, spans: Iterable[Span]) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Returns for (n,) times whether they lie in any of the spans."""
    found = np.zeros(len(time), dtype=np.bool_)
    for span in spans:
        found |= (time >= span.start) & (time < span.end)
    return found


def _lane(result: RedundancyResult, unit: str, end: float) -> Lane:
    return Lane(
        unit=unit,
        modes=tuple(_modes(of_unit(result.events, unit), end)),
        unhealthy=unhealthy_spans(result.events, unit, end),
        source=tuple(Span(span.start, span.end) for span in result.selected if span.unit == unit),
        marks=tuple(
            event
            for event in of_unit(result.events, unit)
            if is_verdict(event) or (event.event in MARKED and event.figures.get("reason") != COVERED)
        ),
    )


def _modes(events: Iterable[RedundancyEvent], end: float) -> Iterable[Span]:
    """Follows a secondary through its modes; one that is open at the end lasts to the end."""
    mode, since = "", 0.0
    for event in events:
        after = _mode_after(event.event, mode)
        if after != mode:
            if mode:
                yield Span(since, event.time, mode)
            mode, since = after, event.time
    if mode:
        yield Span(since, max(since, end), mode)


def _mode_after(event: str, mode: str) -> str:
    if event == "triggered":
        return WAITING
    if event == "motion began" and mode == WAITING:
        return COLLECTING
    return "" if event in _ENDS_A_CALIBRATION else mode
