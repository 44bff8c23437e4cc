"""Content of a magnetometer's log for viewers: readings, rests or stretches, and parameters."""

from __future__ import annotations

from tumble.foundation.recording import Recording
from tumble.procedures.magnetometer.result import FieldPoint, MagnetometerResult
from tumble.tools.viewers.content import (
    SEGMENTS,
    ShownSegment,
    ShownUnit,
    ViewerContent,
    estimates_of,
    parameters_of,
    verdict_event,
)


def viewer_content(result: MagnetometerResult, recording: Recording) -> ViewerContent:
    """Returns a result beside the recording that it was found from."""
    calibration = result.calibration
    field = (
        *estimates_of("magnetometer", result.current),
        *estimates_of("", (result.strength,)),
        *estimates_of("magnetic field", (result.dip,)),
    )
    segments = [_segment(number, point) for number, point in enumerate(result.points, 1)]
    unit = ShownUnit(
        result.name,
        recording,
        calibration,
        {SEGMENTS: segments if result.at_rest else ()},
        (*parameters_of(calibration), *field),
        result.verdict,
    )
    events = verdict_event(result.log.time.zero, result.name, result.verdict, result.warnings)
    return ViewerContent(result.name, (unit,), tuple(events))


def _segment(number: int, point: FieldPoint) -> ShownSegment:
    """Returns a rest, left out where the field was disturbed."""
    if point.disturbed:
        return ShownSegment("left out", point.start, point.end, str(number), "disturbed")
    return ShownSegment("rest", point.start, point.end, str(number))
