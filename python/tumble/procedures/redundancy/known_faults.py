"""Known faults that remained: the first statements of a summary, and the reason for its exit code."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import TYPE_CHECKING, Literal

import numpy as np

from tumble.foundation.units import TRIADS
from tumble.procedures.redundancy.spans import Span, disagreements, of_unit, unhealthy_spans

if TYPE_CHECKING:
    from tumble.procedures.redundancy.result import RedundancyEvent, RedundancyResult

    WrongSpans = Callable[[RedundancyResult, str], Iterable[Span]]

KnownFaultKind = Literal[
    "no samples",
    "no source",
    "source unhealthy",
    "source deviates",
    "disagreement",
    "source not calibrated",
    "refuted",
    "not calibrated",
]

NO_SAMPLES: Literal["no samples"] = "no samples"
"""Also the event of a set none of whose units sends samples, which samples alone cannot show."""

OF_THE_SET: tuple[KnownFaultKind, ...] = (
    "no samples",
    "no source",
    "source unhealthy",
    "source deviates",
    "disagreement",
)
"""Kinds by which what the platform would have used is wrong, or may be."""

COVERED = "already calibrating"
"""Why nothing more is done about a deviation: a calibration under way covers it, so it is no news."""


STORED_AS_GOOD = "not better"
"""Why a fit is refused that explains the motion no better than the stored error, which is no fault."""

SHOWN_BY_MOTION = (
    "residual too large",
    "implausible scale",
    "implausible misalignment",
    "implausible lever arm",
)
"""Why a fit is refused whose cause only motion shows: readings within thresholds at rest are no answer."""


@dataclass(frozen=True, slots=True)
class KnownFault:
    """Something that was known to be wrong while nothing was done about it."""

    kind: KnownFaultKind
    start: float
    end: float
    """s of the recordings' common clock."""
    units: tuple[str, ...]
    """Whom it concerns; none where there was no source."""
    cause: RedundancyEvent | None = None
    """Event that reported it; `None` where there was none."""


def known_faults(result: RedundancyResult) -> Iterator[KnownFault]:
    """Returns all of a replay, those of the set before those of single units."""
    yield from _without_samples(result)
    yield from _without_source(result)
    yield from _wrong_source(result, "source unhealthy", _unhealthy)
    yield from _wrong_source(result, "source deviates", _deviating)
    for dispute in disagreements(result.events, result.end):
        if dispute.is_open:
            yield KnownFault("disagreement", dispute.start, dispute.end, dispute.units, dispute.cause)
    yield from _uncalibrated_source(result)
    for unit in result.secondaries:
        yield from _of_secondary(result, unit)


def _without_samples(result: RedundancyResult) -> Iterator[KnownFault]:
    """Returns where time went on in all units at once: they were silent, or their clock jumped."""
    for place, event in enumerate(result.events):
        by = event.figures.get("by")
        if event.event == "time jumped" and isinstance(by, float) and by > 0.0:
            yield KnownFault(NO_SAMPLES, event.time - by, event.time, (), event)
        elif event.event == NO_SAMPLES and all(
            later.event != "time jumped" for later in result.events[place:]
        ):
            ending = next((later.time for later in result.events[place + 1 :]), result.end)
            yield KnownFault(NO_SAMPLES, float(str(event.figures["since"])), ending, (), event)


def _without_source(result: RedundancyResult) -> Iterator[KnownFault]:
    if not result.selected:
        yield KnownFault("no source", result.start, result.end, ())
    for span in result.selected:
        if not span.unit:
            yield KnownFault("no source", span.start, span.end, ())


def _wrong_source(
    result: RedundancyResult, kind: KnownFaultKind, wrong_spans: WrongSpans
) -> Iterator[KnownFault]:
    """Returns where the source was known to be wrong and nothing took its place."""
    sources = {span.unit for span in result.selected}
    shown = {unit: _shows(of_unit(result.events, unit), kind) for unit in sources}
    wrongs = {unit: tuple(wrong_spans(result, unit)) for unit in sources}
    edges = {
        unit: np.array([(each.start, each.end) for each in wrongs[unit]]).reshape(-1, 2) for unit in wrongs
    }
    for place, span in enumerate(result.selected):
        is_last = place == len(result.selected) - 1
        starts = np.maximum(edges[span.unit][:, 0], span.start)
        ends = np.minimum(edges[span.unit][:, 1], span.end)
        replaced = (edges[span.unit][:, 1] >= span.end) & (not is_last)
        for each in np.flatnonzero((starts < ends) & ~replaced):
            cause = _cause(shown[span.unit], wrongs[span.unit][each])
            yield KnownFault(kind, float(starts[each]), float(ends[each]), (span.unit,), cause)


def _unhealthy(result: RedundancyResult, unit: str) -> Iterable[Span]:
    return unhealthy_spans(result.events, unit, result.end)


