"""Content of a turntable session for viewers: reference and targets on one clock, rests and parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from tumble.foundation.recording import FloatArray, Recording
from tumble.procedures.turntable.result import TargetResult, TurntableResult
from tumble.tools.viewers.content import (
    SEGMENTS,
    ShownUnit,
    ViewerContent,
    parameters_of,
    segments_of,
    verdict_event,
)


def viewer_content(
    session: TurntableResult, reference: Recording, targets: Sequence[tuple[TargetResult, Recording]]
) -> ViewerContent:
    """Returns results of targets, and of the reference that they share, beside their recordings."""
    found = session.reference
    lanes = {SEGMENTS: segments_of(found.rests)}
    units = [ShownUnit(found.name, reference, lanes=lanes)]
    events = []
    start = found.log.time.zero
    for result, recording in targets:
        units.append(_shown(session, result, recording, start))
        events += verdict_event(start, result.name, result.verdict, result.warnings)
    return ViewerContent(f"{found.name}, turntable", tuple(units), tuple(events))


def _shown(session: TurntableResult, result: TargetResult, recording: Recording, start: float) -> ShownUnit:
    calibration = None if result.failure else session.calibration_of(result)
    return ShownUnit(
        result.name,
        recording,
        calibration,
        {SEGMENTS: segments_of(result.rests)},
        () if calibration is None else parameters_of(calibration),
        result.verdict,
        on_clock=_clock_of_reference(result, start),
    )


def _clock_of_reference(result: TargetResult, start: float) -> Callable[[FloatArray], FloatArray] | None:
    """Returns the conversion to the reference's time, which `ClockFit` gives the other way."""
    clock = result.clock
    if clock is None or clock.shared:
        return None

    def converted(time: FloatArray) -> FloatArray:
        found: FloatArray = start + (time - start - clock.offset) / (1.0 + 1e-6 * clock.skew)
        return found

    return converted
