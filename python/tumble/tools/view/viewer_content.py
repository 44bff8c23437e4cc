"""Recordings that the browser shows, as content for other viewers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from tumble.foundation.errors import TumbleError
from tumble.tools.view.marks import MarkKind, SegmentMark
from tumble.tools.view.viewing import ViewedUnit, Viewing
from tumble.tools.viewers.content import (
    SEGMENTS,
    SegmentState,
    ShownEvent,
    ShownSegment,
    ShownUnit,
    ViewerContent,
    parameters_of,
    verdict_event,
)

_STATES: Final[dict[MarkKind, SegmentState]] = {"rest": "rest", "turn": "turn", "no rest": "left out"}


def content_of(viewing: Viewing) -> ViewerContent:
    """Returns what a browser would show; `viewing` has gathered all.

    Raises the error of a unit that could not be read.
    """
    for unit in viewing.units:
        if unit.problem:
            raise TumbleError(unit.problem)
    events = tuple(event for unit in viewing.units for event in _events(unit))
    first = viewing.units[0]
    return ViewerContent(viewing.title, tuple(_shown(unit, first) for unit in viewing.units), events)


def _shown(unit: ViewedUnit, first: ViewedUnit) -> ShownUnit:
    calibration = unit.samples.calibration
    shift = _zero(first) - _zero(unit)
    return ShownUnit(
        unit.name,
        unit.samples.kept(),
        calibration,
        {SEGMENTS: tuple(_segment(unit, mark) for mark in unit.marks)},
        parameters_of(calibration) if calibration is not None else (),
        unit.result.verdict if unit.result is not None else "",
        on_clock=(lambda time: time + shift) if shift else None,
    )


def _zero(unit: ViewedUnit) -> float:
    """Returns the time of its own clock, s, that the browser shows as zero."""
    return unit.samples.start - unit.samples.offset


def _segment(unit: ViewedUnit, mark: SegmentMark) -> ShownSegment:
    shift = _zero(unit)
    state = _STATES[mark.kind] if mark.used else "left out"
    force = None if mark.specific_force is None else np.array(mark.specific_force)
    return ShownSegment(state, mark.start + shift, mark.end + shift, mark.label, mark.remark, force)


def _events(unit: ViewedUnit) -> Iterator[ShownEvent]:
    verdict = unit.result.verdict if unit.result is not None else ""
    remarks = [*unit.remarks, *(unit.inspection.remarks if unit.inspection is not None else ())]
    yield from verdict_event(unit.samples.start, unit.name, verdict, remarks)
