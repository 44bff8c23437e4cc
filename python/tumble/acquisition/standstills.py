"""Readings that repeat for a while, of channels whose noise else moves them from sample to sample."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tumble.acquisition.repetitions import FROZEN, repetitions
from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.units import Triad
from tumble.logs.row_order import select

_COARSE = 0.01
"""Share of changes that end a short repetition, above which a channel is too coarse to show a standstill."""
_FINE = 8.0
"""Ratio of the second differences of a channel to its smallest change above which noise makes them."""
_LOOK = 1 << 16
"""Readings that show the noise of a channel."""
_FEWEST = 10
"""Readings of a repetition that counts: a log of a few samples a second repeats one by chance."""
_FEWEST_CHANGES = 20
"""Changes of a channel without which nothing is known of its noise."""

_Run = tuple[int, int]
"""First and last index of equal readings."""


@dataclass(frozen=True, slots=True)
class Standstill:
    """A channel that repeated one reading while others went on."""

    channel: int
    """Place among the columns of the triads that were recorded."""
    value: float
    first: float
    last: float
    """s."""


@dataclass(frozen=True, slots=True)
class Standstills:
    """Standstills of channels in successive samples."""

    frozen: tuple[_Run, ...]
    """Stretches in which every channel repeated its reading."""
    stuck: tuple[Standstill, ...]

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

    A sensor that is coarse beside its noise repeats readings often, for short; what it repeats for long shows
    nothing. Neither does the end of a range, nor the zero of a gyroscope that shows rest as zero.
    """
    if len(samples) < _FEWEST_CHANGES:
        return Standstills((), ())
    # Long logs are held once: nothing here copies all channels.
    columns = [getattr(samples, triad)[:, axis] for triad in triads for axis in range(3)]
    all_same = np.ones(len(samples) - 1, dtype=np.bool_)
    lasting: dict[int, list[_Run]] = {}
    for channel, values in enumerate(columns):
        same = values[1:] == values[:-1]
        if same.all():
            continue
        all_same &= same
        if _is_fine(values[:_LOOK]) and (runs := _lasting(samples.time, same)) is not None:
            lasting[channel] = runs
    if not lasting:
        return Standstills((), ())
    frozen = _long_runs(samples.time, all_same)
    return Standstills(tuple(frozen), tuple(_stuck(samples.time, columns, lasting, frozen)))


def _is_fine(values: FloatArray) -> bool:
    """Returns whether the noise of (n,) readings is far above their smallest change, in motion or not.

    A gyroscope whose noise is below a step repeats nothing while its rate changes, and all at rest.
    """
    changes = np.diff(values)
    smallest = np.min(np.abs(changes), where=changes != 0.0, initial=np.inf)
    bends = np.abs(np.diff(changes))
    moving = bends[(changes[1:] != 0.0) & (changes[:-1] != 0.0)]
    return len(moving) > 0 and bool(np.median(moving) > _FINE * smallest)


def _is_long(time: FloatArray, runs: NDArray[np.intp]) -> NDArray[np.bool_]:
    lasts: NDArray[np.bool_] = time[runs[:, 1]] - time[runs[:, 0]] > FROZEN
    return lasts & (runs[:, 1] - runs[:, 0] >= _FEWEST)


def _long_runs(time: FloatArray, same: NDArray[np.bool_]) -> list[_Run]:
    runs = repetitions(same)
    return [(int(first), int(last)) for first, last in runs[_is_long(time, runs)]]


def _lasting(time: FloatArray, same: NDArray[np.bool_]) -> list[_Run] | None:
    """Lists the long repetitions of a channel; None where it is too coarse to show any."""
    runs = repetitions(same)
    long = _is_long(time, runs)
    readings = len(same) + 1 - int(same.sum())
    if readings < _FEWEST_CHANGES or (~long).sum() > _COARSE * readings:
        return None
    return [(int(first), int(last)) for first, last in runs[long]]


def _stuck(
    time: FloatArray, columns: Sequence[FloatArray], lasting: dict[int, list[_Run]], frozen: Sequence[_Run]
) -> Iterator[Standstill]:
    for channel, runs in lasting.items():
        readings = columns[channel]
        for first, last in runs:
            value = float(readings[first])
            in_all = any(begin <= last and first <= end for begin, end in frozen)
            if not in_all and value not in (0.0, readings.min(), readings.max()):
                yield Standstill(channel, value, float(time[first]), float(time[last]))
