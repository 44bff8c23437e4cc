"""Statements of a user about units: how each is mounted, where it sits, and how far it measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.flights.model.error import ARM, Errors, nothing_known
from benchmarks.redundancy_set import Samples
from tumble.foundation.recording import FloatArray

ARM_SIGMA = 0.005
"""m of a place that is stated."""
SATURATED = 0.999
"""Share of its range from which on a reading is none."""


@dataclass(frozen=True, slots=True)
class Statement:
    """A unit as it is described."""

    turn: FloatArray = field(default_factory=lambda: np.eye(3))
    """(3, 3) sensor from primary."""
    arm: FloatArray | None = None
    """(3,) m from the primary, in its axes."""
    force_range: float = np.inf
    """m/s^2."""
    rate_range: float = np.inf
    """rad/s."""

    def turned(self, samples: Samples) -> Samples:
        """Returns samples in the axes of the primary, not a number at the end of their range."""
        readings = []
        for given, limit in (
            (samples.specific_force, self.force_range),
            (samples.angular_rate, self.rate_range),
        ):
            within = np.abs(given).max(axis=1, keepdims=True) < SATURATED * limit
            readings.append(np.where(within, given @ self.turn, np.nan))
        return replace(samples, specific_force=readings[0], angular_rate=readings[1])


def first_errors(statements: Sequence[Statement], runs: int = 1) -> Errors:
    """Returns the errors of units of which nothing is known but what is stated."""
    errors = nothing_known(runs, len(statements))
    for unit, each in enumerate(statements):
        if unit and each.arm is not None:
            errors.force[:, unit, ARM] = each.arm
            errors.force_covariance[:, unit, ARM, ARM] = ARM_SIGMA**2 * np.eye(3)
    return errors
