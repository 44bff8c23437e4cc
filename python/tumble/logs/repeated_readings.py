"""Readings of a slower sensor that stand several times in a table of a faster one.

A board that samples an IMU at 200 Hz and a magnetometer at 20 Hz writes each reading of the magnetometer in
ten rows. A coarse sensor at rest repeats itself as well, but by chance: its runs have all lengths, from one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FloatArray

_FEWEST_RUNS = 20
_SINGLE_AT_MOST = 0.05
"""Share of runs of a single row, of a sensor that is at most half as fast as the rows."""
_ALIKE_AT_LEAST = 0.75
"""Share of runs about as long as the median, of a sensor with a rate of its own."""
_ABOUT = 0.2
"""Relative difference of lengths that are about the same; one row is always."""
_DOUBLE_AT_LEAST = 0.1
"""Share of runs of two rows, of a sensor somewhat slower than the rows."""
_BY_CHANCE = 0.1
"""Share of the runs of three rows that chance would make, below which chance is excluded."""
_FEWEST_BY_CHANCE = 10.0
"""Runs of three rows that chance would make, so that their absence excludes it."""


def firsts_of_runs(readings: FloatArray) -> NDArray[np.bool_] | None:
    """Returns the rows of (n, 3) that begin a run of equal readings, where a slower sensor made the runs.

    None where every row is taken for a reading of its own: where rows seldom repeat, where there are too few
    runs, and where the runs are those of a coarse sensor at rest, whose lengths follow chance.
    """
    if len(readings) < _FEWEST_RUNS:
        return None
    begins = np.ones(len(readings), dtype=np.bool_)
    begins[1:] = (readings[1:] != readings[:-1]).any(axis=1)
    # Neither the first run nor the last is known to be whole.
    lengths = np.diff(np.flatnonzero(begins))[1:]
    if len(lengths) < _FEWEST_RUNS:
        return None
    return begins if _is_slower(lengths) or _is_somewhat_slower(lengths) else None


def _is_slower(lengths: NDArray[np.intp]) -> bool:
    """Returns whether hardly a run is of one row, and most are of about one length."""
    median = float(np.median(lengths))
    alike = np.abs(lengths - median) <= max(1.0, _ABOUT * median)
    single = float(np.mean(lengths == 1))
    return single <= _SINGLE_AT_MOST and float(np.mean(alike)) >= _ALIKE_AT_LEAST


def _is_somewhat_slower(lengths: NDArray[np.intp]) -> bool:
    """Returns whether runs of two rows are frequent and those of three all but absent.

    A sensor that repeats a reading with probability p makes p of its runs two rows long or longer, and p^2
    three or longer; one of 60 to 90 % of the rate of the rows makes none of three.
    """
    repeated = float(np.mean(lengths >= 2))
    expected = repeated * repeated * len(lengths)
    longer = float(np.sum(lengths >= 3))
    return repeated >= _DOUBLE_AT_LEAST and expected >= _FEWEST_BY_CHANCE and longer <= _BY_CHANCE * expected
