"""Recordings that the browser shows, as content for other viewers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
    names = own_names([unit.name for unit in viewing.units])
    shifts = [_zero(viewing.units[0]) - _zero(unit) for unit in viewing.units]
    found = list(zip(viewing.units, names, shifts, strict=True))
    events = tuple(event for each in found for event in _events(*each))
    return ViewerContent(viewing.title, tuple(_shown(*each) for each in found), events)


def own_names(names: Sequence[str]) -> list[str]:
    """Returns a name of its own for each unit: those of one name are numbered from the second on."""
    counts = [names[: place + 1].count(name) for place, name in enumerate(names)]
    return [name if count == 1 else f"{name}-{count}" for name, count in zip(names, counts, strict=True)]


def _shown(unit: ViewedUnit, name: str, shift: float) -> ShownUnit:
    calibration = unit.samples.calibration
    return ShownUnit(
        name,
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


def _events(unit: ViewedUnit, name: str, shift: float) -> Iterator[ShownEvent]:
    verdict = unit.result.verdict if unit.result is not None else ""
    remarks = [*unit.remarks, *(unit.inspection.remarks if unit.inspection is not None else ())]
    yield from verdict_event(unit.samples.start + shift, name, verdict, remarks)
