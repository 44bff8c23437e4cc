"""Readings that repeat for a while, of channels whose noise else moves them from sample to sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tumble import _core
from tumble.acquisition.imu import ChannelFault
from tumble.foundation.recording import Chunk, recorded_rows
from tumble.foundation.units import Triad
from tumble.logs.row_order import select


@dataclass(frozen=True, slots=True)
class Standstills:
    """Standstills of channels in successive samples."""

    frozen: tuple[tuple[int, int], ...]
    """First and last place of each stretch in which every channel repeated its reading."""
    stuck: tuple[ChannelFault, ...]
    """Channels that repeated one reading while others went on."""

    def moving(self, samples: Chunk) -> Chunk:
        """Returns the samples without the repetitions of stretches in which all stood still."""
        if not self.frozen:
            return samples
        return select(samples, self.kept(len(samples)))

    def kept(self, count: int) -> NDArray[np.bool_]:
        """(count,) true but for the repetitions of these stretches."""
        kept = np.ones(count, dtype=np.bool_)
        for first, last in self.frozen:
            kept[first + 1 : last + 1] = False
        return kept


def standstills(samples: Chunk, triads: Sequence[Triad]) -> Standstills:
    """Finds stretches longer than `FROZEN` in which channels that are fine enough repeat a reading exactly.

    Method: docs/theory/rounding.md.
    """
    time = np.ascontiguousarray(samples.time)
    frozen, stuck = _core.standstills(time, *recorded_rows(samples, triads))
    return Standstills(
        tuple(frozen),
        tuple(ChannelFault(channel, "stuck", value, first, last) for channel, value, first, last in stuck),
    )
