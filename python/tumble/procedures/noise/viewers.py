"""Content of records of noise for viewers: readings, disturbances and terms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from tumble.foundation.recording import Recording
from tumble.procedures.noise.result import Disturbance, NoiseResult
from tumble.tools.viewers.content import (
    ShownEvent,
    ShownSegment,
    ShownUnit,
    ViewerContent,
    estimates_of,
    verdict_event,
)

DISTURBANCES = "disturbances"


def viewer_content(result: NoiseResult, recordings: Sequence[Recording]) -> ViewerContent:
    """Returns a result beside the recordings that it was found from, each as a unit of its own."""
    parameters = tuple(
        each for channel in result.channels for each in estimates_of(channel.name, channel.terms)
    )
    names = [result.name, *(f"{result.name}-{number}" for number in range(2, len(recordings) + 1))]
    units = tuple(
        ShownUnit(
            name,
            recording,
            lanes={DISTURBANCES: tuple(_segments(result.disturbances, place))},
            parameters=parameters,
            verdict=result.verdict,
        )
        for place, (name, recording) in enumerate(zip(names, recordings, strict=True))
    )
    start = result.logs[0].time.zero if result.logs else 0.0
    events = verdict_event(start, result.name, result.verdict, result.warnings)
    return ViewerContent(result.name, units, (*events, *_events(result, names)))


def _segments(disturbances: Sequence[Disturbance], log: int) -> Iterator[ShownSegment]:
    for each in disturbances:
        if each.log == log:
            remark = "" if each.left_out else "kept as noise"
            yield ShownSegment("disturbance", each.start, each.end, f"{each.channel} {each.kind}", remark)


def _events(result: NoiseResult, names: Sequence[str]) -> Iterator[ShownEvent]:
    for each in result.disturbances:
        text = f"{each.channel}: {each.kind} of {each.size:.3g} +- {each.sigma:.2g} {each.unit}"
        yield ShownEvent(each.start, names[each.log], "warning", text)
