"""Content of an alignment for viewers: readings of all units on one clock, and their poses."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tumble.foundation.recording import FloatArray, Recording
from tumble.procedures.align.result import AlignResult, UnitAlignment
from tumble.tools.viewers.content import ShownUnit, UnitPose, ViewerContent, estimates_of, verdict_event


def viewer_content(result: AlignResult, recordings: Sequence[Recording]) -> ViewerContent:
    """Returns a result beside the recordings that it was found from, the primary's first."""
    ours, *theirs = recordings
    primary = ShownUnit(result.primary, ours, verdict=result.verdict, pose=UnitPose(np.eye(3), np.zeros(3)))
    secondaries = (_shown(unit, recording) for unit, recording in zip(result.units, theirs, strict=True))
    warnings = (
        *result.warnings,
        *(f"{unit.name}: {text}" for unit in result.units for text in unit.warnings),
    )
    events = verdict_event(result.time.zero, result.primary, result.verdict, warnings)
    return ViewerContent(f"{result.primary}, aligned", (primary, *secondaries), tuple(events))


def _shown(unit: UnitAlignment, recording: Recording) -> ShownUnit:
    pose = None
    if unit.sensor_from_primary is not None:
        pose = UnitPose(unit.sensor_from_primary.T, np.nan_to_num(unit.lever_arm))
    return ShownUnit(
        unit.name,
        recording,
        parameters=estimates_of("", unit.parameters),
        pose=pose,
        on_clock=_clock_of_primary(unit),
    )


def _clock_of_primary(unit: UnitAlignment) -> Callable[[FloatArray], FloatArray]:
    """Returns the conversion from the unit's time: the offset grows with the primary's time."""

    def converted(time: FloatArray) -> FloatArray:
        shifted = time + unit.time_offset
        found: FloatArray = unit.reference_time + (shifted - unit.reference_time) / (1.0 - unit.skew)
        return found

    return converted