def _deviating(result: RedundancyResult, unit: str) -> Iterable[Span]:
    """Returns where the latest rest had shown that a unit deviates from gravity, or from standing still."""
    for sensor in TRIADS:
        since: float | None = None
        for event in of_unit(result.events, unit):
            if event.figures.get("sensor") != sensor:
                continue
            exceeds = _exceeds_the_norm(event)
            if exceeds and since is None:
                since = event.time
            elif since is not None and (exceeds is False or event.event == "adopted"):
                yield Span(since, event.time, sensor)
                since = None
        if since is not None:
            yield Span(since, result.end, sensor)


def _exceeds_the_norm(event: RedundancyEvent) -> bool | None:
    """Returns whether a rest showed a deviation; None for any other event."""
    if event.event != "evaluated" or event.figures.get("check") != "norm":
        return None
    return bool(event.figures.get("exceeded"))


def _shows(own: Sequence[RedundancyEvent], kind: KnownFaultKind) -> list[RedundancyEvent]:
    """Returns the events that report a fault of this kind."""
    if kind == "source unhealthy":
        return [event for event in own if event.event == "unhealthy"]
    return [event for event in own if _exceeds_the_norm(event)]


def _cause(shown: Sequence[RedundancyEvent], wrong: Span) -> RedundancyEvent | None:
    """Returns the last that reported it within its time, of its sensor where it is one sensor's."""
    inside = (event for event in reversed(shown) if wrong.start <= event.time <= wrong.end)
    return next((event for event in inside if wrong.kind in ("", event.figures.get("sensor"))), None)


def _uncalibrated_source(result: RedundancyResult) -> Iterator[KnownFault]:
    """Returns where a secondary was the source that was never calibrated nor found to need none."""
    own = {unit: of_unit(result.events, unit) for unit in result.secondaries}
    for span in result.selected:
        if span.unit not in own:
            continue
        stored = [error for error in result.errors if error.unit == span.unit]
        for sensor in TRIADS:
            has_error = any(
                error.sensor == sensor and (error.adopted is None or error.adopted <= span.start)
                for error in stored
            )
            before = [] if has_error else [event for event in own[span.unit] if event.time <= span.start]
            if not has_error and not _agrees(before, sensor):
                yield KnownFault("source not calibrated", span.start, span.end, (span.unit,))
                break


def _of_secondary(result: RedundancyResult, unit: str) -> Iterator[KnownFault]:
    own = of_unit(result.events, unit)
    refuted = _refuted(own)
    if refuted is not None:
        yield KnownFault("refuted", refuted.time, result.end, (unit,), refuted)
        return
    wanted = [
        event
        for event in own
        if event.event == "triggered" or (event.event == "withheld" and event.figures["reason"] != COVERED)
    ]
    adopted = any(event.event == "adopted" for event in own)
    known = any(error.unit == unit for error in result.errors) or any(
        event.event == "evaluated" for event in own
    )
    last = wanted[-1] if wanted else None
    cleared = last is not None and last.event == "withheld" and _agrees(own, str(last.figures["sensor"]))
    if not adopted and (not known or (last is not None and not cleared)):
        ending = [event for event in own if event.event in ("triggered", "withheld", "refused", "abandoned")]
        start = last.time if last is not None else result.start
        cause = ending[-1] if ending else _unhealthy_at_the_end(own)
        yield KnownFault("not calibrated", start, result.end, (unit,), cause)
        return
    for sensor in TRIADS:
        if (refused := _refused_at_last(own, sensor)) is not None:
            yield KnownFault("not calibrated", refused.time, result.end, (unit,), refused)
            return


def _refused_at_last(own: Sequence[RedundancyEvent], sensor: str) -> RedundancyEvent | None:
    """Returns what refused the last fit of a sensor, unless readings at rest have answered it."""
    fits = [
        event
        for event in own
        if event.event in ("adopted", "refused") and event.figures.get("sensor") == sensor
    ]
    is_refused = bool(fits) and fits[-1].event == "refused" and fits[-1].figures["reason"] != STORED_AS_GOOD
    if not is_refused:
        return None
    is_answered = fits[-1].figures["reason"] not in SHOWN_BY_MOTION and _agrees(own, sensor)
    return None if is_answered else fits[-1]


def _refuted(own: Sequence[RedundancyEvent]) -> RedundancyEvent | None:
    """Returns what refuted a unit that has not been healthy since."""
    refuted = (event for event in _since_healthy(own) if event.figures.get("reason") == "refuted")
    return next(refuted, None)


def _unhealthy_at_the_end(own: Sequence[RedundancyEvent]) -> RedundancyEvent | None:
    """Returns what was wrong last with a unit that has not been healthy since."""
    return next(_since_healthy(own), None)


def _since_healthy(own: Sequence[RedundancyEvent]) -> Iterator[RedundancyEvent]:
    """Returns the events of a unit's faults since it was healthy, the latest first."""
    told = (event for event in reversed(own) if event.event in ("unhealthy", "healthy"))
    return takewhile(lambda event: event.event == "unhealthy", told)


def _agrees(own: Sequence[RedundancyEvent], sensor: str) -> bool:
    """Returns whether the latest evaluation of a sensor, by whatever checks, was within its thresholds."""
    found = [event for event in own if event.event == "evaluated" and event.figures.get("sensor") == sensor]
    return bool(found) and not any(
        event.figures.get("exceeded") for event in found if event.time == found[-1].time
    )
