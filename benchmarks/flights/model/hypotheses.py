"""The unit that is wrong: by the vote of three and more, or by its own samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from benchmarks.flights.model.means import SCALES, LeakyMeans
from benchmarks.flights.model.window import BLOCK, Windows
from tumble.foundation.recording import FloatArray

CLEAR = 0.7
"""Ratio within which the others agree once the wrong unit is left out."""
CLEARER = 0.5
"""Share of that of the next best unit that the ratio must be within."""
STEADY = 0.3
"""Cosine of the deviation with that of the window before."""
LATE = 0.1
"""s of silence."""
LATE_INTERVALS = 3.0
"""Sample intervals of silence, where these are longer."""
REPEATS = 12
"""Equal readings in succession, beside a unit that changes."""
REPEATS_OVER_USUAL = 3
"""The same over the most that was seen in health: a coarse resolution repeats itself."""
NOISY_OVER_USUAL, NOISY_OVER_OTHERS = 6.0, 4.0
"""Own scatter over its usual, and over what the others show of theirs; root mean squares."""
NOISY_WINDOWS = 4
LEAST_SCATTER = (0.02, 0.002)
"""m/s^2 and rad/s: usual scatter of a sample is no less."""
USUAL_SECONDS = 10.0
"""Time constant of the usual scatter."""
LOSSY = 0.6
"""Share of whole windows over `LOSSY_WINDOWS` within which too many samples are lost."""
LOSSY_WINDOWS = 40
"""One of the scales."""


class Vote:
    """The unit without which the others agree."""

    def __init__(self, pairs: Sequence[tuple[int, int]], units: int, shape: tuple[int, ...]) -> None:
        """Begins without a finding; `shape` is that of ratios (s, b, p, 2)."""
        self.without = np.array([[unit not in pair for pair in pairs] for unit in range(units)])
        scales, runs, _, sensors = shape
        self.odd = np.full((scales, runs, sensors), -1)
        self.deviation = np.zeros((scales, runs, sensors, 3))

    def found(self, ratio: FloatArray, deviation: FloatArray, active: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Returns the unit (b,) that was odd in two windows in succession, or -1; active pairs are (b, p)."""
        known = np.where(active[None, :, :, None], ratio, 0.0)
        worst = known.max(axis=2)
        left = np.stack([known[:, :, some].max(axis=2, initial=0.0) for some in self.without])
        ordered = np.sort(left, axis=0)
        best = np.argmin(left, axis=0)
        is_odd = (worst > 1.0) & (ordered[0] < CLEAR) & (ordered[0] < CLEARER * ordered[1])
        at = np.argmax(known, axis=2)
        now = np.take_along_axis(deviation, at[:, :, None, :, None], axis=2)[:, :, 0]
        sizes = np.linalg.norm(now, axis=-1) * np.linalg.norm(self.deviation, axis=-1)
        steady = np.sum(now * self.deviation, axis=-1) > STEADY * sizes
        odd = np.where(is_odd, best, -1)
        confirmed = np.where((odd >= 0) & (odd == self.odd) & steady, known.max(axis=2), 0.0)
        self.odd, self.deviation = odd, now
        flat = confirmed.transpose(1, 0, 2).reshape(len(active), -1)
        units = odd.transpose(1, 0, 2).reshape(len(active), -1)
        which = np.argmax(flat, axis=1)
        rows = np.arange(len(active))
        return np.where(flat[rows, which] > 0.0, units[rows, which], -1)


