"""Intervals of proportions."""

from __future__ import annotations

from scipy.stats import binomtest

CONFIDENCE = 0.95


def wilson(count: int, of: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Returns the interval of Wilson (1927) of a proportion; 0 to 1 where nothing was tried."""
    if of == 0:
        return 0.0, 1.0
    low, high = binomtest(count, of).proportion_ci(confidence, "wilson")
    return float(low), float(high)
