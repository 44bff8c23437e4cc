"""Content of a multi-pose session for viewers: readings, rests, turns and parameters."""

from __future__ import annotations

from tumble.foundation.recording import Recording
from tumble.procedures.multipose.result import MultiposeResult
from tumble.tools.viewers.content import (
    SEGMENTS,
    ShownUnit,
    ViewerContent,
    parameters_of,
    segments_of,
    verdict_event,
)


def viewer_content(result: MultiposeResult, recording: Recording) -> ViewerContent:
    """Returns a result beside the recording that it was found from."""
    calibration = result.calibration
    unit = ShownUnit(
        result.name,
        recording,
        calibration,
        {SEGMENTS: segments_of(result.rests)},
        parameters_of(calibration),
        result.verdict,
    )
    events = verdict_event(result.log.time.zero, result.name, result.verdict, result.warnings)
    return ViewerContent(result.name, (unit,), tuple(events))
