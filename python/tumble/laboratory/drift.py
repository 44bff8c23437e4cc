"""Drift of a parameter as a random walk, pooled over the units of a model (docs/theory/drift.md).

Times are years, variances are in the unit of the parameter squared, `q` is variance a year.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray

CONFIDENCE = 0.95
"""Probability of being within limits below which a unit is due."""
HORIZON = 30.0
"""Years ahead beyond which nothing is predicted."""
FEWEST_STEPS = 3
"""Changes from one calibration to the next from which a walk is estimated: of fewer eq. 6 has no mean."""
_COARSE = np.geomspace(1e-4, 1e2, 121)
"""Walks tried first, in root mean square steps."""
_FINE = 81
_NEGLIGIBLE = 18.0
"""Log-likelihood below its maximum that counts as nothing."""
_DAY = 1.0 / 365.25


@dataclass(frozen=True, slots=True)
class Series:
    """Values of one parameter of one unit, in the order of time."""

    times: FloatArray
    """(n,) years."""
    values: FloatArray
    """(n,)"""
    variances: FloatArray
    """(n,) of measurement, without what the reference leaves on all values alike; positive."""
    common: float = 0.0
    """Variance that the reference leaves on all values alike."""


@dataclass(frozen=True, slots=True)
class Walk:
    """Probable values of q, from all units of a model."""

    q: float
    """REML estimate, variance a year."""
    low: float
    high: float
    """Ends of the interval that holds q with 95 %."""
    grid: FloatArray
    """(m,) values of q."""
    weights: FloatArray
    """(m,) their probabilities, eq. 6; they sum up to 1."""
    units: int
    steps: int
    """Changes from one calibration to the next that it rests on."""


@dataclass(frozen=True, slots=True)
class DriftState:
    """A unit after its last calibration, for each q of a walk."""

    time: float
    """Years, of the last calibration."""
    means: FloatArray
    """(m,)"""
    variances: FloatArray
    """(m,) without what the reference leaves on all values alike."""
    common: float


def log_likelihood(q: FloatArray, fleet: Sequence[Series]) -> FloatArray:
    """(m,) restricted log-likelihood of each q, eq. 5, but for a constant."""
    total = np.zeros(len(q))
    for length in sorted({len(each.times) for each in fleet}):
        alike = [each for each in fleet if len(each.times) == length]
        total += _filtered(q, alike)[0]
    return total


def _filtered(q: FloatArray, fleet: Sequence[Series]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Log-likelihood (m,), and mean and variance (m, units) after the last value, of series of one length."""
    times = np.array([each.times for each in fleet])
    values = np.array([each.values for each in fleet])
    noise = np.array([each.variances for each in fleet])
    mean = np.tile(values[:, 0], (len(q), 1))  # eq. 3: nothing is known before the first value
    variance = np.tile(noise[:, 0], (len(q), 1))
    total = np.zeros(len(q))
    for k in range(1, times.shape[1]):
        predicted = variance + q[:, None] * (times[:, k] - times[:, k - 1])  # eq. 1
        spread = predicted + noise[:, k]
        innovation = values[:, k] - mean
        gain = predicted / spread
        mean = mean + gain * innovation  # eq. 4
        variance = predicted * (1.0 - gain)
        total -= 0.5 * (np.log(spread) + innovation**2 / spread).sum(axis=1)  # eq. 5
    return total, mean, variance


def pooled_walk(fleet: Sequence[Series]) -> Walk | None:
    """Estimate the walk that all units of a model share; None where they show too few changes."""
    used = [each for each in fleet if len(each.times) > 1]
    steps = sum(len(each.times) - 1 for each in used)
    if steps < FEWEST_STEPS:
        return None
    size = _root_mean_square_step(used)
    sigmas = np.concatenate([[0.0], size * _COARSE])
    likely = log_likelihood(sigmas**2, used)
    near = np.flatnonzero(likely > likely.max() - _NEGLIGIBLE)
    low, high = sigmas[max(0, near[0] - 1)], sigmas[min(len(sigmas) - 1, near[-1] + 1)]
    # Walks just above nothing lie closer together than those far above.
    fine = low + (high - low) * np.linspace(0.0, 1.0, _FINE) ** (2.0 if low == 0.0 else 1.0)
    likely = log_likelihood(fine**2, used)
    weights = np.exp(likely - likely.max()) * np.gradient(fine)  # eq. 6
    weights /= weights.sum()
    share = np.cumsum(weights) - 0.5 * weights
    ends = np.interp([0.5 * (1.0 - CONFIDENCE), 0.5 * (1.0 + CONFIDENCE)], share, fine)
    return Walk(
        q=_maximum(fine, likely) ** 2,
        low=float(ends[0] ** 2),
        high=float(ends[1] ** 2),
        grid=fine**2,
        weights=weights,
        units=len(used),
        steps=steps,
    )


