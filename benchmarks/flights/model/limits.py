"""Errors that no sound unit has: beyond them one is out, by those without it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from benchmarks.flights.model.error import Errors, levers
from benchmarks.flights.model.hypotheses import CLEAR, CLEARER
from tumble.foundation.recording import FloatArray

ARMING = (0.7, 0.087)
"""m/s^2 and rad/s by which others that agree may differ from the primary at rest (PX4, ArduPilot)."""
ALWAYS = (2.0, 0.25)
"""The same of any unit, in motion too: vibration shifts biases, and a secondary is calibrated first."""
SIGMAS = 4.0
"""Sigmas of an error that count in its favour."""
BLOCKS = 3
"""Blocks in succession."""


class Limits:
    """Learnt errors of all units against one another."""

    def __init__(self, pairs: Sequence[tuple[int, int]], units: int, runs: int) -> None:
        """Begins without a finding."""
        self.first, self.second = (np.array(each) for each in zip(*pairs, strict=True))
        self.without = np.array([[unit not in pair for pair in pairs] for unit in range(units)])
        self.odd, self.count = np.full(runs, -1), np.zeros(runs, dtype=int)

    def found(
        self, errors: Errors, motion: FloatArray, active: NDArray[np.bool_], rest: NDArray[np.bool_]
    ) -> NDArray[np.int64]:
        """Returns the unit (b,) that is odd for `BLOCKS`, or -1, at a motion (b, 18), at rest (b,)."""
        lever = levers(motion[:, 9:12], motion[:, 12:])
        error = np.stack(
            [
                errors.force_error(motion[:, None, :3], lever[:, None]),
                errors.rate_error(motion[:, None, 3:6]),
            ],
            axis=2,
        )
        variance = np.stack(
            [
                errors.force_variance(motion[:, :3], lever).sum(axis=-1),
                3.0 * errors.rate_variance(motion[:, 3:6]),
            ],
            axis=2,
        )
        apart = np.linalg.norm(error[:, self.first] - error[:, self.second], axis=-1)
        spread = SIGMAS**2 * (variance[:, self.first] + variance[:, self.second])
        judged = (active[:, self.first] & active[:, self.second])[..., None]
        best = np.full(len(active), -1)
        for unit in range(active.shape[1]):
            limit = np.where(rest[:, None, None], ARMING if unit == 0 else ALWAYS, ALWAYS)
            ratio = np.where(judged, apart / np.sqrt(limit**2 + spread), 0.0)
            left = np.stack([ratio[:, some].max(axis=1, initial=0.0) for some in self.without])
            # All pairs with the unit are beyond, and what is left without it is clearly less.
            of_unit = np.where(judged & ~self.without[unit][None, :, None], ratio, np.inf).min(axis=1)
            next_best = np.delete(left, unit, axis=0).min(axis=0)
            is_odd = (of_unit > 1.0) & np.isfinite(of_unit) & (left[unit] < CLEAR)
            is_odd &= left[unit] < CLEARER * next_best
            best = np.where(is_odd.any(axis=1) & (active.sum(axis=1) > 2), unit, best)
        self.count = np.where((best >= 0) & (best == self.odd), self.count + 1, (best >= 0).astype(int))
        self.odd = best
        return np.where(self.count >= BLOCKS, best, -1)
