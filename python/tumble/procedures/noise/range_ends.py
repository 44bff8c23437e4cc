"""Readings piled up at one value that none exceeds: the end of a range cuts the noise off."""

from __future__ import annotations

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray

_SIDES = np.array([-1.0, 1.0])
_UNLIKELY = 1e-9
"""Chance of so many more readings at the outermost value than at the one inside of it, by noise."""
_NOTABLE = 1e-3
"""Share of the readings at the end of the range that takes 0.3 % off the variance of white noise."""


class RangeEnds:
    """Receives samples at rest, and counts those at the two outermost values of either side."""

    def __init__(self, channels: int) -> None:
        shape = (len(_SIDES), channels)
        self._values = np.full((2, *shape), -np.inf)
        self._counts = np.zeros((2, *shape))
        self._total = 0
        self._changes = np.zeros(channels)

    def push(self, values: FloatArray) -> None:
        """Adds (n, c) successive samples of one stretch."""
        self._total += len(values)
        self._changes += (np.diff(values, axis=0) ** 2).sum(axis=0)
        outward = _SIDES[:, None, None] * values.T
        for _ in range(2):
            outermost = outward.max(axis=2)
            here = outward == outermost[:, :, None]
            self._add(outermost, here.sum(axis=2).astype(float))
            outward = np.where(here, -np.inf, outward)

    def reached(self) -> list[int]:
        """Lists the channels whose noise the end of a range cuts off (docs/theory/noise.md, eq. 34c)."""
        scatter = np.sqrt(self._changes / (2.0 * max(self._total, 1)))
        with np.errstate(invalid="ignore"):
            # Where a step is coarser than the noise, one value has most readings wherever it lies.
            fine = self._values[0] - self._values[1] <= scatter
        at_end, beside = self._counts
        candidates = np.argwhere(fine & (at_end >= _NOTABLE * self._total) & (at_end > beside))
        return sorted(
            {
                channel
                for side, channel in candidates.tolist()
                if _chance(float(at_end[side, channel]), float(beside[side, channel])) < _UNLIKELY
            }
        )

    def _add(self, values: FloatArray, counts: FloatArray) -> None:
        """Keeps the two outermost of the values so far and (2, c) others."""
        known = [*zip(self._values, self._counts, strict=True)]
        for at, count in known:
            counts = np.where(values == at, counts + count, counts)
        others = [(at, np.where(at == values, 0.0, count)) for at, count in known]
        every = np.stack([values, *(np.where(at == values, -np.inf, at) for at, _ in others)])
        number = np.stack([counts, *(count for _, count in others)])
        order = np.argsort(-every, axis=0, kind="stable")[:2]
        self._values = np.take_along_axis(every, order, axis=0)
        self._counts = np.take_along_axis(number, order, axis=0)


def _chance(at_end: float, beside: float) -> float:
    """Chance that of two values as likely as one another the outer has so many more readings."""
    return _core.chi_square_tail((at_end - beside) ** 2 / (at_end + beside), 1.0)
