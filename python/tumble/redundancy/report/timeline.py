"""The events of a replay as spans and marks on one axis of time: modes, health, source, rests."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from tumble.recording import FloatArray
from tumble.redundancy.result import Figure, RedundancyEvent, RedundancyResult

WAITING, COLLECTING = "waiting for motion", "collecting"
MARKED = ("triggered", "adopted", "refused", "abandoned", "withheld", "restored", "record rejected")
"""Events that stand as a mark on the time line."""

COVERED = "already calibrating"
"""Why nothing more is done about a deviation: a calibration under way covers it, so it is no news."""

_ENDS_A_CALIBRATION = ("fitted", "adopted", "refused", "abandoned")


@dataclass(frozen=True, slots=True)
class LaneSpan:
    """A stretch of time; s."""

    start: float
    end: float
    kind: str = ""


@dataclass(frozen=True, slots=True)
class Lane:
    """What one unit went through."""

    unit: str
    modes: tuple[LaneSpan, ...]
    """`WAITING` and `COLLECTING`; none for the primary."""
    unhealthy: tuple[LaneSpan, ...]
    source: tuple[LaneSpan, ...]
    """Where it was the source of the output."""
    marks: tuple[RedundancyEvent, ...]


@dataclass(frozen=True, slots=True)
class TimeLine:
    """Everything on one axis of time, s."""

    start: float
    end: float
    rests: tuple[LaneSpan, ...]
    no_source: tuple[LaneSpan, ...]
    lanes: tuple[Lane, ...]
    """Primary first."""
    jumps: tuple[float, ...]
    """Where the common clock jumped."""


@dataclass(slots=True)
class Evaluations:
    """One kind of check of one sensor of one unit, at every evaluation: lists of equal length."""

    time: list[float] = field(default_factory=list)
    deviation: list[float] = field(default_factory=list)
    threshold: list[float] = field(default_factory=list)
    exceeded: list[bool] = field(default_factory=list)


def time_line(result: RedundancyResult) -> TimeLine:
    """Lay the events of a replay out over time."""
    start, end = shown_range(result)
    return TimeLine(
        start=start,
        end=end,
        rests=rests(result.events, end),
        no_source=tuple(LaneSpan(span.start, span.end) for span in result.selected if not span.unit),
        lanes=tuple(_lane(result, unit, end) for unit in (result.primary, *result.secondaries)),
        jumps=tuple(event.time for event in result.events if event.event == "time jumped"),
    )


def shown_range(result: RedundancyResult) -> tuple[float, float]:
    """Return the time that holds all events, s; never empty, so that it can be an axis."""
    times = [result.start, result.end, *(event.time for event in result.events)]
    finite = [time for time in times if math.isfinite(time)] or [0.0]
    start, end = min(finite), max(finite)
    return start, end if end > start else start + 1.0


def rests(events: Sequence[RedundancyEvent], end: float) -> tuple[LaneSpan, ...]:
    """Return where the platform stood still; a rest without an end lasts to the end of the replay."""
    return _between(events, ("rest began",), ("rest ended", "time jumped"), end)


def unhealthy_spans(events: Sequence[RedundancyEvent], unit: str, end: float) -> tuple[LaneSpan, ...]:
    """Return where something was wrong with a unit."""
    return _between(_of(events, unit), ("unhealthy",), ("healthy",), end)


def evaluations(result: RedundancyResult, unit: str, sensor: str) -> dict[str, Evaluations]:
    """Gather the evaluations of one sensor by check (`norm`, `vector`); magnitudes, SI."""
    found: dict[str, Evaluations] = {}
    for event in _of(result.events, unit):
        if event.event != "evaluated" or event.figures.get("sensor") != sensor:
            continue
        series = found.setdefault(str(event.figures.get("check", "norm")), Evaluations())
        series.time.append(event.time)
        series.deviation.append(abs(number(event.figures.get("deviation"))))
        series.threshold.append(number(event.figures.get("threshold")))
        series.exceeded.append(bool(event.figures.get("exceeded", False)))
    return found


def number(figure: Figure | None) -> float:
    """Return a figure as a number; NaN where it is none."""
    return float(figure) if isinstance(figure, (int, float)) else math.nan


def merged(spans: Iterable[LaneSpan], shortest_gap: float) -> list[LaneSpan]:
    """Join spans of a kind whose gaps are too short to be seen, so that thousands stay drawable."""
    joined: list[LaneSpan] = []
    for span in spans:
        if joined and joined[-1].kind == span.kind and span.start - joined[-1].end < shortest_gap:
            last = joined.pop()
            span = LaneSpan(last.start, max(last.end, span.end), span.kind)
        joined.append(span)
    return joined


def inside(time: FloatArray, spans: Iterable[LaneSpan]) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Say which times (n,) lie in any of the spans."""
    found = np.zeros(len(time), dtype=np.bool_)
    for span in spans:
        found |= (time >= span.start) & (time < span.end)
    return found


def _lane(result: RedundancyResult, unit: str, end: float) -> Lane:
    return Lane(
        unit=unit,
        modes=tuple(_modes(_of(result.events, unit), end)),
        unhealthy=unhealthy_spans(result.events, unit, end),
        source=tuple(LaneSpan(span.start, span.end) for span in result.selected if span.unit == unit),
        marks=tuple(
            event
            for event in _of(result.events, unit)
            if event.event in MARKED and event.figures.get("reason") != COVERED
        ),
    )


def _modes(events: Iterable[RedundancyEvent], end: float) -> Iterable[LaneSpan]:
    """Follow a secondary through its modes; one that is open at the end lasts to the end."""
    mode, since = "", 0.0
    for event in events:
        after = _mode_after(event.event, mode)
        if after != mode:
            if mode:
                yield LaneSpan(since, event.time, mode)
            mode, since = after, event.time
    if mode:
        yield LaneSpan(since, max(since, end), mode)


def _mode_after(event: str, mode: str) -> str:
    if event == "triggered":
        return WAITING
    if event == "motion began" and mode == WAITING:
        return COLLECTING
    return "" if event in _ENDS_A_CALIBRATION else mode


def _of(events: Iterable[RedundancyEvent], unit: str) -> list[RedundancyEvent]:
    return [event for event in events if event.unit == unit]


def _between(
    events: Iterable[RedundancyEvent], opening: Sequence[str], closing: Sequence[str], end: float
) -> tuple[LaneSpan, ...]:
    found: list[LaneSpan] = []
    since: float | None = None
    for event in events:
        if event.event in opening and since is None:
            since = event.time
        elif event.event in closing and since is not None:
            # What closes a span may carry the time of a clock that went back.
            found.append(LaneSpan(since, max(since, event.time)))
            since = None
    return (*found, LaneSpan(since, max(since, end))) if since is not None else tuple(found)
