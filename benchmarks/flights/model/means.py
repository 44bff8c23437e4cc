"""Leaky means over seven scales of time: one number a scale, in the place of a ring of windows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FloatArray

SCALES = (1, 2, 4, 10, 20, 40, 100)
"""Windows over which a boxcar has as much white noise as the mean of the scale."""


class LeakyMeans:
    """Means of what is whole; their weight is the share of the past that was."""

    def __init__(self, shape: tuple[int, ...], values: int, scales: Sequence[int] = SCALES) -> None:
        """Begins without weight: means of `values` numbers for each place of `shape`."""
        self.shares = 2.0 / (np.array(scales) + 1.0)
        self.weight = np.zeros((len(scales), *shape))
        self.total = np.zeros((len(scales), *shape, values))

    def take(
        self, values: FloatArray, whole: NDArray[np.bool_], counts: NDArray[np.bool_] | None = None
    ) -> None:
        """Takes values (..., k), nothing where not whole (...); those that do not count pass."""
        share = self.shares.reshape(-1, *[1] * whole.ndim)
        if counts is not None:
            share = share * counts
        known = np.where(whole[..., None], values, 0.0)
        self.weight += share * (whole - self.weight)
        self.total += share[..., None] * (known - self.total)

    def forget(self, chosen: NDArray[np.bool_]) -> None:
        """Begins anew for the places that are chosen (...)."""
        self.weight = np.where(chosen, 0.0, self.weight)
        self.total = np.where(chosen[..., None], 0.0, self.total)

    def mean(self) -> FloatArray:
        """Returns the means (s, ..., k), 0 without weight."""
        return np.asarray(self.total / np.maximum(self.weight, 1e-12)[..., None])
