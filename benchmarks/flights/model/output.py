"""Readings of the set: the mean of all sound units by their weights, with its variance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.flights.model.error import Errors, levers
from tumble.foundation.recording import FloatArray


def fused(
    reading: FloatArray,
    motion: FloatArray,
    errors: Errors,
    noise: FloatArray,
    active: NDArray[np.bool_],
) -> tuple[FloatArray, FloatArray]:
    """Returns readings of the set (b, 6) at the primary's place, and their variances (b, 6).

    Readings (b, n, 6) are corrected by the errors at the motion (b, 18) of the set. Each unit weighs by the
    inverse of its noise (b, n, 2) and of the variance of its errors; units that are not active weigh nothing.
    Without an active unit the variance is infinite.
    """
    lever = levers(motion[:, 9:12], motion[:, 12:])
    force = reading[..., :3] - errors.force_error(motion[:, None, :3], lever[:, None])
    rate = reading[..., 3:] - errors.rate_error(motion[:, None, 3:6])
    variance = np.concatenate(
        [
            noise[..., :1] + errors.force_variance(motion[:, :3], lever),
            np.repeat(noise[..., 1:] + errors.rate_variance(motion[:, 3:6])[..., None], 3, axis=-1),
        ],
        axis=-1,
    )
    weight = np.where(active[..., None], 1.0 / variance, 0.0)
    total = weight.sum(axis=1)
    value = np.sum(weight * np.concatenate([force, rate], axis=-1), axis=1)
    some = total > 0.0
    return (
        np.where(some, value / np.where(some, total, 1.0), np.nan),
        np.where(some, 1.0 / np.where(some, total, 1.0), np.inf),
    )
