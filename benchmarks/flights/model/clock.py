"""Clocks of secondaries beside the primary's: a delay and its rate, from angular rates of windows.

The first span finds the delay among whole windows, every later one corrects it and its rate by least squares
along the derivative, beside a matrix and a bias. A span that contradicts them is left out: a clock that
jumps, or a fault, is no drift.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.flights.model.error import GYROSCOPE_SIGMA, UNCALIBRATED
from benchmarks.flights.model.window import HOP, UnitWindows, averaged
from benchmarks.redundancy_set import Samples
from tumble.foundation.recording import FloatArray

FOUND = 50
"""Windows whose motion gives the first delay."""
SPANS = (35, 200)
"""Windows of the span after it, and of all later ones."""
SOUGHT = 3
"""Windows: largest delay that is sought, and beyond it by one."""
APPLIED = 7
"""Windows after a span from which on its delay holds: until then no window of its own is missing any more."""
SIGNIFICANT = 0.003
"""s: sigma of a delay beyond which the motion was too little to find it."""
SHARED = 0.5
"""Largest part of the motion that a delay may leave."""
UNKNOWN = 0.03
"""s: sigma of a delay that no motion has shown."""
COARSE = 0.01
"""s: sigma of a delay that is found among whole windows."""
CORRELATED = 2.0
"""Windows that overlap count as so many fewer."""
LEAST_SIGMA = 2e-3
"""s, of a delay: filters of units differ, and so do delays from one motion to another."""
CRYSTAL = 2e-4
"""1 sigma of the rate of a crystal against another."""
CLEAR = 10.0
"""Square of the derivative over that of its noise, with which a delay is found too small by a tenth."""
CONTRADICTED = 4.0
"""Sigmas beyond which a span is left out."""
BEGINS = (FOUND + APPLIED + SPANS[0] + APPLIED + 1) * HOP
"""s from the first window until a delay has been found and corrected."""


@dataclass(slots=True)
class Clock:
    """Delay of a unit and its rate, a line in its own time from each of some times on."""

    state: FloatArray = field(default_factory=lambda: np.zeros(2))
    """s, and s a second."""
    covariance: FloatArray = field(default_factory=lambda: np.diag([UNKNOWN**2, CRYSTAL**2]))
    at: float = 0.0
    lines: list[tuple[float, float, float, float]] = field(default_factory=list)
    """From, delay, rate, and the time of the delay, s."""
    sigmas: list[tuple[int, float]] = field(default_factory=lambda: [(0, UNKNOWN)])
    """Window from which on all are corrected, and s."""

    def corrected(self, stamps: FloatArray) -> FloatArray:
        """Returns stamps by the clock of the primary, to the microsecond."""
        delay = np.zeros(len(stamps))
        for since, first, rate, at in self.lines:
            delay = np.where(stamps >= since, first + rate * (stamps - at), delay)
        return np.asarray(np.round(stamps - np.round(delay, 6), 6))

    def start(self, delay: float, middle: float) -> None:
        """Takes the first delay, at a time, s."""
        self.state, self.covariance = np.array([delay, 0.0]), np.diag([COARSE**2, CRYSTAL**2])
        self.at = middle

    def correct(self, left: float, sigma: float, middle: float) -> None:
        """Takes the delay that is left in a span, and its sigma, s, at a time."""
        seconds = middle - self.at
        move = np.array([[1.0, seconds], [0.0, 1.0]])
        self.state, self.covariance = move @ self.state, move @ self.covariance @ move.T
        self.at = middle
        variance = self.covariance[0, 0] + max(sigma, LEAST_SIGMA) ** 2
        if left**2 < CONTRADICTED**2 * variance:
            gain = self.covariance[:, 0] / variance
            self.state = self.state + gain * left
            self.covariance = self.covariance - np.outer(gain, self.covariance[0])

    def apply(self, window: int, since: float) -> None:
        """Lets the delay hold from a time of the unit's own clock on, s."""
        self.lines.append((since, float(self.state[0]), float(self.state[1]), self.at))
        self.sigmas.append((window, float(np.sqrt(self.covariance[0, 0]))))


