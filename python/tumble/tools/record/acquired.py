"""All samples of a session that runs, for procedures that look at them while they come."""

from __future__ import annotations

import math

import numpy as np

from tumble.foundation.recording import Chunk, Recording

FEWEST_KEPT = 1 << 14
"""Samples for which there is room from the beginning."""
CLOCK = "live"
"""Clock that stamps all units of a live set."""


class _Samples:
    """Samples of one unit, in arrays that grow; what was given of them stays as it was."""

    def __init__(self) -> None:
        self._count = 0
        self._time = np.empty(FEWEST_KEPT)
        self._triads = np.empty((2, FEWEST_KEPT, 3))

    def push(self, chunk: Chunk) -> None:
        end = self._count + len(chunk)
        if end > len(self._time):
            more = max(len(self._time), len(chunk))
            self._time = np.concatenate([self._time, np.empty(more)])
            self._triads = np.concatenate([self._triads, np.empty((2, more, 3))], axis=1)
        self._time[self._count : end] = chunk.time
        self._triads[0, self._count : end] = chunk.accelerometer
        self._triads[1, self._count : end] = chunk.gyroscope
        self._count = end

    def since(self, time: float) -> Chunk:
        first = int(np.searchsorted(self._time[: self._count], time))
        which = slice(first, self._count)
        return Chunk(self._time[which], self._triads[0, which], self._triads[1, which])


class Acquisition:
    """All samples of all units since the session began."""

    def __init__(self) -> None:
        self._units: dict[str, _Samples] = {}

    def push(self, name: str, chunk: Chunk) -> None:
        """Adds samples of a unit."""
        self._units.setdefault(name, _Samples()).push(chunk)

    def recordings(self) -> dict[str, Recording]:
        """Returns what there is now; what comes later is not in it."""
        return {name: _recording(name, unit.since(-math.inf)) for name, unit in self._units.items()}

    def since(self, name: str, time: float) -> Chunk:
        """Returns the samples of a unit from a time, s, on; none of one that has given none."""
        return self._units[name].since(time) if name in self._units else _Samples().since(time)

    def newest(self, name: str, seconds: float) -> Chunk:
        """Returns the last so many s of a unit that has given samples."""
        unit = self._units[name]
        return unit.since(float(unit.since(-math.inf).time[-1]) - seconds)


def _recording(name: str, chunk: Chunk) -> Recording:
    return Recording.from_arrays(name, chunk.time, chunk.accelerometer, chunk.gyroscope, clock=CLOCK)