def _root_mean_square_step(fleet: Sequence[Series]) -> float:
    """Size of a walk that would make the changes alone, per root of a year; never zero."""
    squares = np.concatenate([np.diff(each.values) ** 2 + each.variances[1:] for each in fleet])
    spans = np.concatenate([np.maximum(np.diff(each.times), _DAY) for each in fleet])
    return float(np.sqrt(np.mean(squares / spans)))


def _maximum(places: FloatArray, heights: FloatArray) -> float:
    """Place of the maximum of a parabola through the highest point and its neighbours."""
    top = int(np.argmax(heights))
    if top in (0, len(places) - 1):
        return float(places[top])
    around = slice(top - 1, top + 2)
    bend, slope, _ = np.polyfit(places[around] - places[top], heights[around] - heights[top], 2)
    return float(places[top] - slope / (2.0 * bend)) if bend < 0.0 else float(places[top])


def state_after(series: Series, walk: Walk) -> DriftState:
    """Return a unit after its last calibration."""
    _, mean, variance = _filtered(walk.grid, [series])
    return DriftState(float(series.times[-1]), mean[:, 0], variance[:, 0], series.common)


def probability_within(state: DriftState, walk: Walk, time: float, centre: float, limit: float) -> float:
    """Probability that the true value is within centre ± limit at a time, eq. 8."""
    sigmas = np.sqrt(_variances(state, walk, time))
    upper = _normal((centre + limit - state.means) / sigmas)
    lower = _normal((centre - limit - state.means) / sigmas)
    return float(walk.weights @ (upper - lower))


def probability_below(state: DriftState, walk: Walk, time: float, value: float, noise: float = 0.0) -> float:
    """Probability that the true value, or with `noise` (variance) a measured one, is below `value`, eq. 7."""
    sigmas = np.sqrt(_variances(state, walk, time) + noise)
    return float(walk.weights @ _normal((value - state.means) / sigmas))


def interval(
    state: DriftState, walk: Walk, time: float, *, noise: float = 0.0, share: float = CONFIDENCE
) -> tuple[float, float]:
    """Interval that holds the true value at a time, or with `noise` (variance) a measured one, eq. 7."""
    reach = 12.0 * float(np.sqrt(_variances(state, walk, time) + noise).max())
    low, high = float(state.means.min()) - reach, float(state.means.max()) + reach

    def below(value: float) -> float:
        return probability_below(state, walk, time, value, noise)

    tail = 0.5 * (1.0 - share)
    return _crossing(below, tail, low, high), _crossing(below, 1.0 - tail, low, high)


def due_time(state: DriftState, walk: Walk, centre: float, limit: float) -> float | None:
    """Time at which the probability of being within a limit falls below 95 %, eq. 9; None beyond the horizon.

    It is that of the last calibration where the unit is due at once.
    """

    def outside(time: float) -> float:
        return 1.0 - probability_within(state, walk, time, centre, limit)

    first, last = state.time, state.time + HORIZON
    if outside(first) > 1.0 - CONFIDENCE:
        return first
    if outside(last) <= 1.0 - CONFIDENCE:
        return None
    return _crossing(outside, 1.0 - CONFIDENCE, first, last)


def _variances(state: DriftState, walk: Walk, time: float) -> FloatArray:
    """(m,) variances of the true value at a time, eq. 7."""
    found: FloatArray = state.variances + walk.grid * max(0.0, time - state.time) + state.common
    return found


def _crossing(function: Callable[[float], float], level: float, low: float, high: float) -> float:
    """Return where a function that grows crosses a level, by bisection."""
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if function(middle) < level else (low, middle)
    return 0.5 * (low + high)


def _normal(numbers: FloatArray) -> FloatArray:
    """Return probabilities of a standard normal variable to be smaller."""
    return np.array([0.5 * math.erfc(-each / math.sqrt(2.0)) for each in numbers])
