"""Readings (n, 3) looked at axis by axis.

numpy reduces rows of three one by one, which takes ten times as long.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tumble import _core
from tumble.foundation.recording import FloatArray

Mask = NDArray[np.bool_]


def largest_each(values: FloatArray) -> FloatArray:
    """Largest absolute value of each sample, (n,), of (n,) or (n, 3); n may be zero."""
    sizes: FloatArray = np.abs(values)
    return sizes if sizes.ndim == 1 else reduce(np.maximum, sizes.T)


def whole(readings: FloatArray) -> Mask:
    """Finds the samples of (n, 3) whose axes are all finite."""
    found: Mask = reduce(np.logical_and, np.isfinite(readings).T)
    return found


def whole_ones(readings: FloatArray) -> FloatArray:
    """Returns the samples of (n, 3) whose axes are all finite: the array itself where all are."""
    return readings if _core.largest(readings) < np.inf else readings[whole(readings)]


def change_axes(readings: FloatArray, shift: FloatArray | None, stretch: FloatArray | None) -> None:
    """Takes a shift (3,) off readings (n, 3), and multiplies them by a stretch (3,), in place."""
    for axis, column in enumerate(readings.T):
        if shift is not None:
            column -= shift[axis]
        if stretch is not None:
            column *= stretch[axis]


def gathered(columns: Sequence[NDArray[Any]]) -> FloatArray:
    """Puts three columns of n numbers together as (n, 3), a copy."""
    found = np.empty((len(columns[0]), 3))
    gather(found, 0, columns)
    return found


def gather(target: FloatArray, first: int, columns: Sequence[NDArray[Any]]) -> None:
    """Puts three columns of m numbers of any type into the rows of (n, 3) from the one of that number on."""
    _core.gather(target, first, *map(_doubles, columns))


def _doubles(numbers: NDArray[Any]) -> FloatArray:
    """Returns numbers as the processor adds them: the array itself, with any stride, where it holds such."""
    if numbers.dtype == np.float64 and numbers.flags.aligned:
        return numbers
    return np.array(numbers, np.float64)
