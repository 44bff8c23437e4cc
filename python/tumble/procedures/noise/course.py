"""Course of white noise over a log: noise that is not the same throughout is no one number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray

_BLOCK = 256
"""Samples of a block."""
_PARTS = 16
"""Parts of a log that are compared."""
_UNLIKELY = 1e-9
"""Chance of a difference of the parts, by the scatter of blocks within them, below which noise changes."""
_NOTABLE = 1.1
"""Ratio of the noise of two parts that is worth a word."""


@dataclass(frozen=True, slots=True)
class NoiseChange:
    """White noise of a channel that is not the same in all parts of a log."""

    channel: int
    least: float
    """Standard deviation of a sample, SI, in the part where it is least, and where it is largest."""
    largest: float
    at: tuple[float, float]
    """Shares of the samples before the middle of the part of each."""


class NoiseCourse:
    """Receives samples at rest, and keeps the squares of their changes, block by block."""

    def __init__(self) -> None:
        self._squares: list[FloatArray] = []

    def push(self, values: FloatArray) -> None:
        """Adds (n, c) successive samples of one stretch."""
        squares = np.diff(values, axis=0) ** 2 / 2.0
        for start in range(0, len(squares) - _BLOCK + 1, _BLOCK):
            self._squares.append(squares[start : start + _BLOCK].mean(axis=0))

    def changes(self) -> list[NoiseChange]:
        """Lists the channels whose noise differs from part to part beyond the scatter within these."""
        if len(self._squares) < 2 * _PARTS:
            return []
        squares = np.array(self._squares)
        parts = np.array_split(squares, _PARTS)
        means = np.array([part.mean(axis=0) for part in parts])
        counts = np.array([len(part) for part in parts])[:, None]
        within = sum(((part - mean) ** 2).sum(axis=0) for part, mean in zip(parts, means, strict=True))
        scatter = np.asarray(within) / (len(squares) - _PARTS)
        chi_squares = (counts * (means - squares.mean(axis=0)) ** 2).sum(axis=0) / np.maximum(scatter, 1e-300)
        sizes = np.sqrt(means)
        changed = (sizes.max(axis=0) > _NOTABLE * sizes.min(axis=0)) & (scatter > 0.0)
        return [
            NoiseChange(
                channel,
                float(sizes[:, channel].min()),
                float(sizes[:, channel].max()),
                (_middle(sizes[:, channel].argmin()), _middle(sizes[:, channel].argmax())),
            )
            for channel in np.flatnonzero(changed).tolist()
            if _core.chi_square_tail(float(chi_squares[channel]), _PARTS - 1.0)
            < _UNLIKELY  # noise.md, eq. 34b
        ]


def _middle(part: np.intp) -> float:
    return (float(part) + 0.5) / _PARTS
