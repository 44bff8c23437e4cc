"""The unit that is wrong: by the vote of three and more, or by its own samples."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from benchmarks.flights.model.means import SCALES, LeakyMeans
from benchmarks.flights.model.test import FLOOR
from benchmarks.flights.model.vibration import learn_usual, over_usual
from benchmarks.flights.model.window import BLOCK, Windows, late_after
from tumble.foundation.recording import FloatArray

CLEAR = 0.7
"""Ratio within which the others agree once the wrong unit is left out."""
CLEARER = 0.5
"""Share of that of the next best unit that the ratio must be within."""
STEADY = 0.3
"""Cosine of the deviation with that of the window before."""
REPEATS = 12
"""Equal readings in succession, beside a unit that changes."""
REPEATS_OVER_USUAL = 3
"""The same over the most that was seen in health: a coarse resolution repeats itself."""
MOVED = 2.0
"""Steps of its resolution by which the set moves until an axis has to change."""
NOISY_OVER_USUAL, NOISY_OVER_OTHERS = 6.0, 4.0
"""Own scatter over its usual, and over what the others show of theirs; root mean squares."""
NOISY_WINDOWS = (4, 20)
"""Windows in motion and at rest: motion that begins shakes the unit with the widest filter first."""
LEAST_SCATTER = (0.02, 0.002)
"""m/s^2 and rad/s: usual scatter of a sample is no less."""
LOSSY = 0.6
"""Share of whole windows over `LOSSY_WINDOWS` within which too many samples are lost."""
LOSSY_WINDOWS = 40
"""One of the scales."""


class Vote:
    """The unit, or the fewest units, without which the others agree. Sets are numbers, a bit a unit."""

    def __init__(self, pairs: Sequence[tuple[int, int]], units: int, shape: tuple[int, ...]) -> None:
        """Begins without a finding; `shape` is that of ratios (s, b, p, 2)."""
        self.pairs = tuple(pairs)
        self.units = units
        self.without = np.array([[unit not in pair for pair in pairs] for unit in range(units)])
        scales, runs, _, sensors = shape
        self.odd = np.zeros((scales, runs, sensors), dtype=np.int64)
        self.deviation = np.zeros((scales, runs, sensors, 3))

    def found(self, ratio: FloatArray, deviation: FloatArray, active: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Returns the units (b,) that were odd in two windows in succession; active pairs are (b, p)."""
        known = np.where(active[None, :, :, None], ratio, 0.0)
        worst = known.max(axis=2)
        at = np.argmax(known, axis=2)
        now = np.take_along_axis(deviation, at[:, :, None, :, None], axis=2)[:, :, 0]
        # A deviation beyond the limit of one pair is no agreement in another.
        size = np.maximum(np.linalg.norm(now, axis=-1), np.finfo(float).eps)
        in_limits = (worst / size)[:, :, None] * np.linalg.norm(deviation, axis=-1)
        limited = np.where(known > 0.0, np.maximum(known, in_limits), 0.0)
        left = np.stack([limited[:, :, some].max(axis=2, initial=0.0) for some in self.without])
        ordered = np.sort(left, axis=0)
        best = np.argmin(left, axis=0)
        is_odd = (worst > 1.0) & (ordered[0] < CLEAR) & (ordered[0] < CLEARER * ordered[1])
        sizes = np.linalg.norm(now, axis=-1) * np.linalg.norm(self.deviation, axis=-1)
        steady = np.sum(now * self.deviation, axis=-1) > STEADY * sizes
        odd = np.where(is_odd, 1 << best, 0)
        for scale, run, sensor in np.argwhere((worst > 1.0) & ~is_odd):
            odd[scale, run, sensor] = self._several(limited[scale, run, :, sensor], active[run])
        confirmed = np.where((odd > 0) & (odd == self.odd) & steady, known.max(axis=2), 0.0)
        self.odd, self.deviation = odd, now
        flat = confirmed.transpose(1, 0, 2).reshape(len(active), -1)
        units = odd.transpose(1, 0, 2).reshape(len(active), -1)
        which = np.argmax(flat, axis=1)
        rows = np.arange(len(active))
        return np.where(flat[rows, which] > 0.0, units[rows, which], 0)

    def _several(self, ratio: FloatArray, active: NDArray[np.bool_]) -> int:
        """Returns the fewest units, of two and more, that each of the rest contradicts, the most of all."""
        judged = [pair for pair, is_active in zip(self.pairs, active, strict=True) if is_active]
        ratios = dict(zip(self.pairs, ratio.tolist(), strict=True))
        all_units = sorted({unit for pair in judged for unit in pair})
        for count in range(2, (len(all_units) - 1) // 2 + 1):
            found = []
            for some in combinations(all_units, count):
                within = [ratios[pair] for pair in judged if not set(pair) & set(some)]
                across = [ratios[pair] for pair in judged if len(set(pair) & set(some)) == 1]
                is_apart = min(across) > 1.0 and min(within) > 0.0
                found.append((max(within), not is_apart, some))
            found.sort()
            (best, is_none, some), (following, *_) = found[:2]
            if not is_none and best < CLEAR and best < CLEARER * following:
                return sum(1 << unit for unit in some)
        return 0


class Own:
    """Faults that the samples of a unit show by themselves."""

    def __init__(self, windows: Sequence[Windows]) -> None:
        """Takes the windows of all runs."""
        self.silence = np.stack([each.silence for each in windows], axis=1)
        repeated = np.stack([each.repeated for each in windows], axis=1)
        # Each channel, then all at one time.
        self.repeated = np.concatenate([repeated, repeated.min(axis=-1, keepdims=True)], axis=-1)
        self.began = np.zeros(repeated.shape[1:])
        self.moved = np.zeros(repeated.shape[1:])
        self.whole = np.stack([each.is_whole for each in windows], axis=1)
        self.scatter = np.stack([each.scatter for each in windows], axis=1)
        interval = np.stack([each.interval for each in windows])
        self.resolution = np.stack([each.resolution for each in windows], axis=1)
        self.late_after = late_after(interval)
        self.kinds = np.zeros((2, *self.scatter.shape[1:]))
        self.usual = self.kinds[0]
        self.at_rest = np.zeros((self.scatter.shape[1], 1, 1), dtype=bool)
        self.most_repeated = np.zeros(self.repeated.shape[1:])
        self.noisy = np.zeros(self.scatter.shape[1:], dtype=int)
        self.longest = np.zeros((2, *self.repeated.shape[1:]))
        self.means = LeakyMeans(self.whole.shape[1:], 2)

    def take(self, step: int, motion: FloatArray) -> None:
        """Takes a window, in which the set moved by (b, 18); one that no unit has is no loss."""
        some = np.broadcast_to(self.whole[step].any(axis=1, keepdims=True), self.whole[step].shape)
        self.means.take(self.scatter[step], self.whole[step], some)
        self.longest[0] = np.maximum(self.longest[0], self.repeated[step])
        readings = np.broadcast_to(motion[:, None, :6], self.began.shape)
        self.began = np.where(self.repeated[step][..., :6] == 0, readings, self.began)
        self.moved = np.abs(readings - self.began)

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
        moves = (repeats[..., :6] < REPEATS / 2) & (self.silence[step] < self.late_after)[..., None]
        others = moves.sum(axis=1, keepdims=True) - moves > 0
        # Two units have one motion, of which a frozen one takes half away.
        share = 0.5 if same.shape[1] == 2 else 1.0
        least = np.maximum(MOVED * self.resolution[step], FLOOR)
        has_to_change = self.moved > share * np.repeat(least, 3, axis=-1)
        stuck = np.any(same[..., :6] & has_to_change & others, axis=-1)
        return np.asarray(stuck | (same[..., 6] & others.any(axis=-1)))

    def _noisy(self, step: int, active: NDArray[np.bool_]) -> NDArray[np.bool_]:
        # Units whose filters differ do not feel one vibration alike: before its own is learnt, none is noisy.
        over = over_usual(self.scatter[step], self.usual, LEAST_SCATTER)
        ratio = np.where(self.whole[step][..., None], np.sqrt(over), 0.0)
        shown = np.where(active[..., None], ratio, 0.0)
        others = np.stack(
            [np.delete(shown, unit, axis=1).max(axis=1) for unit in range(shown.shape[1])], axis=1
        )
        loud = (ratio > NOISY_OVER_USUAL) & (ratio > NOISY_OVER_OTHERS * np.maximum(others, 1.0))
        self.noisy = np.where(loud, self.noisy + 1, 0)
        windows = np.where(self.at_rest, NOISY_WINDOWS[1], NOISY_WINDOWS[0])
        return np.asarray(np.any(self.noisy >= windows, axis=-1))

    def _lossy(self, step: int) -> NDArray[np.bool_]:
        if step + 1 < 2 * LOSSY_WINDOWS:
            return np.zeros(self.whole.shape[1:], dtype=bool)
        return np.asarray(self.means.weight[SCALES.index(LOSSY_WINDOWS)] < LOSSY)

    def ratio(self) -> FloatArray:
        """Returns the scatter of samples over each scale, over its usual in motion (s, b, n, 2).

        Before any motion it is that at rest.
        """
        motion, still = self.kinds
        return over_usual(self.means.mean(), np.where(motion > 0.0, motion, still), LEAST_SCATTER)

    def set_state(self, rest: NDArray[np.bool_]) -> None:
        """Compares with the usual scatter at rest or in motion, of runs (b,)."""
        motion, still = self.kinds
        self.at_rest = rest[:, None, None]
        self.usual = np.where(self.at_rest, still, motion)

    def learn(
        self,
        seconds: float,
        chosen: NDArray[np.bool_],
        motion: NDArray[np.bool_],
        rest: NDArray[np.bool_],
    ) -> None:
        """Learns the usual scatter, of chosen units (b, n), in motion (b,) or at rest (b,)."""
        for kind, those in enumerate((motion, rest)):
            self._learn(kind, seconds, chosen & those[:, None])
        most = np.maximum(self.most_repeated, self.longest[1])
        self.most_repeated = np.where(chosen[..., None], most, self.most_repeated)

    def _learn(self, kind: int, seconds: float, chosen: NDArray[np.bool_]) -> None:
        some = chosen & (self.means.weight[SCALES.index(BLOCK)] > 0.0)
        learn_usual(self.kinds[kind], self.means.mean()[SCALES.index(BLOCK)], seconds, some)

    def end_block(self) -> None:
        """Begins the next block."""
        self.longest = np.stack([np.zeros_like(self.longest[0]), self.longest[0]])
