"""The live source of a guided spin: it ends when the run is stopped, and knows how the robot stands."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.foundation.timing import TimeWatch
from tumble.live import LiveChunk, Source
from tumble.live.wrapped import WrappedSource

SMOOTHED = 0.1
"""s over which specific force is averaged for the attitude that is shown."""


class GuidedSource(WrappedSource):
    """Gives what a source gives under the name of the unit, until `stop`."""

    def __init__(self, source: Source, name: str) -> None:
        super().__init__(source)
        self.name = name
        self.is_stopped = False
        self._timing = TimeWatch()
        self._force: FloatArray | None = None

    def __iter__(self) -> Iterator[LiveChunk]:
        for chunk in self._source:
            if self.is_stopped:
                return
            if len(chunk):
                self._look(chunk)
            yield chunk

    @property
    def rate(self) -> float:
        """Returns the rate of the samples, Hz; NaN before it is known."""
        return 1.0 / self._timing.interval

    @property
    def elapsed(self) -> float:
        """Returns the time that the samples span, s."""
        return self._timing.end - self._timing.start if self._timing.samples else 0.0

    @property
    def missing(self) -> int:
        """Returns the number of samples that would fill the gaps in their times."""
        return self._timing.missing

    @property
    def samples(self) -> int:
        """Returns the number of samples that came."""
        return self._timing.samples

    @property
    def up(self) -> FloatArray | None:
        """Returns (3,) unit vector, case frame: what points up; None before the first sample."""
        if self._force is None:
            return None
        up: FloatArray = self._force / np.linalg.norm(self._force)
        return up

    def _look(self, chunk: LiveChunk) -> None:
        self._timing.push(chunk.time)
        newest = chunk.accelerometer.mean(axis=0)
        lasted = len(chunk) * self._timing.interval
        share = 1.0 if self._force is None or math.isnan(lasted) else 1.0 - math.exp(-lasted / SMOOTHED)
        before = newest if self._force is None else self._force
        self._force = before + share * (newest - before)


def floor_from_case(up: FloatArray, heading: float) -> tuple[float, float, float, float]:
    """Returns the rotation of a case in which `up` (3,) points up, turned by `heading`, rad, seen from above.

    A quaternion w, x, y, z: the shortest rotation that brings `up` to the vertical, then the heading.
    """
    x, y, z = map(float, up)
    w = math.sqrt(max(0.0, 0.5 * (1.0 + z)))
    # Upside down, any horizontal axis will do.
    tilt = (w, 0.5 * y / w, -0.5 * x / w, 0.0) if w > 1e-6 else (0.0, 1.0, 0.0, 0.0)
    cos, sin = math.cos(0.5 * heading), math.sin(0.5 * heading)
    a, b, c, d = tilt
    return cos * a - sin * d, cos * b - sin * c, cos * c + sin * b, cos * d + sin * a
