"""Clocks of secondaries beside the primary's: a delay and its rate, from angular rates.

The first seconds give the delay, every later span corrects it and its rate. A span that contradicts them is
left out: a clock that jumps, or a fault, is no drift.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.redundancy_set import Samples
from tumble.foundation.recording import FloatArray

FIRST = 5.0
"""s whose motion gives the first delay."""
SPAN = 10.0
"""s of each later span."""
SOUGHT = 0.15
"""s: largest delay that is sought."""
STEP = 0.005
"""s between delays that are tried."""
SMOOTHED = 10
"""Steps of a mean: clocks shift motion, and not vibration."""
SIGNIFICANT = 0.003
"""s: sigma of a delay beyond which the motion was too little to find it."""
SHARED = 0.5
"""Largest part of the motion that a delay may leave."""
UNKNOWN = 0.03
"""s: sigma of a delay that no motion has shown."""
INDEPENDENT = 0.3
"""Share of the samples of a mean that count as independent."""
LEAST_SIGMA = 1e-3
"""s, of a delay: filters of units differ."""
CRYSTAL = 1e-4
"""1 sigma of the rate of a crystal against another."""
CONTRADICTED = 4.0
"""Sigmas beyond which a span is left out."""


def synchronised(primary: Samples, unit: Samples, start: float) -> tuple[Samples, FloatArray]:
    """Returns the samples of a unit with the stamps of the primary's clock, as known at each time.

    The second array (k, 2) are times and sigmas of the delay from each on, s.
    """
    first = _delay(primary, unit, start, start + FIRST)
    if first is None:
        first = 0.0, UNKNOWN
    known = [(start, max(first[1], LEAST_SIGMA))]
    state = np.array([first[0], 0.0])
    covariance = np.diag([max(first[1], LEAST_SIGMA) ** 2, CRYSTAL**2])
    at, delay = start + 0.5 * FIRST, np.full(len(unit.time), state[0])
    move = np.array([[1.0, SPAN], [0.0, 1.0]])
    # Both must go on: the span that a unit does not reach shows nothing.
    last = min(float(primary.time[-1]), float(unit.time[-1])) if len(unit.time) else start
    end = start + FIRST + SPAN
    while end < last:
        seconds = end - 0.5 * SPAN - at
        move[0, 1] = seconds
        state, covariance = move @ state, move @ covariance @ move.T
        at += seconds
        found = _delay(primary, unit, end - SPAN, end)
        if found is not None:
            variance = covariance[0, 0] + max(found[1], LEAST_SIGMA) ** 2
            innovation = found[0] - state[0]
            if innovation**2 < CONTRADICTED**2 * variance:
                gain = covariance[:, 0] / variance
                state = state + gain * innovation
                covariance = covariance - np.outer(gain, covariance[0])
        known.append((end, float(np.sqrt(covariance[0, 0]))))
        delay = np.where(unit.time >= end, state[0] + state[1] * (unit.time - at), delay)
        end += SPAN
    return replace(unit, time=unit.time - delay), np.array(known)


def _rates(samples: Samples, time: FloatArray) -> FloatArray:
    rate = np.nan_to_num(samples.angular_rate)
    return np.column_stack([np.interp(time, samples.time, column) for column in rate.T])


def _smooth(rate: FloatArray) -> FloatArray:
    """Returns means over 50 ms, without the mean of all."""
    sums = np.vstack([np.zeros(3), np.cumsum(rate, axis=0)])
    means = (sums[SMOOTHED:] - sums[:-SMOOTHED]) / SMOOTHED
    return np.asarray(means - means.mean(axis=0))


def _delay(primary: Samples, unit: Samples, start: float, end: float) -> tuple[float, float] | None:
    """Returns the delay of a unit between two times and its sigma, s, or nothing where it does not show."""
    time = np.arange(start + SOUGHT, end - SOUGHT, STEP)
    if len(time) < 4 * SMOOTHED or len(unit.time) < 10 or len(primary.time) < 10:
        return None
    wanted = _smooth(_rates(primary, time))
    tried = np.arange(-SOUGHT, SOUGHT + 0.5 * STEP, STEP)
    left = np.array([np.mean((_smooth(_rates(unit, time + each)) - wanted) ** 2) for each in tried])
    best = int(np.argmin(left))
    # Without motion that both share there is nothing to shift.
    if best in (0, len(tried) - 1) or left[best] > SHARED * np.mean(wanted**2):
        return None
    before, least, after = left[best - 1 : best + 2]
    curvature = (before - 2.0 * least + after) / STEP**2
    sigma = np.sqrt(2.0 * least / (curvature * INDEPENDENT * len(wanted)))
    if not sigma < SIGNIFICANT:
        return None
    return float(tried[best] + 0.5 * STEP * (before - after) / (before - 2.0 * least + after)), float(sigma)
