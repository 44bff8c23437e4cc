"""Stretches of time between events of a replay: what opens them, and what closes them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tumble.procedures.redundancy.result import RedundancyEvent


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of time; s."""

    start: float
    end: float
    kind: str = ""


@dataclass(frozen=True, slots=True)
class Disagreement:
    """A stretch of time in which two units contradicted each other and nobody knew which was wrong; s."""

    start: float
    end: float
    units: tuple[str, str]
    cause: RedundancyEvent
    """`disagree`, with its figures."""
    is_open: bool
    """Indicates whether it lasted to the end."""


ISOLATING = ("out of family", "noisy", "isolated")
"""Faults that isolate a unit, and so end a disagreement."""


def between(
    events: Iterable[RedundancyEvent], opening: Sequence[str], closing: Sequence[str], end: float
) -> tuple[Span, ...]:
    """Returns the stretches from one of the opening events to one of the closing ones, or to the end, s."""
    found: list[Span] = []
    since: float | None = None
    for event in events:
        if event.event in opening and since is None:
            since = event.time
        elif event.event in closing and since is not None:
            # The event that closes a span may have an earlier time, of a clock that went back.
            found.append(Span(since, max(since, event.time)))
            since = None
    return (*found, Span(since, max(since, end))) if since is not None else tuple(found)


def unhealthy_spans(events: Sequence[RedundancyEvent], unit: str, end: float) -> tuple[Span, ...]:
    """Returns where something was wrong with a unit."""
    return between(of_unit(events, unit), ("unhealthy",), ("healthy",), end)


def disagreements(events: Iterable[RedundancyEvent], end: float) -> Iterator[Disagreement]:
    """Returns each disagreement in turn; of one sensor there is one at a time."""
    begun: dict[object, RedundancyEvent] = {}
    for event in events:
        sensor = event.figures.get("sensor")
        cause = begun.get(sensor)
        if cause is not None and _ends_a_disagreement(event):
            yield _disagreement(begun.pop(sensor), event.time, is_open=False)
        if event.event == "disagree":
            begun[sensor] = event
    for cause in begun.values():
        yield _disagreement(cause, end, is_open=True)


def of_unit(events: Iterable[RedundancyEvent], unit: str) -> list[RedundancyEvent]:
    """Returns the events that concern a unit."""
    return [event for event in events if event.unit == unit]


def _ends_a_disagreement(event: RedundancyEvent) -> bool:
    named = event.event == "unhealthy" and event.figures.get("reason") in ISOLATING
    return named or event.event in ("agree", "disagree")


def _disagreement(cause: RedundancyEvent, end: float, *, is_open: bool) -> Disagreement:
    other = cause.figures["other"]
    name = str(other[0]) if isinstance(other, tuple) else str(other)
    return Disagreement(cause.time, max(cause.time, end), (cause.unit, name), cause, is_open)
