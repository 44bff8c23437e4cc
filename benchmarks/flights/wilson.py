"""Intervals of proportions."""

from __future__ import annotations

from scipy.stats import norm

CONFIDENCE = 0.95


def wilson(count: int, of: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Returns the interval of Wilson (1927) of a proportion; 0 to 1 where nothing was tried."""
    if of == 0:
        return 0.0, 1.0
    sigmas = float(norm.ppf(0.5 + 0.5 * confidence))
    share, spread = count / of, sigmas**2 / of
    middle = (share + 0.5 * spread) / (1.0 + spread)
    half = (spread * (share * (1.0 - share) + 0.25 * spread)) ** 0.5 / (1.0 + spread)
    return max(0.0, middle - half), min(1.0, middle + half)
