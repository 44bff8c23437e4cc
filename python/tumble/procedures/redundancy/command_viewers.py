"""Content of a replayed set for viewers: readings of all units, rests, source, health and events."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Final

from tumble.foundation.recording import FloatArray
from tumble.procedures.redundancy.logs import UnitLog
from tumble.procedures.redundancy.report.text import event_details, event_title
from tumble.procedures.redundancy.report.timeline import COLLECTING, time_line
from tumble.procedures.redundancy.result import RedundancyEvent, RedundancyResult
from tumble.procedures.redundancy.units import UnitSettings
from tumble.tools.viewers.content import (
    SEGMENTS,
    EventLevel,
    ShownEvent,
    ShownSegment,
    ShownUnit,
    UnitPose,
    ViewerContent,
    estimates_of,
    verdict_event,
)

SOURCE, HEALTH, CALIBRATION = "source", "health", "calibration"
"""Lanes of a unit: where it was the source, where something was wrong with it, where pairs were collected."""
_WRONG: Final = ("unhealthy", "disagree", "failover")
_WORTH_A_LOOK: Final = ("triggered", "refused", "abandoned", "withheld", "record rejected", "time jumped")


def viewer_content(
    result: RedundancyResult, units: Sequence[UnitLog], known: Mapping[str, UnitSettings]
) -> ViewerContent:
    """Returns a replay beside the logs of its units, primary first; `known` is what was stated of them."""
    lanes = {lane.unit: lane for lane in time_line(result).lanes}
    rests = tuple(
        ShownSegment("rest", span.start, span.end, str(number))
        for number, span in enumerate(time_line(result).rests, start=1)
    )
    calibrations = result.calibrations
    shown = []
    for unit in units:
        if unit.recording is None:
            continue
        lane, stated = lanes[unit.name], known.get(unit.name, UnitSettings())
        # Times of events are those of the common clock, to which the offset of a unit brings its own.
        offset = stated.time_offset
        segments = {
            SOURCE: [ShownSegment("source", span.start - offset, span.end - offset) for span in lane.source],
            HEALTH: [
                ShownSegment("unhealthy", span.start - offset, span.end - offset) for span in lane.unhealthy
            ],
            CALIBRATION: [
                ShownSegment("collecting", span.start - offset, span.end - offset, span.kind)
                for span in lane.modes
                if span.kind == COLLECTING
            ],
        }
        shown.append(
            ShownUnit(
                unit.name,
                unit.recording,
                calibrations.get(unit.name),
                lanes={name: found for name, found in segments.items() if found}
                | ({SEGMENTS: rests} if unit.name == result.primary else {}),
                parameters=tuple(
                    each
                    for error in result.errors
                    if error.unit == unit.name
                    for each in estimates_of(error.sensor, error.parameters())
                ),
                verdict=result.verdict if unit.name == result.primary else "",
                pose=_pose(stated) if unit.name != result.primary else None,
                on_clock=_shifted(offset),
            )
        )
    events = (*map(_shown_event, result.events), *_ending(result))
    return ViewerContent(f"{result.primary}, redundant set", tuple(shown), events)


def _pose(stated: UnitSettings) -> UnitPose | None:
    if stated.sensor_from_primary is None or stated.lever_arm is None:
        return None
    return UnitPose(stated.sensor_from_primary.T, stated.lever_arm)


def _shifted(offset: float) -> Callable[[FloatArray], FloatArray] | None:
    return partial(_later, offset) if offset else None


def _later(offset: float, time: FloatArray) -> FloatArray:
    return time + offset


def _shown_event(event: RedundancyEvent) -> ShownEvent:
    level: EventLevel = "warning" if event.event in _WORTH_A_LOOK else "info"
    level = "error" if event.event in _WRONG else level
    details = event_details(event)
    text = f"{event_title(event)}: {details}" if details else event_title(event)
    return ShownEvent(event.time, event.unit, level, text)


def _ending(result: RedundancyResult) -> Iterator[ShownEvent]:
    yield from verdict_event(result.end, result.primary, result.verdict, result.warnings)
