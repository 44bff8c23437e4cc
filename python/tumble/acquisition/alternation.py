"""Samples of two or more units that take turns in one log, as if they were of one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.units import Triad

MOST_UNITS = 4
"""Units that may take turns."""
_BLOCK = 256
"""Samples over which turns are taken; a lost one moves those behind it."""
_MOST_BLOCKS = 400
"""Blocks that are looked at: three minutes at 500 Hz."""
_FEWEST_BLOCKS = 4
_SIGMAS = 10.0
"""Median over blocks of a difference of medians, in its sigmas: at most 2.4 in two channels of 170 logs,
6.4 where a line lies at a share of the sample rate, 100 where two units with usual biases take turns."""
_ORDINALS = {2: "second", 3: "third", 4: "fourth"}
_FEWEST_CHANNELS = 2
"""A line at a share of the sample rate may be in one channel."""
_OF_NORMAL = 0.6745
"""Median of the magnitude of a normal variable, sigmas."""
_OF_MEDIANS = float(np.sqrt(np.pi / 2.0))
"""Standard error of a median over that of a mean, of normal variables."""


class AlternationWatch:
    """Compares the medians of every second, third and fourth sample, less the motion, block by block.

    The unit of a sample differs from those beside it by its own bias, and so alternates, while motion goes
    on. The noise of a sample is that of the difference to the next of the same turn.
    """

    def __init__(self, triads: Sequence[Triad]) -> None:
        self._triads = triads
        self._ratios: dict[int, list[FloatArray]] = {units: [] for units in range(2, MOST_UNITS + 1)}

    def push(self, chunk: Chunk) -> None:
        """Takes in successive samples."""
        blocks = len(chunk) // _BLOCK
        if not blocks or len(self._ratios[2]) >= _MOST_BLOCKS:
            return
        rows = slice(0, min(blocks, _MOST_BLOCKS) * _BLOCK)
        values = np.column_stack([getattr(chunk, triad)[rows] for triad in self._triads])
        whole = values.reshape(-1, _BLOCK, values.shape[1])
        whole = whole[np.isfinite(whole).all(axis=(1, 2))]
        for units, ratios in self._ratios.items():
            ratios.extend(_ratio(whole, units))

    def units(self) -> int:
        """Returns how many units take turns; 1 where nothing shows that it is more than one."""
        for units, ratios in self._ratios.items():
            if len(ratios) >= _FEWEST_BLOCKS:
                usual = np.median(ratios, axis=0)
                if int((usual > _SIGMAS).sum()) >= _FEWEST_CHANNELS:
                    return units
        return 1

    def refuse(self, name: str) -> None:
        """Raises `ProcedureError` where samples of several units take turns."""
        if (units := self.units()) > 1:
            raise ProcedureError(
                f"samples of {units} units take turns: the median of every {_ORDINALS[units]} sample differs "
                "from that of the others by far more than noise; log each unit by itself, or by a label",
                about=name,
            )


def _ratio(blocks: FloatArray, units: int) -> FloatArray:
    """(blocks, channels) largest difference between the median of a turn and that of all, in its sigmas."""
    weights = np.ones(units) / units
    # The mean of samples around each, which shares its motion: an even number of them halves the ends.
    if units % 2 == 0:
        weights = np.convolve(weights, [0.5, 0.5])
    half, count = len(weights) // 2, blocks.shape[1] - len(weights) + 1
    around = sum(weight * blocks[:, k : k + count] for k, weight in enumerate(weights))
    beside = blocks[:, half : half + count] - around
    whole = count // units * units
    turns = beside[:, :whole].reshape(len(blocks), -1, units, blocks.shape[2])
    # Medians, as a motion that begins at once is beside all that is around it.
    middles = np.median(turns, axis=1)
    noise = np.median(np.abs(blocks[:, units:] - blocks[:, :-units]), axis=1) / (_OF_NORMAL * np.sqrt(2.0))
    sigma = _OF_MEDIANS * noise * np.sqrt(units / whole)
    largest = np.abs(middles - middles.mean(axis=1, keepdims=True)).max(axis=1)
    ratio: FloatArray = np.divide(largest, sigma, out=np.zeros_like(largest), where=sigma > 0.0)
    return ratio
