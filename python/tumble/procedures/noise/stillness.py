"""Parts of a log that scatter more than its rests and yet hold still: noise does not decide what is a rest.

Rests are found by their scatter. A log whose noise grows, or whose readings repeat for a while, so has rests
where it happens to be quiet, and their noise is too small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble.acquisition.standstills import standstills
from tumble.foundation.recording import Chunk, FloatArray, Recording

_LARGEST = 4.0
"""Times the scatter of the rests within which readings between them are noise."""
_WHITE = 1.5
"""Ratio of the variance of readings to that of white noise of their changes above which a unit sways."""
_FEW = 0.01
"""Share of the samples outside of rests that is not worth a look: the blocks at their ends."""


@dataclass(frozen=True, slots=True)
class Stillness:
    """Times in which a unit stood still, whatever its noise."""

    rests: FloatArray
    """(k, 2) s."""
    steps: FloatArray
    """(c,) smallest change of each channel from one reading to the next, SI; 0 of one that never changed."""


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
    if recording.parts:
        return Stillness(rests, steps)
    return Stillness(_joined(rests, sums, steps, (first, last)), steps)


def _joined(rests: FloatArray, sums: _Sums, steps: FloatArray, log: tuple[float, float]) -> FloatArray:
    mean = sums.mean
    of_rests = range(1, len(sums.count), 2)
    samples = sum(sums.count[place] for place in of_rests)
    if sums.count.sum() - samples <= _FEW * sums.count.sum():
        return rests
    within = sum(sums.count[place] * sums.about(place, mean[place]) for place in of_rests) / samples
    allowed = _LARGEST**2 * (within + steps**2)

    def holds(gap: int) -> bool:
        """Returns whether readings before, in and behind a gap are of one level."""
        beside = [place for place in (gap - 1, gap + 1) if 0 <= place < len(mean)]
        levels = mean[beside]
        if sums.count[gap] == 0.0 or (np.ptp(levels, axis=0) ** 2 > allowed).any():
            return False
        scatter = sums.about(gap, levels.mean(axis=0))
        white = _WHITE * sums.white(gap) + steps**2
        return bool((scatter <= np.minimum(allowed, white)).all())

    joined = [list(rests[0])]
    for number, rest in enumerate(rests[1:], start=1):
        if holds(2 * number):
            joined[-1][1] = rest[1]
        else:
            joined.append(list(rest))
    if holds(0):
        joined[0][0] = log[0]
    if holds(len(mean) - 1):
        joined[-1][1] = log[1]
    return np.array(joined)
