"""Regularity of sampling: interval, jitter and gaps, gathered while samples stream by."""

from __future__ import annotations

import math

import numpy as np

from tumble.foundation.recording import FEW_SAMPLES, FloatArray


class TimeWatch:
    """Sampling interval, its scatter, and gaps."""

    def __init__(self) -> None:
        self.samples = 0
        self.start = math.nan
        self.end = math.nan
        self.duration = 0.0
        self.gaps = 0
        self.missing = 0
        self.longest_gap = 0.0
        self.longest_gap_at = math.nan
        self._last = math.nan
        self._usual = math.nan
        self._gap = math.inf
        self._count = 0
        self._sum = 0.0
        self._squares = 0.0

    def begin_part(self) -> None:
        """Forgets the last time stamp: the next file has a clock of its own."""
        self._last = math.nan

    def push(self, time: FloatArray) -> None:
        """Adds (n,) times, s, each later than the one before."""
        if len(time) <= FEW_SAMPLES and self._gap < math.inf and not math.isnan(self._last):
            for stamp in time.tolist():
                self._push_one(stamp)
            return
        steps = np.diff(time) if math.isnan(self._last) else np.diff(time, prepend=self._last)
        if math.isnan(self.start):
            self.start = float(time[0])
        self.samples += len(time)
        self._last = self.end = float(time[-1])
        if len(steps) == 0:
            return
        self.duration += float(steps.sum())
        if math.isnan(self._usual):
            self._learn(steps)
        self._count_gaps(steps, time[-len(steps) :])

    @property
    def interval(self) -> float:
        """Mean time between samples, s, gaps left out; NaN for a single sample."""
        return self._usual + self._sum / self._count if self._count else math.nan

    @property
    def jitter(self) -> float:
        """1-sigma of the time between samples, s, gaps left out."""
        if not self._count:
            return math.nan
        mean = self._sum / self._count
        return math.sqrt(max(0.0, self._squares / self._count - mean * mean))

    @property
    def longest_step(self) -> float:
        """Time between samples, s, beyond which it is a gap; infinite before there are two samples."""
        return self._gap

    def _push_one(self, stamp: float) -> None:
        """Does the same without numpy, which takes ten times as long for a single sample."""
        step, self._last, self.end = stamp - self._last, stamp, stamp
        self.samples += 1
        self.duration += step
        if step > self._gap:
            self._count_gaps(np.array([step]), np.array([stamp]))
            return
        usual = step - self._usual
        self._count += 1
        self._sum += usual
        self._squares += usual * usual

    def _learn(self, steps: FloatArray) -> None:
        """Calls a gap what is half an interval too long, or further out where the first samples jitter."""
        self._usual = float(np.median(steps))
        scatter = 1.4826 * float(np.median(np.abs(steps - self._usual)))
        self._gap = self._usual + max(0.5 * self._usual, 6.0 * scatter)

    def _count_gaps(self, steps: FloatArray, ends: FloatArray) -> None:
        is_gap = steps > self._gap
        usual = steps[~is_gap] - self._usual
        self._count += len(usual)
        self._sum += float(usual.sum())
        self._squares += float(np.square(usual).sum())
        if not is_gap.any():
            return
        gaps = steps[is_gap]
        self.gaps += len(gaps)
        self.missing += int((np.rint(gaps / self._usual) - 1.0).sum())
        longest = int(np.argmax(gaps))
        if gaps[longest] > self.longest_gap:
            self.longest_gap = float(gaps[longest])
            self.longest_gap_at = float(ends[is_gap][longest]) - self.longest_gap
