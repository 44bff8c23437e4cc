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
MOVED = 4.0
"""Scatters beyond which a window is no part of the rest before it."""
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

    def __init__(self, runs: int, units: int) -> None:
        """Begins without a window."""
        shape = (runs, units)
        self.length = np.zeros(shape)
        self.middle, self.squares = np.zeros((*shape, 6)), np.zeros((*shape, 6))
        self.is_rest = np.zeros(runs, dtype=bool)
        self.count = np.zeros(shape)
        self.total = np.zeros((*shape, 6))
        self.sound = np.full((*shape, 4), np.nan)

    def take(self, reading: FloatArray, whole: NDArray[np.bool_], repeated: NDArray[np.int64]) -> None:
        """Takes readings (b, n, 6), whole or not (b, n), and equal ones in succession (b, n, 6)."""
        still = self._still(reading, whole)
        moving = repeated.min(axis=-1) < WINDOWS
        known = (still & moving).sum(axis=1)
        usable = (whole & moving).sum(axis=1)
        # A unit that moves cannot look still, but a noisy one that is still looks moved.
        self.is_rest = (known > 0) & (2 * known >= usable)
        rest = self.is_rest[:, None]
        count = rest & whole
        self.count = np.where(rest, self.count + count, 0.0)
        self.total = np.where(rest[..., None], self.total + count[..., None] * reading, 0.0)

    def _still(self, reading: FloatArray, whole: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Returns whether units (b, n) have scattered no more than at rest for so many windows."""
        limit = np.repeat(STILL, 3)
        length = self.length + whole
        away = np.where(whole[..., None], reading - self.middle, 0.0)
        middle = self.middle + away / np.maximum(length, 1.0)[..., None]
        squares = self.squares + away * np.where(whole[..., None], reading - middle, 0.0)
        moved = np.any(np.abs(away) > MOVED * limit, axis=-1)
        moved |= (length >= WINDOWS) & np.any(squares > length[..., None] * limit**2, axis=-1)
        moved &= whole
        self.length = np.where(moved, 1.0, length)
        self.middle = np.where(moved[..., None], reading, middle)
        self.squares = np.where(moved[..., None], 0.0, squares)
        turns = np.linalg.norm(self.middle[..., 3:], axis=-1) > TURNING
        return np.asarray(whole & (self.length >= WINDOWS) & ~turns)

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
