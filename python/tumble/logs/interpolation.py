"""Readings of one stream, interpolated linearly to the times of another while both are read on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FloatArray

Block: TypeAlias = tuple[FloatArray, FloatArray]
"""(n,) s, increasing, and (n, k) readings at these times."""


@dataclass(slots=True)
class TimedReadings:
    """Readings of k channels, kept as long as times that are asked for need them."""

    blocks: Iterator[Block]
    longest: float = np.inf
    """Usual steps between two readings up to which a value between them is interpolated."""
    ended: bool = False
    _time: FloatArray = field(default_factory=lambda: np.empty(0))
    _values: FloatArray | None = None
    _step: float = np.nan
    """s, the usual one."""

    @property
    def begin(self) -> float | None:
        """Time of the first reading that is kept, s; `None` where there is none."""
        return float(self._time[0]) if len(self._time) else None

    def read_on(self) -> None:
        """Reads another block, unless the stream has ended."""
        block = next(self.blocks, None)
        if block is None:
            self.ended = True
            return
        time, values = block
        self._values = values if self._values is None else np.concatenate([self._values, values])
        self._time = np.concatenate([self._time, time])
        if np.isnan(self._step) and len(self._time) > 1:
            self._step = float(np.median(np.diff(self._time)))

    def read_to(self, time: float) -> None:
        """Reads on until a reading at `time` or later, or the end."""
        while not self.ended and not (len(self._time) and self._time[-1] >= time):
            self.read_on()

    def spans(self, times: FloatArray) -> NDArray[np.bool_]:
        """Returns for each of (n,) times whether it lies between two readings."""
        if not len(self._time):
            return np.zeros(len(times), dtype=np.bool_)
        inside: NDArray[np.bool_] = (times >= self._time[0]) & (times <= self._time[-1])
        return inside

    def at(self, times: FloatArray) -> FloatArray:
        """Returns (n, k) readings at (n,) times; NaN where there is none close enough before or after."""
        if self._values is None or not len(self._time):
            return np.full((len(times), 1), np.nan)
        known = np.column_stack(
            [np.interp(times, self._time, channel, left=np.nan, right=np.nan) for channel in self._values.T]
        )
        after = np.clip(np.searchsorted(self._time, times), 0, len(self._time) - 1)
        before = np.maximum(np.searchsorted(self._time, times, side="right") - 1, 0)
        known[self._time[after] - self._time[before] > self.longest * self._step] = np.nan
        return known

    def forget(self, time: float) -> None:
        """Drops readings before the last one at or before `time`."""
        kept = max(int(np.searchsorted(self._time, time, side="right")) - 1, 0)
        self._time = self._time[kept:]
        self._values = None if self._values is None else self._values[kept:]
