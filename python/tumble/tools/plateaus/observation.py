"""A triad at one temperature, as the fit sees it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray

ELEMENTS = 12
"""Elements of [M row by row, b]."""
MATRIX, BIAS = slice(0, 9), slice(9, ELEMENTS)
_DEGENERATE = 1e-10
"""Share of the largest eigenvalue of a correlation below which a direction is none of its own."""


@dataclass(frozen=True, slots=True)
class Observation:
    """[M row by row, b] of a triad at a temperature, with its covariance."""

    temperature: float
    """degC."""
    leg: float
    """1 if the temperature rose from the session before, -1 if it fell, 0 where neither is known."""
    values: FloatArray
    """(12,)"""
    covariance: FloatArray
    """(12, 12); NaN for what the session did not show."""

    @property
    def shown(self) -> np.typing.NDArray[np.bool_]:
        """(12,) elements that the session showed."""
        return np.isfinite(np.diag(self.covariance))

    def whitening(self) -> FloatArray:
        """(m, 12) W with W C W^T = 1; directions without uncertainty, which are stated, are left out."""
        variances = np.diag(self.covariance)
        used = np.flatnonzero(self.shown & (variances > 0.0))
        sigma = np.sqrt(variances[used])
        correlation = self.covariance[np.ix_(used, used)] / np.outer(sigma, sigma)
        sizes, directions = np.linalg.eigh(correlation)
        own = sizes > _DEGENERATE * sizes[-1]
        found = np.zeros((int(own.sum()), ELEMENTS))
        found[:, used] = (directions[:, own] / np.sqrt(sizes[own])).T / sigma
        return found
