"""Rests: physics bounds each unit's own error, |f| = g and w = 0, and shows which of two units changed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray

WINDOWS = 20
"""Windows that have to be still before the set is at rest."""
STILL = (0.06, 0.006)
"""m/s^2 and rad/s: largest scatter of windows of a unit at rest, an axis."""
TURNING = 0.1
"""rad/s: a unit that reads more is no evidence of a rest."""
CHANGED = (0.05, 0.0025)
"""m/s^2 and rad/s, 1 sigma of the change of a sound unit from rest to rest, in another attitude."""
UNKNOWN = (0.3, 0.03)
"""The same of a unit that no rest has shown yet."""
CLIPPED = 27.0
"""Largest evidence of a sensor."""


class Rests:
    """Readings of all units at rest, and the last ones that were sound."""

    def __init__(self, reading: FloatArray, whole: NDArray[np.bool_], repeated: NDArray[np.int64]) -> None:
        """Takes readings, and equal readings in succession (t, b, n, 6), and which are whole (t, b, n)."""
        self.still = _still(reading, whole)
        moving = repeated.min(axis=-1) < WINDOWS
        known = (self.still & moving).sum(axis=2)
        usable = (whole & moving).sum(axis=2)
        # A unit that moves cannot look still, but a noisy one that is still looks moved.
        self.is_rest = (known > 0) & (2 * known >= usable)
        self.reading, self.whole = reading, whole
        self.count = np.zeros(reading.shape[1:3])
        self.total = np.zeros(reading.shape[1:])
        self.sound = np.full((*reading.shape[1:3], 4), np.nan)

    def take(self, step: int) -> None:
        """Adds a window to the rest, or ends it."""
        rest = self.is_rest[step][:, None]
        count = rest & self.whole[step]
        self.count = np.where(rest, self.count + count, 0.0)
        self.total = np.where(rest[..., None], self.total + count[..., None] * self.reading[step], 0.0)

    def means(self) -> FloatArray:
        """Returns |f| - g m/s^2 and w rad/s of units at rest (b, n, 4), NaN in the first second."""
        mean = self.total / np.maximum(self.count, 1.0)[..., None]
        norm = np.linalg.norm(mean[..., :3], axis=-1, keepdims=True) - STANDARD_GRAVITY
        found = np.concatenate([norm, mean[..., 3:]], axis=-1)
        return np.where((self.count >= WINDOWS)[..., None], found, np.nan)

    def evidence(self) -> FloatArray:
        """Returns half the square of the change of each unit (b, n) in sigmas, NaN where unknown."""
        now = self.means()
        change = np.where(np.isnan(self.sound), now, now - self.sound)
        sigmas = np.where(np.isnan(self.sound), np.repeat(UNKNOWN, [1, 3]), np.repeat(CHANGED, [1, 3]))
        squares = 0.5 * (change / sigmas) ** 2
        force, rate = squares[..., 0], squares[..., 1:].sum(axis=-1)
        return np.asarray(np.minimum(force, CLIPPED) + np.minimum(rate, CLIPPED))

    def learn(self, chosen: NDArray[np.bool_]) -> None:
        """Takes the means of units (b, n) that agree as sound."""
        now = self.means()
        self.sound = np.where(chosen[..., None] & ~np.isnan(now), now, self.sound)


def _still(reading: FloatArray, whole: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Returns whether the last second of windows (t, b, n) scatters no more than at rest."""
    values = np.where(whole[..., None], reading - reading.mean(axis=0), 0.0)
    sums = np.stack([values, values**2])
    sums = np.concatenate([np.zeros((2, 1, *values.shape[1:])), np.cumsum(sums, axis=1)], axis=1)
    counts = np.concatenate([np.zeros((1, *whole.shape[1:])), np.cumsum(whole, axis=0)])
    found = np.zeros(whole.shape, dtype=bool)
    if len(whole) < WINDOWS:
        return found
    number = np.maximum(counts[WINDOWS:] - counts[:-WINDOWS], 1.0)[..., None]
    mean, square = (sums[:, WINDOWS:] - sums[:, :-WINDOWS]) / number
    scatter = np.sqrt(np.maximum(square - mean**2, 0.0))
    limit = np.repeat(STILL, 3)
    enough = number[..., 0] >= 0.6 * WINDOWS
    turns = np.linalg.norm((mean + reading.mean(axis=0))[..., 3:], axis=-1) > TURNING
    found[WINDOWS - 1 :] = np.all(scatter < limit, axis=-1) & enough & ~turns
    return found
