"""Course of white noise and of levels over a log: noise that is not the same throughout is no one number."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tumble import _core
from tumble.foundation.recording import FloatArray

IntArray: TypeAlias = NDArray[np.intp]

_BLOCK = 256
"""Samples of a block."""
_PARTS = 16
"""Parts of a log that are compared."""
_UNLIKELY = 1e-9
"""Chance of a difference of the parts, by the scatter of blocks within them, below which noise changes."""
_NOTABLE = 1.1
"""Ratio of the noise of two parts that is worth a word."""
_LEVEL_PARTS = 8
"""Parts of a log whose changes of level are compared: a warm-up of an eighth of a log fills one."""
_UNLIKELY_DRIFT = 1e-5
"""Chance that one of the parts of a log that only has noise drifts so much more than the others, a channel.

Twice as much names twice as many sound logs, of six channels one in 8,000.
"""
_ALIKE = 1.5
"""Variance of Fisher's sum over that of independent octaves, for random walk in four octaves by simulation: 1
for white noise, 2 for random walk in six. Doubled, a drift has to be larger by a half to show."""
_UNLIKELY_BESIDE = 0.01
"""The same for a channel in a part in which another channel of the unit drifts; twice as much bounds a slow
term in vain in one of fifty channels of such logs."""


@dataclass(frozen=True, slots=True)
class NoiseChange:
    """White noise of a channel that is not the same in all parts of a log."""

    channel: int
    least: float
    """Standard deviation of a sample, SI, in the part where it is least, and where it is largest."""
    largest: float
    at: tuple[float, float]
    """Shares of the samples before the middle of the part of each."""


@dataclass(frozen=True, slots=True)
class LevelDrift:
    """Level of a channel that changes more in one part of a log than noise does in the others."""

    channel: int
    factor: float
    """Ratio of the changes of level there to those elsewhere."""
    at: tuple[float, float]
    """Shares of the samples before the begin and the end of the part."""


class NoiseCourse:
    """Receives samples at rest, and keeps the squares of their changes and their means, block by block."""

    def __init__(self) -> None:
        self._squares: list[FloatArray] = []
        self._levels: list[FloatArray] = []
        self._stretches: list[int] = []
        self._stretch = 0

    def push(self, values: FloatArray) -> None:
        """Adds (n, c) successive samples of one stretch."""
        squares = np.diff(values, axis=0) ** 2 / 2.0
        for start in range(0, len(squares) - _BLOCK + 1, _BLOCK):
            self._squares.append(squares[start : start + _BLOCK].mean(axis=0))
            self._levels.append(values[start : start + _BLOCK].mean(axis=0))
            self._stretches.append(self._stretch)

    def end_stretch(self) -> None:
        """Ends a stretch: no change of level spans its end."""
        self._stretch += 1

    def drifts(self) -> list[LevelDrift]:
        """Lists the channels whose level changes more in one part than in the others, beyond chance.

        Differences of neighbouring means, two by two, are independent normal numbers of one variance for
        white noise and random walk, and nearly so for flicker (noise.md, eq. 34d).
        """
        if len(self._levels) < 2 * _LEVEL_PARTS:
            return []
        of_octaves = [_apart(changes**2, place) for changes, place in self._changes()]
        if not of_octaves:
            return []
        ratios, chances = (np.array(each) for each in zip(*of_octaves, strict=True))
        joint = _joint(chances)
        drifts = _LEVEL_PARTS * joint < _UNLIKELY_DRIFT  # noise.md, eq. 34d
        # Warming is a cause that the channels of a unit share.
        shown = np.asarray(drifts.any(axis=1))
        drifts |= shown[:, None] & (shown.sum() * joint < _UNLIKELY_BESIDE)
        found = []
        for channel in np.flatnonzero(drifts.any(axis=0)).tolist():
            part = int(joint[:, channel].argmin())
            clearest = chances[:, part, channel].argmin()
            at = part / _LEVEL_PARTS, (part + 1) / _LEVEL_PARTS
            found.append(LevelDrift(channel, float(np.sqrt(ratios[clearest, part, channel])), at))
        return found

    def _changes(self) -> Iterator[tuple[FloatArray, IntArray]]:
        """Yields differences (n, c) of means of a block, of two, of four and so on, and their parts (n,)."""
        levels, stretches = np.array(self._levels), np.array(self._stretches)
        parts = np.arange(len(levels)) * _LEVEL_PARTS // len(levels)
        while len(levels) >= 2 * _LEVEL_PARTS:
            begins = np.flatnonzero(np.diff(stretches, prepend=-1))
            within = np.arange(len(levels)) - np.repeat(begins, np.diff(begins, append=len(levels)))
            first = np.flatnonzero(within[:-1] % 2 == 0)
            first = first[stretches[first] == stretches[first + 1]]
            if len(first) < _LEVEL_PARTS:
                return
            yield levels[first + 1] - levels[first], parts[first]
            levels = 0.5 * (levels[first] + levels[first + 1])
            stretches, parts = stretches[first], parts[first]

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


def _apart(squares: FloatArray, place: IntArray) -> tuple[FloatArray, FloatArray]:
    """Returns the ratio (p, c) of the mean square of each part to that of the others, and the chance of it.

    Args:
        squares: (n, c) squared changes of level.
        place: (n,) part that each is in; where one of them has none, its ratio is one.

    """
    ratios, chances = np.ones((2, _LEVEL_PARTS, squares.shape[1]))
    for part in range(_LEVEL_PARTS):
        inside = place == part
        here, others = int(inside.sum()), int((~inside).sum())
        if here and others:
            elsewhere = np.maximum(squares[~inside].mean(axis=0), 1e-300)
            ratios[part] = squares[inside].mean(axis=0) / elsewhere
            chances[part] = [_core.f_tail(float(ratio), here, others) for ratio in ratios[part]]
    return ratios, chances


def _joint(chances: FloatArray) -> FloatArray:
    """Returns the chance of all octaves (o, p, c) together, by Fisher's sum of their logarithms (p, c)."""
    sums = -2.0 * np.log(np.maximum(chances, 1e-300)).sum(axis=0) / _ALIKE
    freedom = 2.0 * len(chances) / _ALIKE
    joint = [[_core.chi_square_tail(float(each), freedom) for each in of_part] for of_part in sums]
    return np.array(joint)


def _middle(part: np.intp) -> float:
    return (float(part) + 0.5) / _PARTS
