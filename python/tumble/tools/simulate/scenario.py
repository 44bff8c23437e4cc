"""Common parts of all scenarios: their error, and the bounds of their numbers."""

from __future__ import annotations

import math
from typing import TypeAlias

from tumble.foundation.errors import TumbleError

Vector: TypeAlias = tuple[float, float, float]

SLOWEST_RATE_HZ, FASTEST_RATE_HZ = 1.0, 10_000.0
STEEPEST_DEG = 60.0


class ScenarioError(TumbleError):
    """A recording was asked for that cannot be simulated."""


def is_finite(value: object) -> bool:
    """Returns whether all numbers of a field are finite; a field without numbers is."""
    if isinstance(value, (tuple, list)):
        return all(map(is_finite, value))
    return not isinstance(value, float) or math.isfinite(value)
