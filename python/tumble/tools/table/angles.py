"""Angles between the command line, which counts in deg, and tables, which count in rad."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tumble.foundation.recording import FloatArray


def in_radians(numbers: Sequence[float]) -> FloatArray:
    """Returns (n,) rad, or rad/s, of numbers in deg."""
    return np.radians(np.array(numbers, dtype=np.float64))


def in_degrees(angles: FloatArray) -> list[float | None]:
    """Returns deg of (n,) rad; None where it is NaN."""
    return [None if math.isnan(angle) else angle for angle in np.degrees(angles).tolist()]
