"""Accelerometer and gyroscope that were logged apart, brought together by the time of each reading."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS, Triad
from tumble.logs.track import CHUNK_SAMPLES, RawSamples

CLOSE = 0.01
"""s between two readings that stand in one sample, where both triads are read more often than that."""
USABLE_RATE = 20.0
"""Hz: readings that come more rarely belong to different motions."""


@dataclass(slots=True)
class TriadSamples:
    """Successive readings of one triad."""

    triad: Triad
    time: FloatArray
    """(n,) s."""
    readings: FloatArray
    """(n, 3) SI."""
    temperature: FloatArray | None = None
    """(n,) degC."""

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, rows: slice) -> TriadSamples:
        temperature = None if self.temperature is None else self.temperature[rows]
        return TriadSamples(self.triad, self.time[rows], self.readings[rows], temperature)

    def then(self, later: TriadSamples) -> TriadSamples:
        """Returns these and those that came later."""
        temperature = None
        if self.temperature is not None and later.temperature is not None:
            temperature = np.concatenate([self.temperature, later.temperature])
        readings = np.vstack([self.readings, later.readings])
        return TriadSamples(self.triad, np.concatenate([self.time, later.time]), readings, temperature)


class Thermometer:
    """Temperature that comes in messages of its own, more rarely than readings."""

    def __init__(self) -> None:
        self._known = np.empty((0, 2))

    def read(self, time: FloatArray, temperature: FloatArray) -> None:
        """Adds (n,) degC at (n,) s; all but the last of earlier ones are forgotten."""
        self._known = np.vstack([self._known[-1:], np.column_stack([time, temperature])])

    def at(self, time: FloatArray) -> FloatArray:
        """Returns degC at (n,) s, between what is known; NaN where nothing is."""
        if not len(self._known):
            return np.full(len(time), np.nan)
        return np.interp(time, self._known[:, 0], self._known[:, 1])


def paired(pieces: Iterable[TriadSamples], base: Triad, apart: float = CLOSE) -> Iterator[RawSamples]:
    """Returns one sample for each reading of `base`, with the reading of the other triad nearest in time.

    Pieces come in the order of the file, each triad's in the order of time. A reading of `base` without one
    of the other within `apart`, s, is left out.
    """
    held: dict[Triad, TriadSamples] = {}
    for piece in pieces:
        held[piece.triad] = held[piece.triad].then(piece) if piece.triad in held else piece
        if len(held) == len(TRIADS) and all(len(each) for each in held.values()):
            yield from _pair_until(held, base, apart, min(each.time[-1] for each in held.values()))
    if len(held) == len(TRIADS):
        yield from _pair_until(held, base, apart, np.inf)


def _pair_until(
    held: dict[Triad, TriadSamples], base: Triad, apart: float, end: float
) -> Iterator[RawSamples]:
    """Pair what can no longer get a nearer partner, and keep the rest."""
    other = next(triad for triad in TRIADS if triad != base)
    ready = int(np.searchsorted(held[base].time, end, side="right"))
    mine, theirs = held[base][:ready], held[other]
    if ready and len(theirs):
        nearest = _nearest(theirs.time, mine.time)
        close = np.abs(theirs.time[nearest] - mine.time) <= apart
        if close.any():
            yield from _pieces(_sample(mine, theirs, close, nearest, base))
        held[other] = theirs[max(int(np.searchsorted(theirs.time, mine.time[-1], side="right")) - 1, 0) :]
    held[base] = held[base][ready:]


def _nearest(times: FloatArray, wanted: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Returns, for each wanted time, which of the sorted (m,) times is nearest."""
    after = np.clip(np.searchsorted(times, wanted), 1, max(len(times) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(times) - 1)
    return np.where(wanted - times[before] <= times[after] - wanted, before, after)


def _sample(
    mine: TriadSamples,
    theirs: TriadSamples,
    close: np.ndarray[tuple[int], np.dtype[np.bool_]],
    nearest: np.ndarray[tuple[int], np.dtype[np.intp]],
    base: Triad,
) -> RawSamples:
    own, fetched = mine.readings[close], theirs.readings[nearest[close]]
    force, rate = (own, fetched) if base == "accelerometer" else (fetched, own)
    temperature: FloatArray | None = None
    if mine.temperature is not None:
        temperature = mine.temperature[close]
    elif theirs.temperature is not None:
        temperature = theirs.temperature[nearest[close]]
    return RawSamples(mine.time[close], force, rate, temperature)


def _pieces(samples: RawSamples) -> Iterator[RawSamples]:
    assert samples.time is not None
    for start in range(0, len(samples), CHUNK_SAMPLES):
        rows = slice(start, start + CHUNK_SAMPLES)
        temperature = None if samples.temperature is None else samples.temperature[rows]
        yield RawSamples(
            samples.time[rows], samples.accelerometer[rows], samples.gyroscope[rows], temperature
        )
