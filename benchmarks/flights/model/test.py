"""Comparison of all pairs of units over seven scales of time, against what health explains."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from benchmarks.flights.model.error import Errors, levers
from benchmarks.flights.model.means import SCALES, LeakyMeans
from benchmarks.flights.model.window import BLOCK, HOP
from tumble.foundation.recording import FloatArray

LIMITS = (10.0, 9.0, 8.0, 7.0, 7.0, 7.0, 7.0)
"""Sigmas beyond which a pair disagrees, by scale."""
DELAYED = 0.0085
"""s: the most that a delay may explain of a deviation along the derivative."""
DELAYED_INTERVALS = 0.75
"""Sample intervals that it may explain, where these are longer."""
DELAYED_SIGMAS = 3.0
"""Sigmas of an uncertain delay that it may explain."""
BETWEEN = 0.25
"""Share of the square of the interval times the second derivative that straight lines miss at most."""
FLOOR = (0.03, 0.0035)
"""m/s^2 and rad/s that never count as a deviation."""
NONLINEAR = (0.004, 0.003)
"""Share of the motion that a model linear in it leaves."""
USABLE = 0.6
"""Share of the windows of a mean that must be whole."""
LEARNT_SECONDS = (4.0, 12.0)
"""Time constants with which the usual noise rises and falls."""
WANDERS = 0.25
"""Share of the variance of white noise that the mean over any scale has at least: aliases wander."""
CLIPPED = 9.0
"""Variances beyond which a deviation adds no more to the usual noise."""
DIFFERENCED = 5
"""Windows up to which the mean over a block is no noise."""
LEAST_NOISE = (0.02, 0.001)
"""m/s^2 and rad/s of the usual noise of a pair over one window."""
FIRST_NOISE = (0.3, 0.02)
"""The same before anything is learnt."""
FIRST_BLOCKS = 0.25
"""Blocks that these count for."""
MOTION, BENDS = 18, 6


class PairMeans:
    """Means of what pairs differ by, and of the motion of the set."""

    def __init__(self, runs: int, units: int) -> None:
        """Begins without a window."""
        self.pairs = tuple(combinations(range(units), 2))
        self.first, self.second = (np.array(each) for each in zip(*self.pairs, strict=True))
        # A delay shows along the derivative over the very windows of the pair, and over no others.
        self.difference = LeakyMeans((runs, len(self.pairs)), 12)
        self.motion = LeakyMeans((runs,), MOTION + BENDS)
        self.changed: FloatArray | None = None

    def take(self, reading: FloatArray, errors: Errors, whole: NDArray[np.bool_], motion: FloatArray) -> None:
        """Takes windows: readings (b, n, 6), whole or not (b, n), the motion of the set (b, 18).

        Errors are subtracted along each window, since a pair may miss some.
        """
        reading = reading - errors.both(motion)
        both = whole[:, self.first] & whole[:, self.second]
        change = motion[:, 6:12]
        apart = reading[:, self.first] - reading[:, self.second]
        along = np.broadcast_to(change[:, None], apart.shape)
        self.difference.take(np.concatenate([apart, along], axis=-1), both)
        bends = np.zeros_like(change) if self.changed is None else ((change - self.changed) / HOP) ** 2
        some: NDArray[np.bool_] = np.asarray(whole.any(axis=1))
        self.motion.take(np.concatenate([motion, bends], axis=-1), some)
        self.changed = change if self.changed is None else np.where(some[:, None], change, self.changed)

    def move(self, before: Errors, after: Errors) -> None:
        """Moves all means by a change of the errors, along the mean motion, so that nothing steps."""
        change = np.stack([after.both(each) - before.both(each) for each in self.motion.mean()[..., :MOTION]])
        apart = change[:, :, self.first] - change[:, :, self.second]
        self.difference.total[..., :6] -= self.difference.weight[..., None] * apart


def motion_of_set(
    reading: FloatArray, change: FloatArray, product: FloatArray, whole: NDArray[np.bool_]
) -> FloatArray:
    """Returns the median (t, b, 18) of reading, change and product over the whole units (t, b, n)."""
    joined = np.concatenate([reading, change, product], axis=-1)
    ordered = np.sort(np.where(whole[..., None], joined, np.inf), axis=2)
    count = whole.sum(axis=2)
    low, high = (np.maximum(count - 1, 0) // 2, count // 2)
    low, high = (np.minimum(each, reading.shape[2] - 1)[..., None, None] for each in (low, high))
    middle = 0.5 * (np.take_along_axis(ordered, low, axis=2) + np.take_along_axis(ordered, high, axis=2))
    return np.asarray(np.where(np.isfinite(middle), middle, 0.0)[:, :, 0])


@dataclass(frozen=True, slots=True)
class Comparison:
    """All pairs at one time."""

    deviation: FloatArray
    """(s, b, p, 2, 3) m/s^2 and rad/s: without what errors and delays explain."""
    uncertainty: FloatArray
    """(s, b, p, 2, 3) variance of the errors of both units along this motion."""
    noise: FloatArray
    """(s, b, p, 2, 3) usual variance, as vibration raises it."""
    ratio: FloatArray
    """(s, b, p, 2) sigmas of the deviation over the limit; 0 where the means are not usable."""
    is_usable: NDArray[np.bool_]
    """(s, b, p)."""


class PairTest:
    """Pairs of units against the noise that each usually has."""

    def __init__(self, runs: int, units: int, interval: FloatArray) -> None:
        """Begins with the noise of `FIRST_NOISE`; sample intervals (b, n) s."""
        self.means, self.interval = PairMeans(runs, units), interval
        self.first, self.second = self.means.first, self.means.second
        pairs = len(self.first)
        scale = np.array(SCALES)[:, None, None, None, None]
        self.least = (np.array(LEAST_NOISE)[:, None] ** 2) / scale
        shape = (len(SCALES), runs, pairs, 2, 3)
        self.noise = np.broadcast_to((np.array(FIRST_NOISE)[:, None] ** 2) / scale, shape).copy()
        self.blocks = np.full(shape, FIRST_BLOCKS)
        self._sums = np.zeros((4, *shape))

    def compare(self, errors: Errors, shaking: FloatArray, delayed: FloatArray) -> Comparison:
        """Compares all pairs; vibration over its usual (s, b, 2), sigmas of delays (b, n) s."""
        scales = np.array(SCALES)[:, None, None]
        usable = self.means.difference.weight >= USABLE
        difference, along = np.split(self.means.difference.mean(), 2, axis=-1)
        motion = self.means.motion.mean()
        reading = motion[:, :, None, :6]
        deviation = np.stack([difference[..., :3], difference[..., 3:]], axis=-2)
        largest = np.maximum(DELAYED, DELAYED_INTERVALS * self.interval)
        largest = np.maximum(largest, DELAYED_SIGMAS * delayed)
        largest = np.maximum(largest[:, self.first], largest[:, self.second])[:, :, None, None]
        changes = np.stack([along[..., :3], along[..., 3:]], axis=-2)
        deviation = _without_delay(deviation, changes, largest)
        uncertainty = self._uncertainty(errors, motion[..., :MOTION])
        slow = np.stack([reading[..., :3] - reading[-1:, ..., :3], reading[..., 3:]], axis=-2)
        left = (np.array(NONLINEAR)[:, None] ** 2) * np.sum(slow**2, axis=-1, keepdims=True)
        limits = np.array(LIMITS)[:, None, None, None, None]
        floor = (np.array(FLOOR)[:, None] / limits) ** 2
        white = WANDERS * self.noise[:1] / scales[..., None, None]
        noise = np.maximum(self.noise, white) * np.maximum(shaking, 1.0)[:, :, None, :, None]
        curved = self._curved(motion[..., MOTION:] / scales)
        squares = np.sum(deviation**2 / (noise + floor + uncertainty + left + curved), axis=-1)
        ratio = np.where(usable[..., None], np.sqrt(squares) / limits[..., 0], 0.0)
        return Comparison(deviation, uncertainty, noise, ratio, usable)

    def _uncertainty(self, errors: Errors, mean: FloatArray) -> FloatArray:
        """Variance (s, b, p, 2, 3) of both units' errors along the motion of the set (s, b, 18)."""
        lever = levers(mean[..., 9:12], mean[..., 12:])
        force = errors.force_variance(mean[..., :3], lever)
        rate = np.broadcast_to(errors.rate_variance(mean[..., 3:6])[..., None], force.shape)
        each = np.stack([force, rate], axis=-2)
        return np.asarray(each[:, :, self.first] + each[:, :, self.second])

    def _curved(self, bends: FloatArray) -> FloatArray:
        """Variance (s, b, p, 2, 3) of motion between samples, which no straight line follows."""
        each = BETWEEN * (self.interval[:, self.first] ** 2 + self.interval[:, self.second] ** 2)
        variance = bends[:, :, None] * each[None, :, :, None] ** 2
        return np.asarray(variance.reshape(*variance.shape[:-1], 2, 3))

    def note(self, comparison: Comparison) -> None:
        """Adds a comparison to the block."""
        clipped = np.minimum(comparison.deviation**2, CLIPPED * (comparison.noise + comparison.uncertainty))
        usable = comparison.is_usable[..., None, None]
        self._sums[0] += np.where(usable, clipped, 0.0)
        self._sums[1] += np.where(usable, comparison.deviation, 0.0)
        self._sums[2] += np.where(usable, comparison.uncertainty, 0.0)
        self._sums[3] += usable

    def learn(self, sums: FloatArray, seconds: float, chosen: NDArray[np.bool_]) -> None:
        """Moves the usual noise towards that of a block, of the runs and pairs that are chosen (b, p)."""
        square, mean, uncertainty = sums[:3] / np.maximum(sums[3], 1.0)
        short = (np.array(SCALES) <= DIFFERENCED)[:, None, None, None, None]
        target = np.maximum(square - np.where(short, mean**2, uncertainty), self.least)
        rate = np.where(target > self.noise, seconds / LEARNT_SECONDS[0], seconds / LEARNT_SECONDS[1])
        some = chosen[None, :, :, None, None] & (sums[3] > 0.5 * BLOCK)
        # The first blocks are averaged: before them no more is known than one block would show.
        self.blocks += some
        rate = np.maximum(rate, 1.0 / self.blocks)
        self.noise += np.where(some, rate * (target - self.noise), 0.0)

    def forget_noise(self, chosen: NDArray[np.bool_]) -> None:
        """Begins to learn the noise anew, of pairs (b, p)."""
        self.blocks[:, chosen] = FIRST_BLOCKS

    def taken(self) -> FloatArray:
        """Returns the sums of the block, and begins the next."""
        sums, self._sums = self._sums, np.zeros_like(self._sums)
        return sums


def _without_delay(deviation: FloatArray, change: FloatArray, largest: FloatArray) -> FloatArray:
    """Subtracts what a delay, s, of either sign explains: along the derivative (..., 3) of the set."""
    size = np.linalg.norm(change, axis=-1, keepdims=True)
    along = change / np.maximum(size, 1e-12)
    part = np.sum(deviation * along, axis=-1, keepdims=True)
    return np.asarray(deviation - np.clip(part, -largest * size, largest * size) * along)
