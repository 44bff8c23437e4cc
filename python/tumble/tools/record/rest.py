"""The rest of a unit that is under way, as it is looked at now and then while its samples come."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from tumble.foundation.recording import Chunk, FloatArray
from tumble.tools.record.procedure import SHORTEST_REST

MOVED = math.cos(math.radians(2.0))
"""Cosine of the angle between two looks at a rest, from which it is not the same one."""


@dataclass(slots=True)
class RestUnderWay:
    """Receives the newest samples while the unit rests, and reports of motion."""

    force: FloatArray = field(default_factory=lambda: np.zeros(3))
    """(3,) m/s^2, mean of the last look."""
    rate: FloatArray = field(default_factory=lambda: np.zeros(3))
    """(3,) rad/s."""
    since: float | None = None
    """s of the samples; None while it moves."""

    def end(self) -> bool:
        """Reports motion; returns whether a rest ended by it."""
        ended, self.since = self.since is not None, None
        return ended

    def look(self, newest: Chunk, now: float) -> bool:
        """Adds the newest `SHORTEST_REST` of samples; returns whether another rest ended before them.

        Samples that were held up come at once, with a motion among them.
        """
        force = newest.accelerometer.mean(axis=0)
        alike = float(force @ self.force) >= MOVED * np.linalg.norm(force) * np.linalg.norm(self.force)
        ended = self.since is not None and not alike
        if self.since is None or ended:
            self.since = now - SHORTEST_REST
        self.force, self.rate = force, newest.gyroscope.mean(axis=0)
        return ended

    def seconds(self, now: float) -> float:
        """Returns its length, s; 0 while it moves."""
        return 0.0 if self.since is None else now - self.since
