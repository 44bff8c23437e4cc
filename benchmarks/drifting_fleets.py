"""Fleets of units whose parameter walks at random with a known q."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.laboratory.drift import Series


@dataclass(frozen=True)
class Fleet:
    """Measured series, and the true values before and after the last of them."""

    series: list[Series]
    last: FloatArray
    """(units,) true value at the last calibration."""
    q: float
    random: np.random.Generator

    def later(self, unit: int, years: float) -> float:
        """True value of a unit so long after its last calibration."""
        return float(self.last[unit]) + self.random.normal(0.0, np.sqrt(self.q * max(0.0, years)))


def fleet(units: int, calibrations: int, q: float, sigma: float, seed: int, *, common: float = 0.0) -> Fleet:
    """Simulate units that are calibrated about once a year; `common` is the 1-sigma of their reference."""
    random = np.random.default_rng(seed)
    series, last = [], []
    for _ in range(units):
        times = np.cumsum(random.uniform(0.5, 1.5, calibrations))
        steps = random.normal(0.0, np.sqrt(q * np.diff(times)))
        truth = random.normal(0.0, 3.0 * sigma) + np.concatenate([[0.0], np.cumsum(steps)])
        sigmas = sigma * random.uniform(0.5, 1.5, calibrations)
        offset = random.normal(0.0, common)
        values = truth + random.normal(0.0, sigmas) + offset
        series.append(Series(times, values, sigmas**2, common**2))
        last.append(truth[-1])
    return Fleet(series, np.array(last), q, random)
