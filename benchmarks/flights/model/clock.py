"""Delay of each unit's clock behind the primary's, from angular rates: found once, then followed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.redundancy_set import Samples
from tumble.foundation.recording import FloatArray

SOUGHT = 0.15
"""s: largest delay that is sought."""
STEP = 0.005
"""s between delays that are tried."""
SMOOTHED = 10
"""Steps of a mean."""
SIGNIFICANT = 0.003
"""s: sigma of a delay beyond which the motion was too little to find it."""


def found_delay(primary: Samples, unit: Samples, start: float, end: float) -> float:
    """Returns the delay of a unit behind the primary, s, from the rates between two times; 0 if unknown."""
    time = np.arange(start + SOUGHT, end - SOUGHT, STEP)
    return _delay(unit, time, _smooth(_rates(primary, time)))


def _rates(samples: Samples, time: FloatArray) -> FloatArray:
    rate = np.nan_to_num(samples.angular_rate)
    return np.column_stack([np.interp(time, samples.time, column) for column in rate.T])


def _smooth(rate: FloatArray) -> FloatArray:
    """Returns means over 50 ms, without the mean of all: what clocks shift, and vibration does not."""
    sums = np.vstack([np.zeros(3), np.cumsum(rate, axis=0)])
    means = (sums[SMOOTHED:] - sums[:-SMOOTHED]) / SMOOTHED
    return np.asarray(means - means.mean(axis=0))


def _delay(samples: Samples, time: FloatArray, wanted: FloatArray) -> float:
    tried = np.arange(-SOUGHT, SOUGHT + 0.5 * STEP, STEP)
    if len(wanted) < 20 or len(samples.time) < 10:
        return 0.0
    left = np.array([np.mean((_smooth(_rates(samples, time + each)) - wanted) ** 2) for each in tried])
    best = int(np.argmin(left))
    if best in (0, len(tried) - 1):
        return 0.0
    before, least, after = left[best - 1 : best + 2]
    curvature = (before - 2.0 * least + after) / STEP**2
    # Vibration is alike for longer than a sample: a tenth of the samples counts as independent.
    sigma = np.sqrt(least / (0.5 * curvature * 0.3 * len(wanted))) if curvature > 0.0 else np.inf
    return float(tried[best] + 0.5 * STEP * (before - after) / (before - 2.0 * least + after)) if sigma < SIGNIFICANT else 0.0


@dataclass(slots=True)
class Delays:
    """What is left of the delays of all units of all runs, followed from window to window."""

    mean: FloatArray
    """(b, n) s."""
    variance: FloatArray
    """(b, n) s^2."""
