"""Content of the spins of a robot for viewers: readings, rests, spins and biases."""

from __future__ import annotations

from collections.abc import Iterator

from tumble.foundation.recording import Recording
from tumble.procedures.spin.result import SpinResult
from tumble.tools.viewers.content import (
    SEGMENTS,
    ShownEvent,
    ShownSegment,
    ShownUnit,
    ViewerContent,
    estimates_of,
    segments_of,
    verdict_event,
)

SPINS = "spins"
"""Lane of the spins, and of what looked like one."""


def viewer_content(result: SpinResult, recording: Recording) -> ViewerContent:
    """Returns a result beside the recording that it was found from."""
    unit = ShownUnit(
        result.name,
        recording,
        result.calibration,
        {
            SEGMENTS: segments_of(rest for spin in result.spins for rest in spin.rests),
            SPINS: tuple(_spins(result)),
        },
        (
            *estimates_of("accelerometer", result.accelerometer_bias.parameters("accelerometer")),
            *estimates_of("gyroscope", result.gyroscope_bias.parameters("gyroscope")),
        ),
        result.verdict,
    )
    events = verdict_event(result.time.zero, result.name, result.verdict, result.warnings)
    return ViewerContent(result.name, (unit,), (*events, *_warnings(result)))


def _spins(result: SpinResult) -> Iterator[ShownSegment]:
    for number, spin in enumerate(result.spins, start=1):
        yield ShownSegment("spin", spin.start, spin.end, str(number))
    for start, end, reason in result.refused:
        yield ShownSegment("left out", start, end, "", reason)


def _warnings(result: SpinResult) -> Iterator[ShownEvent]:
    for spin in result.spins:
        for text in spin.warnings:
            yield ShownEvent(spin.start, result.name, "warning", f"{spin.label}: {text}")
    for start, _, reason in result.refused:
        yield ShownEvent(start, result.name, "warning", reason)
