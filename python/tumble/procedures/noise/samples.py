"""Parts of logs at rest: stretches of samples without a gap, handed to the core as they are read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tumble import _core
from tumble.acquisition.standstills import standstills
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Chunk, FloatArray, Recording, SampleProgress
from tumble.foundation.timing import TimeWatch
from tumble.foundation.units import Triad
from tumble.procedures.noise import messages
from tumble.procedures.noise.course import NoiseCourse
from tumble.procedures.noise.range_ends import RangeEnds
from tumble.procedures.noise.result import StillPart

RestNumbers: TypeAlias = NDArray[np.int64]
"""(n,) number of the rest that each sample is in; -1 for none."""


class StillSamples:
    """Hands samples at rest to the core, stretch by stretch, and counts them.

    A `watch` is given all samples, at rest or not.
    """

    def __init__(self, triads: Sequence[Triad], watch: _core.NoiseWatch | None = None) -> None:
        self.record = _core.NoiseRecord(3 * len(triads))
        self.course = NoiseCourse()
        self.range_ends = RangeEnds(3 * len(triads))
        self._watch = watch
        self._triads = triads
        self._logs = self._samples = self._used = self._stretches = self._gaps = 0
        self._longest = self._in_stretch = 0
        self._time = 0.0
        self._steps = 0
        self.begin_part()

    def read(self, recording: Recording, rests: FloatArray, progress: SampleProgress | None = None) -> None:
        """Reads a log; `rests` (k, 2) are the times, s, in which it stood still."""
        self._logs += 1
        for part in recording.parts or (recording,):
            self._read_part(part, rests, progress)
        if self._watch is not None:
            self._watch.end_log()

    def finish(self) -> tuple[list[_core.NoiseFigures], StillPart]:
        """Returns what the core found, and how much it was given.

        Raises `ProcedureError` where no two samples at rest follow each other.
        """
        if not self._steps:
            raise ProcedureError(messages.NO_STEPS)
        interval = self._interval
        found = self.record.conclude(interval)
        return found, StillPart(
            logs=self._logs,
            samples=self._samples,
            used=self._used,
            duration=self._used * interval,
            interval=interval,
            stretches=self._stretches,
            longest=self._longest * interval,
            gaps=self._gaps,
        )

    def begin_part(self) -> None:
        """Begins a part of a log: no stretch goes on into it."""
        self._timing, self._last, self._rest = TimeWatch(), float("nan"), -1

    def take(self, chunk: Chunk, rest: RestNumbers) -> None:
        """Adds successive samples, each with the number of the rest that it is in; -1 for none."""
        self._timing.push(chunk.time)
        steps = np.diff(chunk.time, prepend=self._last)
        gap = steps > self._timing.longest_step
        same = np.diff(rest, prepend=self._rest) == 0
        within = ~gap & same & (rest >= 0) & np.isfinite(steps)
        self._time += float(steps[within].sum())
        self._steps += int(within.sum())
        for number, rows in enumerate(_runs(~(gap | ~same))):
            if number or not within[0]:
                self._end_stretch()
            self._push(chunk, rows, at_rest=bool(rest[rows.start] >= 0))
        self._last, self._rest = float(chunk.time[-1]), int(rest[-1])
        self._samples += len(chunk)

    def end_part(self) -> None:
        """Ends a part of a log."""
        self._end_stretch()
        self._gaps += self._timing.gaps

    @property
    def seconds(self) -> float:
        """Time at rest so far, s."""
        return self._time

    def so_far(self) -> Callable[[], list[_core.NoiseFigures]]:
        """Returns a function that finds what the samples so far show, while others are added."""
        record, interval = self.record.copy(), self._interval
        record.end_stretch()
        return lambda: record.conclude(interval)

    @property
    def _interval(self) -> float:
        return self._time / self._steps if self._steps else float("nan")

    def _read_part(self, part: Recording, rests: FloatArray, progress: SampleProgress | None) -> None:
        self.begin_part()
        for logged in part.chunks():
            chunk = standstills(logged, self._triads).moving(logged)
            self.take(chunk, _rest_of(chunk.time, rests))
            if progress is not None:
                progress(self._samples, None)
        self.end_part()

    def _push(self, chunk: Chunk, rows: slice, *, at_rest: bool) -> None:
        if not at_rest and self._watch is None:
            return
        values = np.ascontiguousarray(np.hstack([getattr(chunk, triad)[rows] for triad in self._triads]))
        if self._watch is not None:
            self._watch.push(np.ascontiguousarray(chunk.time[rows]), values, at_rest)
        if at_rest:
            self.record.push(values)
            self.course.push(values)
            self.range_ends.push(values)
            self._in_stretch += rows.stop - rows.start

    def _end_stretch(self) -> None:
        if not self._in_stretch:
            return
        self.record.end_stretch()
        self.course.end_stretch()
        self._stretches += 1
        self._used += self._in_stretch
        self._longest = max(self._longest, self._in_stretch)
        self._in_stretch = 0


def without(rests: FloatArray, disturbed: Sequence[tuple[float, float]]) -> FloatArray:
    """Returns rests (k, 2), s, parted where they were disturbed; those times are in none of them."""
    left = [(float(start), float(end)) for start, end in rests]
    for first, last in disturbed:
        left = [
            part
            for start, end in left
            for part in (
                [(start, end)]
                if last < start or first > end
                else [(start, np.nextafter(first, -np.inf)), (np.nextafter(last, np.inf), end)]
            )
            if part[0] < part[1]
        ]
    return np.array(sorted(left)).reshape(-1, 2)


def _rest_of(time: FloatArray, rests: FloatArray) -> RestNumbers:
    """(n,) number of the rest that each instant is in; -1 for none."""
    if not len(rests):
        return np.full(len(time), -1)
    number = np.searchsorted(rests[:, 0], time, side="right") - 1
    inside = (number >= 0) & (time <= rests[np.maximum(number, 0), 1])
    return np.where(inside, number, -1)


def _runs(joined: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Iterator[slice]:
    """Returns runs of rows, of which each but the first row is joined to the one before it."""
    starts = [0, *(np.flatnonzero(~joined[1:]) + 1).tolist(), len(joined)]
    return (slice(start, end) for start, end in pairwise(starts))
