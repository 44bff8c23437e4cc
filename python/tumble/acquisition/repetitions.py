"""Readings that stood still: those of no sensor with noise do, unless it, or what sends, was frozen."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from tumble import _core
from tumble.foundation.recording import Chunk, FloatArray

FROZEN: Final = _core.FROZEN
"""s for which all readings may stand still, as long as samples may be missing."""
COARSE = 0.05
"""Share of readings that are repeated, above which a sensor is too coarse to show that it froze."""


def is_coarse(readings: int, repeated: int) -> bool:
    """Returns whether so many distinct readings repeat that a repetition is no evidence."""
    return repeated > COARSE * readings


def repeats(readings: FloatArray) -> NDArray[np.bool_]:
    """Returns for each of (n, k) readings but the first whether it repeats the one before."""
    same: NDArray[np.bool_] = (readings[1:] == readings[:-1]).all(axis=1)
    return same


def repetitions(same: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Returns the first and last index (k, 2) of each run of equal readings, by what `repeats` returns."""
    # Where readings begin to stand still, and where they end to, in turn.
    return np.flatnonzero(np.diff(same, prepend=False, append=False)).reshape(-1, 2)


def frozen_stretches(samples: Chunk) -> list[tuple[int, int]]:
    """First and last index of each stretch in which all channels stood still for longer than `FROZEN`.

    There is none of a sensor so coarse that readings often repeat themselves.
    """
    same = repeats(samples.accelerometer) & repeats(samples.gyroscope)
    first, last = repetitions(same).T
    lasting = samples.time[last] - samples.time[first] > FROZEN
    if is_coarse(len(samples) - int(same.sum()), int((~lasting).sum())):
        return []
    return list(zip(first[lasting].tolist(), last[lasting].tolist(), strict=True))
