"""Readings of a magnetometer in the rows of an IMU, as tables hold them: each once, beside its own time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from dataclasses import field as stated

import numpy as np

from tumble.foundation.magnetic import LoadUnit, MagneticTrack
from tumble.foundation.recording import Chunk, FloatArray

OWN_TIME = "magnetic_time"
"""Column of the times of a magnetometer, s of the clock of the rows."""
LOAD_COLUMN: Mapping[LoadUnit, str] = {"A": "current", "1": "throttle"}


@dataclass(frozen=True, slots=True)
class ChunkWithField(Chunk):
    """Samples with the columns of a magnetometer, NaN in rows without a reading."""

    mx: FloatArray = stated(default_factory=lambda: np.empty(0), kw_only=True)
    my: FloatArray = stated(default_factory=lambda: np.empty(0), kw_only=True)
    mz: FloatArray = stated(default_factory=lambda: np.empty(0), kw_only=True)
    """(n,) uT each."""
    magnetic_time: FloatArray = stated(default_factory=lambda: np.empty(0), kw_only=True)
    """(n,) s."""
    current: FloatArray = stated(default_factory=lambda: np.empty(0), kw_only=True)
    """(n,) A."""
    throttle: FloatArray = stated(default_factory=lambda: np.empty(0), kw_only=True)
    """(n,) from 0 to 1."""

    @property
    def field(self) -> FloatArray:
        """(n, 3) uT."""
        return np.column_stack([self.mx, self.my, self.mz])


class MagneticRows:
    """Puts each reading in the first free row at its time or after it."""

    def __init__(self, track: MagneticTrack) -> None:
        self._track = track
        self._given = 0
        """Readings that have a row."""
        load = () if track.current is None else (LOAD_COLUMN[track.current_unit],)
        self.columns: tuple[str, ...] = ("mx", "my", "mz", OWN_TIME, *load)
        """Names of the columns that chunks get."""

    @property
    def left(self) -> int:
        """Number of readings without a row yet: in the end those after the last row, or faster than rows."""
        return len(self._track) - self._given

    def beside(self, chunk: Chunk) -> ChunkWithField:
        """Returns the next samples of the IMU with the readings whose time has come."""
        track, first = self._track, self._given
        end = int(np.searchsorted(track.time, chunk.time[-1], side="right")) if len(chunk) else first
        wanted = np.searchsorted(chunk.time, track.time[first:end])
        # Row k of those given is at least k rows behind the first, so that no row is given twice.
        order = np.arange(len(wanted))
        rows = np.maximum.accumulate(wanted - order) + order if len(wanted) else wanted
        rows = rows[rows < len(chunk)]
        which = slice(first, first + len(rows))
        self._given += len(rows)

        def column(values: FloatArray) -> FloatArray:
            found = np.full(len(chunk), np.nan)
            found[rows] = values[which]
            return found

        x, y, z = (column(axis) for axis in track.field.T)
        load = {} if track.current is None else {LOAD_COLUMN[track.current_unit]: column(track.current)}
        own = {each.name: getattr(chunk, each.name) for each in fields(Chunk)}
        return ChunkWithField(**own, mx=x, my=y, mz=z, magnetic_time=column(track.time), **load)
