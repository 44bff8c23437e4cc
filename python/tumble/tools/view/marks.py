"""Rests of a recording and the turns between them, as acquisition finds them, on the time that is shown."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, TypeAlias

from tumble import _core
from tumble.acquisition.acquire import push_recorded, rejected_rests_of, rests_of
from tumble.foundation.results import Rest
from tumble.tools.view.samples import KeptSamples

MarkKind: TypeAlias = Literal["rest", "turn", "no rest"]


@dataclass(frozen=True, slots=True)
class SegmentMark:
    """A segment of a recording."""

    kind: MarkKind
    start: float
    end: float
    """s of the time shown."""
    label: str
    """`3` for the third rest, `3-4` for the turn after it."""
    remark: str = ""
    """Reason why it is no rest, or is not used."""
    used: bool = True
    specific_force: tuple[float, ...] | None = None
    """(3,) mean of a rest, m/s^2, as measured; None where it is not known."""


def acquired_of(samples: KeptSamples, *, by_hand: bool = False) -> _core.Acquired:
    """Finds the rests of a unit that lies, or is held by hand, in samples that were read."""
    segmenter = _core.Segmenter(by_hand=by_hand, pace_sigma=samples.recording.metadata.pace_sigma)
    kept = samples.kept()
    for part in kept.parts or (kept,):
        segmenter.begin_part(part.name if kept.parts else "")
        for chunk in part.chunks():
            push_recorded(
                segmenter, chunk, chunk.accelerometer, chunk.gyroscope, samples.recording.metadata.triads
            )
    return segmenter.finish()


def marks_of(samples: KeptSamples, acquired: _core.Acquired) -> tuple[SegmentMark, ...]:
    """Returns rests, turns between them, and what only looks like a rest, in order of time."""
    rests = rests_of(acquired, triads=samples.recording.metadata.triads)
    parts = [int(part) for part in acquired.rest_parts]
    found = [
        SegmentMark(
            "rest", *_shown(samples, rest), str(number), specific_force=tuple(rest.specific_force.tolist())
        )
        for number, rest in enumerate(rests, start=1)
    ]
    turns = [
        SegmentMark("turn", before.end, after.start, f"{before.label}-{after.label}")
        for (before, after), (part, same) in zip(pairwise(found), pairwise(parts), strict=True)
        if part == same
    ]
    others = [
        SegmentMark("no rest", *_shown(samples, each), "", each.remark, used=False)
        for each in rejected_rests_of(acquired)
    ]
    return in_order((*found, *turns, *others))


def in_order(marks: Iterable[SegmentMark]) -> tuple[SegmentMark, ...]:
    """Sorts segments by time."""
    return tuple(sorted(marks, key=lambda mark: (mark.start, mark.end)))


def _shown(samples: KeptSamples, rest: Rest) -> tuple[float, float]:
    return samples.shown_time(rest.start), samples.shown_time(rest.end)
