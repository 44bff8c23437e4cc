"""Clock of a sensor relative to that of the recorder: skew, and jitter of the transmission.

A delay is never less than that of the way, so that the skew is the slope of a line below all delays: the edge
of their lower convex hull over the mean of all times (Moon, Skelly, Towsley, "Estimation and removal of clock
skew from network delay measurements", INFOCOM 1999).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tumble.foundation.clock_skew import add_corner
from tumble.foundation.recording import FloatArray

_PIECES = 32
"""Number of pieces of a chunk, of each of which the least delay counts."""


@dataclass(frozen=True, slots=True)
class Arrival:
    """Arrival of samples, by the clock of the recorder, against the time of the sensor that is written."""

    delay: float
    """Least s from the time of the sensor to that of the recorder, at the beginning."""
    skew: float
    """s that the clock of the recorder gains for each of the sensor."""
    jitter: float
    """1-sigma of the delay, s."""
    duration: float = 0.0
    """s between the first and the last sample of which this is known."""

    @property
    def drifts(self) -> bool:
        """True if the clocks drift apart by more than delays scatter: the skew is then none of these."""
        return abs(self.skew) * self.duration > self.jitter


class ArrivalWatch:
    """Gathers delays as samples stream by; memory does not grow with their number."""

    def __init__(self) -> None:
        self._origin: tuple[float, float] | None = None
        self._hull: list[tuple[float, float]] = []
        self._count = 0
        self._sums = np.zeros(5)
        """Sums of t, d, t t, t d and d d, of time and delay since the first."""

    def push(self, time: FloatArray, received: FloatArray) -> None:
        """Adds (n,) times by the sensor and (n,) by the recorder, s."""
        if self._origin is None:
            self._origin = float(time[0]), float(received[0] - time[0])
        t, d = time - self._origin[0], received - time - self._origin[1]
        self._count += len(t)
        self._sums += (t.sum(), d.sum(), t @ t, t @ d, d @ d)
        for piece in np.array_split(np.arange(len(t)), min(_PIECES, len(t))):
            at = piece[np.argmin(d[piece])]
            add_corner(self._hull, (float(t[at]), float(d[at])))

    def conclude(self) -> Arrival | None:
        """Returns what was found; None where the recorder kept no time of its own."""
        if self._origin is None or len(self._hull) < 2:
            return None
        n, (t, d, tt, td, dd) = self._count, self._sums
        (x0, y0), (x1, y1) = self._edge_over(t / n)
        slope = (y1 - y0) / (x1 - x0)
        level = y0 - slope * x0
        if not self._hull[-1][0] > 0.0 or (slope == 0.0 and dd == 0.0):
            return None
        # Mean and mean square of the delays above that line follow from the sums alone.
        mean = d / n - level - slope * t / n
        squares = (dd - 2.0 * (level * d + slope * td) + slope * slope * tt) / n
        squares += level * level + 2.0 * level * slope * t / n
        jitter = math.sqrt(max(0.0, squares - mean * mean))
        return Arrival(self._origin[1] + level, slope, jitter, self._hull[-1][0])

    def _edge_over(self, middle: float) -> tuple[tuple[float, float], tuple[float, float]]:
        for left, right in zip(self._hull, self._hull[1:], strict=False):
            if right[0] >= middle:
                return left, right
        return self._hull[-2], self._hull[-1]
