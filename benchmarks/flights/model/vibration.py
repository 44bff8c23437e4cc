"""Vibration of the set over its usual: it raises the noise of all pairs, and no unit may raise it alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FloatArray

WINDOWS = 20
"""Windows whose second differences are averaged."""
USUAL_SECONDS = 10.0
"""Time constant of what is usual."""
LEAST = (0.02, 0.001)
"""m/s^2 and rad/s of a window that are usual at least."""


class Aliased:
    """Vibration that windows show: sampled slower than it swings it is slow, and no scatter of samples.

    Second differences of a unit's deviation from the set contain neither a constant fault nor a ramp. Two
    units have one deviation: there, neither may shake more than its own windows do.
    """

    def __init__(self, reading: FloatArray, motion: FloatArray, whole: NDArray[np.bool_]) -> None:
        """Takes readings (t, b, n, 6), the motion of the set (t, b, 18) and which are whole (t, b, n)."""
        deviation = reading - motion[:, :, None, :6]
        self.is_pair = reading.shape[2] == 2
        self.sums = [
            _swings(each, whole) for each in ((deviation, reading) if self.is_pair else (deviation,))
        ]
        self.usual = [np.zeros(each.shape[1:-1]) for each in self.sums]

    def ratio(self, step: int) -> FloatArray:
        """Returns the variance of the last second over its usual (b, n, 2); 1 before anything is usual."""
        found = []
        for sums, usual in zip(self.sums, self.usual, strict=True):
            mean = _mean(sums, max(step + 1 - WINDOWS, 0), step + 1)
            found.append(np.where(usual > 0.0, mean / np.maximum(usual, np.array(LEAST) ** 2), 1.0))
        return np.asarray(np.min(found, axis=0))

    def learn(self, first: int, last: int, seconds: float, chosen: NDArray[np.bool_]) -> None:
        """Learns what is usual from the windows of a block, of units that are chosen (b, n)."""
        for sums, usual in zip(self.sums, self.usual, strict=True):
            share = np.where(usual > 0.0, min(seconds / USUAL_SECONDS, 1.0), 1.0)
            usual += np.where(chosen[..., None], share * (_mean(sums, first, last) - usual), 0.0)


def of_set(ratio: FloatArray, active: NDArray[np.bool_]) -> FloatArray:
    """Returns the second smallest (..., b, 2) of the ratios (..., b, n, 2) of active units, or of two."""
    ordered = np.sort(np.where(active[..., None], ratio, np.inf), axis=-2)
    which = np.where(active.sum(axis=1) > 2, 1, 0)[:, None, None]
    which = np.broadcast_to(which, (*ordered.shape[:-2], 1, 2))
    return np.asarray(np.take_along_axis(ordered, which, axis=-2)[..., 0, :])


def _swings(values: FloatArray, whole: NDArray[np.bool_]) -> FloatArray:
    """Sums (t + 1, b, n, 2, 2): mean squares of second differences of an axis, and how many there are."""
    second = values[2:] - 2.0 * values[1:-1] + values[:-2]
    usable = (whole[2:] & whole[1:-1] & whole[:-2])[..., None]
    squares = (
        np.stack([np.sum(second[..., :3] ** 2, axis=-1), np.sum(second[..., 3:] ** 2, axis=-1)], -1) / 18.0
    )
    found = np.zeros((len(values) + 1, *values.shape[1:3], 2, 2))
    found[3:, ..., 0], found[3:, ..., 1] = np.where(usable, squares, 0.0), usable
    return np.asarray(np.cumsum(found, axis=0, out=found))


def _mean(sums: FloatArray, first: int, last: int) -> FloatArray:
    total = sums[last] - sums[first]
    return np.asarray(total[..., 0] / np.maximum(total[..., 1], 1.0))
