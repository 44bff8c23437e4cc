"""Statistics of single channels of a recording, gathered as samples stream by."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.timing import TimeWatch
from tumble.foundation.units import TRIADS, UNITS, Triad

CHANNELS = tuple(f"{triad} {axis}" for triad in TRIADS for axis in "xyz")
"""Names of the six channels, in the order of the core."""
_VALUES_KEPT = 8
_FEWEST_SATURATED = 5
_PILE = 3.0
"""Samples at the very end of the range over those at values next to it: noise thins out, a stop piles up."""
_NEVER_PINNED_BELOW = {"m/s^2": 12.0, "rad/s": 0.5}
"""A sensor whose range ended here could not be used at all; a coarse one at rest looks pinned there."""
_LARGEST_STEP_RATIO = 10.0


class _Extreme:
    """The largest distinct values of a channel, and how often each came."""

    def __init__(self) -> None:
        self._values: FloatArray = np.empty(0)
        self._counts: NDArray[np.int64] = np.empty(0, np.int64)

    def push(self, values: FloatArray) -> None:
        full = len(self._values) == _VALUES_KEPT
        candidates = values[values >= self._values[0]] if full else values
        distinct, counts = np.unique(candidates, return_counts=True)
        merged, places = np.unique(np.concatenate([self._values, distinct]), return_inverse=True)
        totals = np.zeros(len(merged), np.int64)
        np.add.at(totals, places, np.concatenate([self._counts, counts]))
        self._values, self._counts = merged[-_VALUES_KEPT:], totals[-_VALUES_KEPT:]

    def saturated_samples(self) -> int:
        """Counts samples at the very extreme if they pile up there, else 0."""
        if len(self._values) < 2:
            return 0
        at_end, beside = int(self._counts[-1]), float(self._counts[:-1].mean())
        return at_end if at_end >= _FEWEST_SATURATED and at_end > _PILE * beside else 0


class ChannelWatch:
    """Range, mean, saturation and quantisation of one channel."""

    def __init__(self, name: str, unit: str) -> None:
        self.name = name
        self.unit = unit
        self.low = math.inf
        self.high = -math.inf
        self.step: float | None = None
        self._count = 0
        self._sum = 0.0
        self._top = _Extreme()
        self._bottom = _Extreme()

    def push(self, values: FloatArray) -> None:
        """Adds (n,) values."""
        if self._count == 0:
            self.step = quantisation_step(values)
        self.low = min(self.low, float(values.min()))
        self.high = max(self.high, float(values.max()))
        self._count += len(values)
        self._sum += float(values.sum())
        self._top.push(values)
        self._bottom.push(-values)

    @property
    def mean(self) -> float:
        """Mean over all samples."""
        return self._sum / self._count if self._count else math.nan

    @property
    def saturated(self) -> int:
        """Samples pinned at either end of the range."""
        least = _NEVER_PINNED_BELOW[self.unit]
        top = self._top.saturated_samples() if abs(self.high) > least else 0
        bottom = self._bottom.saturated_samples() if abs(self.low) > least else 0
        return top + bottom


def quantisation_step(values: FloatArray) -> float | None:
    """Returns the step of which all differences between (n,) values are multiples; None if there is none."""
    differences = np.diff(np.unique(values))
    if len(differences) < 2:
        return None
    smallest = float(differences.min())
    ratios = differences / smallest
    near = ratios <= _LARGEST_STEP_RATIO
    off = np.abs(ratios[near] - np.rint(ratios[near]))
    # Floats scatter freely: few of their differences are anywhere near the smallest one.
    if near.mean() < 0.3 or np.quantile(off, 0.9) > 0.1:
        return None
    return float(differences[near].sum() / np.rint(ratios[near]).sum())


class SampleWatch:
    """The channels of the triads recorded, and the time stamps, of one recording."""

    def __init__(self, triads: Sequence[Triad]) -> None:
        self.time = TimeWatch()
        self.temperature: tuple[float, float] | None = None
        """Lowest and highest, degC; None where none was recorded."""
        self._triads = triads
        self.channels = tuple(
            ChannelWatch(f"{triad} {axis}", UNITS[triad]) for triad in triads for axis in "xyz"
        )

    def push(self, chunk: Chunk) -> None:
        """Adds a chunk."""
        self.time.push(chunk.time)
        self._push_temperature(chunk.temperature)
        columns = (column for triad in self._triads for column in getattr(chunk, triad).T)
        for channel, column in zip(self.channels, columns, strict=True):
            channel.push(np.ascontiguousarray(column))

    def _push_temperature(self, values: FloatArray | None) -> None:
        known = np.empty(0) if values is None else values[np.isfinite(values)]
        if len(known):
            low, high = self.temperature or (math.inf, -math.inf)
            self.temperature = min(low, float(known.min())), max(high, float(known.max()))
