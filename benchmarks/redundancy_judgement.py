"""Accuracy of fault isolation: named unit and delay against the truth, from the events alone.

`benchmarks/README.md` defines the outcomes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, get_args

Event: TypeAlias = tuple[float, int, str, dict[str, Any]]
"""Time s, unit, event, figures."""
Outcome = Literal["right", "wrong", "unknown", "missed", "too early"]
OUTCOMES: tuple[Outcome, ...] = get_args(Outcome)
INVALID = ("saturated",)
"""Reasons of `unhealthy` that name nobody wrong."""
END = 0.2
"""s before the end of all samples, in which streams that end are late."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """Outcome that the events amount to."""

    outcome: Outcome | None
    """None where there was no fault."""
    isolated: float | None
    """s from the fault to the faulty unit being named, where that is right."""
    seen: float | None
    """s from the fault to any report of it."""
    also: int
    """Times a sound unit was named after the faulty one was."""
    faulty_in_health: int
    disagree_in_health: int
    health: float
    """s without a fault."""
    changes_in_health: int
    """Times another unit became the source without a fault, and times none was left."""
    without_source_in_health: float
    """s in which none was left without a fault."""
    changes: int
    """Changes of the source since there was a fault."""
    without_source: float
    """s since then in which none was left."""


def judge(events: Sequence[Event], faulty: int | None, onset: float, end: float) -> Judgement:
    """Counts; `faulty` is the unit whose fault begins at `onset` s, none where all are sound to the `end`."""
    if faulty is None:
        onset = end
    told = [event for event in events if event[0] < end - END]
    named = [(time, unit) for time, unit, what, figures in told if what == "unhealthy" and _names(figures)]
    disagreed = [time for time, _, what, _ in told if what == "disagree"]
    sources = [event for event in told if event[2] == "selected" and event[3]["reason"] != "start"]
    early = [each for each in named if each[0] < onset]
    isolated_at = min((time for time, unit in named if time >= onset and unit == faulty), default=None)
    others = [time for time, unit in named if time >= onset and unit != faulty]
    seen = min((time for time in (*others, *disagreed, *_known(isolated_at)) if time >= onset), default=None)
    outcome = None if faulty is None else _outcome(bool(early), isolated_at, min(others, default=None), seen)
    return Judgement(
        outcome=outcome,
        isolated=isolated_at - onset if outcome == "right" and isolated_at is not None else None,
        seen=None if seen is None else seen - onset,
        also=sum(isolated_at is not None and time > isolated_at for time in others),
        faulty_in_health=len(early),
        disagree_in_health=sum(time < onset for time in disagreed),
        health=onset,
        changes_in_health=sum(event[0] < onset for event in sources),
        without_source_in_health=without_source(events, 0.0, onset),
        changes=sum(event[0] >= onset for event in sources),
        without_source=without_source(events, onset, end),
    )


def _names(figures: dict[str, Any]) -> bool:
    return figures["reason"] not in INVALID


def _known(time: float | None) -> tuple[float, ...]:
    return () if time is None else (time,)


def _outcome(early: bool, isolated_at: float | None, other: float | None, seen: float | None) -> Outcome:
    if early:
        return "too early"
    if other is not None and (isolated_at is None or other <= isolated_at):
        return "wrong"
    if isolated_at is not None:
        return "right"
    return "missed" if seen is None else "unknown"


def source_spans(events: Iterable[Event], end: float) -> list[tuple[float, float, int | None]]:
    """Returns from when to when, s, each unit was the source; no unit where none was fit."""
    selected = [
        (time, None if figures["reason"] == "none fit" else unit)
        for time, unit, what, figures in events
        if what == "selected"
    ]
    ends = [time for time, _ in selected[1:]] + [end]
    return [(time, until, unit) for (time, unit), until in zip(selected, ends, strict=True)]


def without_source(events: Iterable[Event], start: float, end: float) -> float:
    """For how many s between two times no unit was the source; before the first is, nothing is reported."""
    none = [(first, last) for first, last, unit in source_spans(events, end) if unit is None]
    return sum((max(0.0, min(last, end) - max(first, start)) for first, last in none), 0.0)
