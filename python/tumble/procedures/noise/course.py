"""Course of white noise over a log: noise that grows or fades is no one number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray

_BLOCK = 256
"""Samples of a block."""
_PARTS = 16
"""Parts of a log that are compared."""
_CLEAR = 7.0
"""Sigmas of the slope over the parts, by their scatter about it, beyond which noise changes."""
_NOTABLE = 1.1
"""Ratio of the noise at the end to that at the beginning that is worth a word."""


@dataclass(frozen=True, slots=True)
class NoiseChange:
    """White noise of a channel that changes steadily over the log."""

    channel: int
    first: float
    last: float
    """Standard deviation of a sample at the beginning and at the end, SI."""


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
        """Lists the channels whose noise grows or fades from one end of the log to the other."""
        if len(self._squares) < 2 * _PARTS:
            return []
        parts = np.array([part.mean(axis=0) for part in np.array_split(np.array(self._squares), _PARTS)])
        if (parts <= 0.0).any():
            return []
        x = np.linspace(-0.5, 0.5, _PARTS)
        variance = np.log(parts)
        slope = x @ variance / (x @ x)
        left = variance - variance.mean(axis=0) - np.outer(x, slope)
        sigma = np.sqrt((left**2).sum(axis=0) / (_PARTS - 2) / (x @ x))
        ends = np.exp(0.5 * (variance.mean(axis=0) + np.outer([-0.5, 0.5], slope)))
        changed = (np.abs(slope) > _CLEAR * sigma) & (np.abs(slope) > 2.0 * np.log(_NOTABLE))
        return [
            NoiseChange(channel, float(ends[0, channel]), float(ends[1, channel]))
            for channel in np.flatnonzero(changed).tolist()
        ]
