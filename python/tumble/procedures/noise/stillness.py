"""Parts of a log that scatter more than its rests and yet hold still: noise does not decide what is a rest.

Rests are found by their scatter. A log whose noise grows, or whose readings repeat for a while, so has rests
where it happens to be quiet, and their noise is too small. Noise that sways, as behind a slow filter, looks
like slow motion: where the rests are its quiet parts, all of it counts as noise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tumble.acquisition.standstills import standstills
from tumble.foundation.recording import Chunk, FloatArray, Recording

BoolArray: TypeAlias = NDArray[np.bool_]

_LARGEST = 4.0
"""Times the scatter of the rests within which readings between them are noise."""
_WHITE = 1.5
"""Ratio of the variance of readings to that of white noise of their changes above which a unit sways."""
_FEW = 0.01
"""Share of the samples outside of rests that is not worth a look: the blocks at their ends."""
_NOTABLE = 1.1**2
"""Ratio of the variance with what sways to that without from which on rests are the quiet parts of noise:
a tenth of a deviation, as where white noise changes (course.py). Doubled, a fifth may be missing silently."""


@dataclass(frozen=True, slots=True)
class Stillness:
    """Times in which a unit stood still, whatever its noise."""

    rests: FloatArray
    """(k, 2) s."""
    steps: FloatArray
    """(c,) smallest change of each channel from one reading to the next, SI; 0 of one that never changed."""
    sways: BoolArray
    """(c,) channels that sway between rests as slow noise or slow motion does, which counts as noise."""


class _Sums:
    """Sums over the gaps and rests of a log, in turn, each about the first sample."""

    def __init__(self, edges: FloatArray, channels: int) -> None:
        self._edges = edges
        self._origin: FloatArray | None = None
        self.count = np.zeros(len(edges) + 1)
        self._sum = np.zeros((len(edges) + 1, channels))
        self._square = np.zeros((len(edges) + 1, channels))
        self._changes = np.zeros((len(edges) + 1, channels))
        self.steps = np.full(channels, np.inf)

    def push(self, time: FloatArray, values: FloatArray) -> None:
        """Adds (n,) s and (n, c) successive readings."""
        if self._origin is None:
            self._origin = values[0].copy()
        off = values - self._origin
        place = np.searchsorted(self._edges, time, side="right")
        self.count += np.bincount(place, minlength=len(self.count))
        for channel in range(values.shape[1]):
            column = off[:, channel]
            self._sum[:, channel] += np.bincount(place, column, len(self.count))
            self._square[:, channel] += np.bincount(place, column**2, len(self.count))
        changes = np.abs(np.diff(values, axis=0))
        for channel in range(values.shape[1]):
            self._changes[:, channel] += np.bincount(place[1:], changes[:, channel] ** 2, len(self.count))
        changes[changes == 0.0] = np.inf
        self.steps = np.minimum(self.steps, changes.min(axis=0, initial=np.inf))

    @property
    def mean(self) -> FloatArray:
        """(2 k + 1, c) of each gap and rest; NaN of one without samples."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(self._sum / self.count[:, None])

    def white(self, place: int) -> FloatArray:
        """(c,) variance of white noise in a gap or rest, by the changes from reading to reading."""
        return np.asarray(self._changes[place] / (2.0 * max(self.count[place] - 1.0, 1.0)))

    def about(self, place: int, level: FloatArray) -> FloatArray:
        """(c,) mean square of a gap or rest about a level."""
        total = self._square[place] - 2.0 * level * self._sum[place] + self.count[place] * level**2
        return np.asarray(np.maximum(total, 0.0) / self.count[place])


def stillness(recording: Recording, rests: FloatArray) -> Stillness:
    """Joins rests (k, 2), s, with the times between that scatter at most `_LARGEST` times as much."""
    triads = recording.metadata.triads
    edges = np.column_stack([rests[:, 0], np.nextafter(rests[:, 1], np.inf)]).ravel()
    sums = _Sums(edges, 3 * len(triads))
    first, last = np.inf, -np.inf
    for part in recording.parts or (recording,):
        for logged in part.chunks():
            chunk: Chunk = standstills(logged, triads).moving(logged)
            sums.push(chunk.time, np.hstack([getattr(chunk, triad) for triad in triads]))
            first, last = min(first, float(chunk.time[0])), max(last, float(chunk.time[-1]))
    steps = np.where(np.isfinite(sums.steps), sums.steps, 0.0)
    none = np.zeros(3 * len(triads), dtype=bool)
    if recording.parts or sums.count[::2].sum() <= _FEW * sums.count.sum():
        return Stillness(rests, steps, none)
    gaps = _Gaps(sums, steps)
    sways = gaps.sways
    is_noise = gaps.is_level if sways.any() else gaps.is_white
    return Stillness(_joined(rests, is_noise, (first, last)), steps, sways)


class _Gaps:
    """Times between rests, before the first and behind the last: each is noise, may be, or is motion."""

    def __init__(self, sums: _Sums, steps: FloatArray) -> None:
        self._sums, self._mean, self._steps = sums, sums.mean, steps
        rests = range(1, len(sums.count), 2)
        self._samples = sum(sums.count[place] for place in rests)
        squares = [sums.count[place] * sums.about(place, self._mean[place]) for place in rests]
        self._within: FloatArray = np.asarray(sum(squares) / self._samples)
        self._allowed = _LARGEST**2 * (self._within + steps**2)

    def _scatter(self, gap: int) -> FloatArray | None:
        """(c,) mean square of a gap about the level beside it; None of one that moved."""
        beside = [place for place in (gap - 1, gap + 1) if 0 <= place < len(self._mean)]
        levels = self._mean[beside]
        if self._sums.count[gap] == 0.0 or (np.ptp(levels, axis=0) ** 2 > self._allowed).any():
            return None
        scatter = self._sums.about(gap, levels.mean(axis=0))
        return scatter if (scatter <= self._allowed).all() else None

    def is_level(self, gap: int) -> bool:
        """Returns whether a gap is of one level with the readings beside it, and scatters as noise may."""
        return self._scatter(gap) is not None

    def is_white(self, gap: int) -> bool:
        """Returns whether it is so, and neither sways nor drifts."""
        scatter = self._scatter(gap)
        white = _WHITE * self._sums.white(gap) + self._steps**2
        return scatter is not None and bool((scatter <= white).all())  # noise.md, eq. 34a

    @property
    def sways(self) -> BoolArray:
        """(c,) channels that scatter notably more with the gaps that sway by no more than noise may."""
        used, samples = self._samples * self._within, self._samples
        swaying, swayed = np.zeros_like(used), 0.0
        for gap in range(0, len(self._mean), 2):
            scatter = self._scatter(gap)
            if scatter is not None and self.is_white(gap):
                used, samples = used + self._sums.count[gap] * scatter, samples + self._sums.count[gap]
            elif scatter is not None:
                swaying, swayed = swaying + self._sums.count[gap] * scatter, swayed + self._sums.count[gap]
        both = (used + swaying) / (samples + swayed)
        return np.asarray(both > _NOTABLE * used / samples)  # noise.md, eq. 34e


def _joined(rests: FloatArray, is_noise: Callable[[int], bool], log: tuple[float, float]) -> FloatArray:
    joined = [list(rests[0])]
    for number, rest in enumerate(rests[1:], start=1):
        if is_noise(2 * number):
            joined[-1][1] = rest[1]
        else:
            joined.append(list(rest))
    if is_noise(0):
        joined[0][0] = log[0]
    if is_noise(2 * len(rests)):
        joined[-1][1] = log[1]
    return np.array(joined)