def synchronised(
    primary: UnitWindows, unit: Samples, time: FloatArray
) -> tuple[UnitWindows, FloatArray, Clock]:
    """Returns the windows of a unit at times (t,) s of the primary's clock, as known at each.

    The second (t,) are sigmas of the delay, s.
    """
    clock = Clock()
    stamps = np.round(unit.time, 6)
    windows = averaged(replace(unit, time=stamps), time)
    first, start, end = True, 0, FOUND
    while end <= len(time):
        if first:
            delay = _found(primary, windows, end)
            if delay is not None:
                clock.start(delay, _middle(time, end - FOUND, end))
        else:
            left = _left(primary, windows, start, end)
            if left is not None:
                clock.correct(*left, _middle(time, start, end))
            delay = left[0] if left is not None else None
        if delay is None:
            start, end = end, end + (FOUND if first else SPANS[1])
            continue
        length = SPANS[0] if first else SPANS[1]
        first = False
        clock.apply(end + APPLIED + 1, float(time[end - 1]) + (1 + APPLIED) * HOP)
        windows = averaged(replace(unit, time=clock.corrected(stamps)), time)
        start = end + APPLIED + 1
        end = start + length
    since = np.array([each[0] for each in clock.sigmas])
    sigmas = np.array([each[1] for each in clock.sigmas])
    return windows, sigmas[np.searchsorted(since, np.arange(len(time)), side="right") - 1], clock


def _middle(time: FloatArray, start: int, end: int) -> float:
    return float(time[start]) + 0.5 * (end - 1 - start) * HOP


def _rates(windows: UnitWindows) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    return windows[0][:, 3:], windows[1][:, 3:], windows[4]


def _found(primary: UnitWindows, unit: UnitWindows, end: int) -> float | None:
    """Returns the delay of the windows before `end`, s, or nothing where it does not show."""
    wanted, _, whole = _rates(primary)
    given, _, known = _rates(unit)
    latest = np.arange(end - FOUND, end)
    left = []
    for delay in range(-SOUGHT, SOUGHT + 1):
        of_primary, of_unit = latest - max(delay, 0), latest - max(-delay, 0)
        inside = np.minimum(of_primary, of_unit) >= 0
        of_primary, of_unit = of_primary[inside], of_unit[inside]
        both = whole[of_primary] & known[of_unit]
        left.append(_scatter(given[of_unit][both] - wanted[of_primary][both]))
    motion = _scatter(wanted[latest][whole[latest]])
    best = int(np.argmin(left))
    # Without motion that both share there is nothing to shift.
    if best in (0, 2 * SOUGHT) or not left[best] <= SHARED * motion:
        return None
    before, least, after = left[best - 1 : best + 2]
    curvature = before - 2.0 * least + after
    windows = FOUND - abs(best - SOUGHT)
    if CORRELATED / 3.0 * least * 2.0 * HOP**2 > COARSE**2 * windows * curvature:
        return None
    return HOP * (best - SOUGHT + 0.5 * (before - after) / curvature)


def _scatter(values: FloatArray) -> float:
    """Returns the mean square of vectors (m, 3) about their mean; infinite where there are few."""
    if 2 * len(values) < FOUND:
        return np.inf
    return float(np.mean(np.sum(values**2, axis=1)) - np.sum(np.mean(values, axis=0) ** 2))


def _left(primary: UnitWindows, unit: UnitWindows, start: int, end: int) -> tuple[float, float] | None:
    """Returns the delay that is left in some windows and its sigma, s, or nothing where it does not show."""
    wanted, changed, whole = _rates(primary)
    given, change, known = _rates(unit)
    both = np.zeros(len(whole), dtype=bool)
    both[start:end] = (whole & known)[start:end]
    count = int(both.sum())
    if 2 * count < end - start:
        return None
    motion = wanted[both]
    apart, along = (given - wanted)[both], 0.5 * (changed + change)[both]
    explained = np.column_stack([motion, np.ones(count)]) / GYROSCOPE_SIGMA
    apart, along = _unexplained(explained, apart / GYROSCOPE_SIGMA, along / GYROSCOPE_SIGMA)
    square = GYROSCOPE_SIGMA**2 * float(np.sum(apart**2))
    if square > SHARED * np.sum((motion - motion.mean(axis=0)) ** 2):
        return None
    squares, product = max(float(np.sum(along**2)), 1e-6), float(np.sum(apart * along))
    left = max(float(np.sum(apart**2)) - product**2 / squares, 0.0)
    if squares < CLEAR * 0.75 * left / HOP**2:
        return None
    sigma = float(np.sqrt(CORRELATED * left / (3.0 * count * squares)))
    return (-product / squares, sigma) if sigma < SIGNIFICANT else None


def _unexplained(design: FloatArray, *values: FloatArray) -> tuple[FloatArray, ...]:
    """Returns what a matrix and a bias, each known beforehand, leave of values (m, 3) and of its prior.

    Without these, a turn of an axis looks like a delay in motion that goes round. Sums of squares and of
    products of what is left are those of least squares with the prior.
    """
    sigmas = np.array([*3 * [UNCALIBRATED.matrix], UNCALIBRATED.gyroscope_bias])
    rows = np.vstack([np.diag(1.0 / sigmas), design])
    across = np.linalg.qr(rows)[0]
    zeros = np.zeros((len(sigmas), 3))
    padded = [np.vstack([zeros, each]) for each in values]
    return tuple(each - across @ (across.T @ each) for each in padded)
