"""Content of thermal sessions for viewers: readings, temperature and rests."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from tumble.foundation.recording import Recording
from tumble.procedures.thermal.result import ThermalBlocks, ThermalResult
from tumble.tools.viewers.content import (
    SEGMENTS,
    ShownSegment,
    ShownUnit,
    ViewerContent,
    estimates_of,
    verdict_event,
)


def viewer_content(result: ThermalResult, recordings: Sequence[Recording]) -> ViewerContent:
    """Returns a result beside the recordings that it was found from, each as a unit of its own."""
    calibration = result.calibration
    parameters = tuple(each for axis in result.axes for each in estimates_of(axis.name, axis.parameters()))
    names = [result.name, *(f"{result.name}-{number}" for number in range(2, len(recordings) + 1))]
    units = tuple(
        ShownUnit(
            name,
            recording,
            calibration,
            {SEGMENTS: tuple(_rests(result.blocks, session))},
            parameters,
            result.verdict,
        )
        for session, (name, recording) in enumerate(zip(names, recordings, strict=True))
    )
    start = result.logs[0].time.zero if result.logs else 0.0
    events = verdict_event(start, result.name, result.verdict, result.warnings)
    return ViewerContent(result.name, units, tuple(events))


def _rests(blocks: ThermalBlocks, session: int) -> Iterator[ShownSegment]:
    """Returns a rest for each pose of a session, with the temperatures that it passed through."""
    for number, pose in enumerate(np.unique(blocks.pose[blocks.session == session]).tolist(), start=1):
        held = (blocks.session == session) & (blocks.pose == pose)
        degrees, time = blocks.temperature[held], blocks.time[held]
        label = f"{number}: {degrees.min():.1f} to {degrees.max():.1f} degC"
        yield ShownSegment("rest", float(time.min()), float(time.max()), label)
