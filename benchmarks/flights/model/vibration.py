"""Vibration of the set over its usual: it raises the noise of all pairs, and no unit may raise it alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.flights.model.means import LeakyMeans
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

    def __init__(self, runs: int, units: int) -> None:
        """Begins without a window."""
        self.is_pair = units == 2
        self.means = [LeakyMeans((runs, units), 2, (WINDOWS,)) for _ in range(1 + self.is_pair)]
        self.usual = [np.zeros((runs, units, 2)) for _ in self.means]
        self.before: list[list[FloatArray]] = [[] for _ in self.means]
        self.whole: list[NDArray[np.bool_]] = []

    def take(self, reading: FloatArray, motion: FloatArray, whole: NDArray[np.bool_]) -> None:
        """Takes readings (b, n, 6), the motion of the set (b, 18) and which are whole (b, n)."""
        self.whole = [*self.whole[-2:], whole]
        deviation = reading - motion[:, None, :6]
        for index, values in enumerate((deviation, reading)[: len(self.means)]):
            self.before[index] = [*self.before[index][-2:], values]
            if len(self.whole) == 3:
                oldest, middle, latest = self.before[index]
                squares = (latest - 2.0 * middle + oldest) ** 2 / 18.0
                swings = np.stack([squares[..., :3].sum(axis=-1), squares[..., 3:].sum(axis=-1)], axis=-1)
                self.means[index].take(swings, np.all(self.whole, axis=0))

    def ratio(self) -> FloatArray:
        """Returns the variance of the last second over its usual (b, n, 2); 1 before anything is usual."""
        found = []
        for means, usual in zip(self.means, self.usual, strict=True):
            found.append(over_usual(means.mean()[0], usual, LEAST))
        return np.asarray(np.min(found, axis=0))

    def learn(
        self,
        seconds: float,
        chosen: NDArray[np.bool_],
        motion: NDArray[np.bool_],
        has_moved: NDArray[np.bool_],
    ) -> None:
        """Learns what is usual of units (b, n): in motion (b,), or before they have moved (b, n)."""
        anew = chosen & motion[:, None] & ~has_moved
        chosen = chosen & (motion[:, None] | ~has_moved)
        for means, usual in zip(self.means, self.usual, strict=True):
            usual[anew] = 0.0
            learn_usual(usual, means.mean()[0], seconds, chosen)


def over_usual(variance: FloatArray, usual: FloatArray, least: tuple[float, float]) -> FloatArray:
    """Returns variances (..., b, n, 2) over the usual ones (b, n, 2), which are `least` squared at least.

    It is 1 before anything is usual.
    """
    over = variance / np.maximum(usual, np.array(least) ** 2)
    return np.asarray(np.where(usual > 0.0, over, 1.0))


def learn_usual(usual: FloatArray, variance: FloatArray, seconds: float, chosen: NDArray[np.bool_]) -> None:
    """Moves what is usual (b, n, 2) towards variances of a block, of units that are chosen (b, n)."""
    share = np.where(usual > 0.0, min(seconds / USUAL_SECONDS, 1.0), 1.0)
    usual += np.where(chosen[..., None], share * (variance - usual), 0.0)


def of_set(ratio: FloatArray, active: NDArray[np.bool_]) -> FloatArray:
    """Returns the second smallest (..., b, 2) of the ratios (..., b, n, 2) of active units, or of two."""
    ordered = np.sort(np.where(active[..., None], ratio, np.inf), axis=-2)
    which = np.where(active.sum(axis=1) > 2, 1, 0)[:, None, None]
    which = np.broadcast_to(which, (*ordered.shape[:-2], 1, 2))
    return np.asarray(np.take_along_axis(ordered, which, axis=-2)[..., 0, :])
