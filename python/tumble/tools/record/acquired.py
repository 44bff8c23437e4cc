"""All samples of a session that runs, for procedures that look at them while they come."""

from __future__ import annotations

import math

import numpy as np

from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk, FloatArray, Recording

FEWEST_KEPT = 1 << 14
"""Samples for which there is room from the beginning."""
CLOCK = "live"
"""Clock that stamps all units of a live set."""


class _Samples:
    """Samples of one unit, in arrays that grow; what was given of them stays as it was.

    Readings of a magnetometer are those of chunks that have a `field`.
    """

    def __init__(self) -> None:
        self._count = 0
        self._time = np.empty(FEWEST_KEPT)
        self._triads = np.empty((2, FEWEST_KEPT, 3))
        self._field: FloatArray | None = None
        """(n, 3) uT, NaN in rows without a reading; None before the first."""

    def push(self, chunk: Chunk) -> None:
        end = self._count + len(chunk)
        if end > len(self._time):
            more = max(len(self._time), len(chunk))
            self._time = np.concatenate([self._time, np.empty(more)])
            self._triads = np.concatenate([self._triads, np.empty((2, more, 3))], axis=1)
            if self._field is not None:
                self._field = np.concatenate([self._field, np.full((more, 3), np.nan)])
        self._time[self._count : end] = chunk.time
        self._triads[0, self._count : end] = chunk.accelerometer
        self._triads[1, self._count : end] = chunk.gyroscope
        if (field := getattr(chunk, "field", None)) is not None:
            if self._field is None:
                self._field = np.full((len(self._time), 3), np.nan)
            self._field[self._count : end] = field
        self._count = end

    def since(self, time: float) -> Chunk:
        first = int(np.searchsorted(self._time[: self._count], time))
        which = slice(first, self._count)
        return Chunk(self._time[which], self._triads[0, which], self._triads[1, which])

    def magnetic(self, time: float) -> MagneticTrack | None:
        first = int(np.searchsorted(self._time[: self._count], time))
        if self._field is None:
            return None
        field = self._field[first : self._count]
        rows = np.isfinite(field).all(axis=1)
        return MagneticTrack(self._time[first : self._count][rows], field[rows])


class Acquisition:
    """All samples of all units since the session began."""

    def __init__(self) -> None:
        self._units: dict[str, _Samples] = {}

    def push(self, name: str, chunk: Chunk) -> None:
        """Adds samples of a unit."""
        self._units.setdefault(name, _Samples()).push(chunk)

    def recordings(self) -> dict[str, Recording]:
        """Returns what there is now; what comes later is not in it."""
        return {name: _recording(name, unit) for name, unit in self._units.items()}

    def since(self, name: str, time: float) -> Chunk:
        """Returns the samples of a unit from a time, s, on; none of one that has given none."""
        return self._units[name].since(time) if name in self._units else _Samples().since(time)

    def magnetic(self, name: str, since: float = -math.inf) -> MagneticTrack | None:
        """Returns the readings of a unit's magnetometer from a time, s, on; None where none ever came."""
        return self._units[name].magnetic(since) if name in self._units else None

    def newest(self, name: str, seconds: float) -> Chunk:
        """Returns the last so many s of a unit that has given samples."""
        unit = self._units[name]
        return unit.since(float(unit.since(-math.inf).time[-1]) - seconds)


def _recording(name: str, unit: _Samples) -> Recording:
    chunk = unit.since(-math.inf)
    return Recording.from_arrays(
        name,
        chunk.time,
        chunk.accelerometer,
        chunk.gyroscope,
        clock=CLOCK,
        magnetic=unit.magnetic(-math.inf),
    )