class Own:
    """Faults that the samples of a unit show by themselves."""

    def __init__(self, windows: Sequence[Windows]) -> None:
        """Takes the windows of all runs."""
        self.silence = np.stack([each.silence for each in windows], axis=1)
        self.repeated = np.stack([each.repeated for each in windows], axis=1)
        self.whole = np.stack([each.is_whole for each in windows], axis=1)
        self.scatter = np.stack([each.scatter for each in windows], axis=1)
        interval = np.stack([each.interval for each in windows])
        self.late_after = np.maximum(LATE, LATE_INTERVALS * interval)
        self.kinds = np.zeros((2, *self.scatter.shape[1:]))
        self.usual = self.kinds[0]
        self.most_repeated = np.zeros(self.repeated.shape[1:])
        self.noisy = np.zeros(self.scatter.shape[1:], dtype=int)
        self.longest = np.zeros((2, *self.repeated.shape[1:]))
        self.means = LeakyMeans(self.whole.shape[1:], 2)

    def take(self, step: int) -> None:
        """Takes a window; one that no unit has is a pause of the platform, and no loss."""
        some = np.broadcast_to(self.whole[step].any(axis=1, keepdims=True), self.whole[step].shape)
        self.means.take(self.scatter[step], self.whole[step], some)
        self.longest[0] = np.maximum(self.longest[0], self.repeated[step])

    def reasons(self, step: int, active: NDArray[np.bool_]) -> dict[str, NDArray[np.bool_]]:
        """Returns the units (b, n) that are at fault by each reason."""
        silence = self.silence[step]
        # A pause of all units is the platform's.
        spoken = (silence < 0.5 * self.late_after).any(axis=1, keepdims=True)
        return {
            "late": (silence > self.late_after) & spoken,
            "frozen": self._frozen(step),
            "noisy": self._noisy(step, active),
            "lossy": self._lossy(step),
        }

    def _frozen(self, step: int) -> NDArray[np.bool_]:
        repeats = self.repeated[step]
        limit = np.maximum(REPEATS, REPEATS_OVER_USUAL * self.most_repeated)
        same = repeats >= limit
        moves = (repeats < REPEATS / 2) & (self.silence[step] < self.late_after)[..., None]
        others = moves.sum(axis=1, keepdims=True) - moves
        return np.asarray(np.any(same & (others > 0), axis=-1))

    def _noisy(self, step: int, active: NDArray[np.bool_]) -> NDArray[np.bool_]:
        ratio = np.sqrt(self._over_usual(self.scatter[step]))
        ratio = np.where(self.whole[step][..., None], ratio, 0.0)
        shown = np.where(active[..., None], ratio, 0.0)
        others = np.stack(
            [np.delete(shown, unit, axis=1).max(axis=1) for unit in range(shown.shape[1])], axis=1
        )
        loud = (ratio > NOISY_OVER_USUAL) & (ratio > NOISY_OVER_OTHERS * np.maximum(others, 1.0))
        self.noisy = np.where(loud, self.noisy + 1, 0)
        return np.asarray(np.any(self.noisy >= NOISY_WINDOWS, axis=-1))

    def _over_usual(self, scatter: FloatArray) -> FloatArray:
        """Returns scatter (..., b, n, 2) over the usual one; 1 before anything is usual."""
        usual = np.maximum(self.usual, np.array(LEAST_SCATTER) ** 2)
        return np.asarray(np.where(self.usual > 0.0, scatter / usual, 1.0))

    def _lossy(self, step: int) -> NDArray[np.bool_]:
        if step + 1 < 2 * LOSSY_WINDOWS:
            return np.zeros(self.whole.shape[1:], dtype=bool)
        return np.asarray(self.means.weight[SCALES.index(LOSSY_WINDOWS)] < LOSSY)

    def ratio(self) -> FloatArray:
        """Returns the scatter of samples over each scale, over its usual (s, b, n, 2)."""
        return self._over_usual(self.means.mean())

    def set_state(self, rest: NDArray[np.bool_]) -> None:
        """Compares with the usual scatter at rest or in motion, of runs (b,), or with the known one."""
        motion, still = self.kinds
        at_rest = rest[:, None, None]
        wanted = np.where(at_rest, still, motion)
        self.usual = np.where(wanted > 0.0, wanted, motion + still)

    def learn(self, seconds: float, chosen: NDArray[np.bool_], rest: NDArray[np.bool_]) -> None:
        """Learns the usual scatter, of chosen units (b, n), at rest or not (b,)."""
        for kind, those in enumerate((~rest, rest)):
            self._learn(kind, seconds, chosen & those[:, None])

    def _learn(self, kind: int, seconds: float, chosen: NDArray[np.bool_]) -> None:
        some = (chosen & (self.means.weight[SCALES.index(BLOCK)] > 0.0))[..., None]
        usual = self.kinds[kind]
        share = np.where(usual > 0.0, min(seconds / USUAL_SECONDS, 1.0), 1.0)
        usual += np.where(some, share * (self.means.mean()[SCALES.index(BLOCK)] - usual), 0.0)
        most = np.maximum(self.most_repeated, self.longest[1])
        self.most_repeated = np.where(some, most, self.most_repeated)

    def end_block(self) -> None:
        """Begins the next block."""
        self.longest = np.stack([np.zeros_like(self.longest[0]), self.longest[0]])
