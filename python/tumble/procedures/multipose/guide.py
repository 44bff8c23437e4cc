"""Which orientation to ask for next, and how many were shown, while a unit is held and turned by hand."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.poses.by_hand import natural
from tumble.procedures.multipose.result import MultiposeResult

HELD = 4.0
"""s at rest in each orientation if nothing is stated."""


@dataclass(slots=True)
class OrientationGuide:
    """Counts rests as they come, and asks for the orientation that would show most."""

    wanted_seconds: float = HELD
    forces: list[FloatArray] = field(default_factory=list)
    """(3,) m/s^2 of each rest that was long enough."""
    wanted: FloatArray | None = None
    """(3,) unit vector, case frame: what is to point up next; None for however it lies."""
    _counted: bool = False
    """Indicates whether the present rest is among `forces`."""

    def motion(self) -> None:
        """Reports to the guide that the unit moves."""
        self._counted = False

    def rest(self, force: FloatArray, seconds: float) -> bool:
        """Adds the present rest, mean specific force (3,) m/s^2; returns whether it is now long enough."""
        if not self.is_enough(seconds):
            return False
        self.forces.append(force)
        self._counted = True
        self.wanted = farthest(natural(), self.forces)
        return True

    def is_enough(self, seconds: float) -> bool:
        """Returns whether a present rest of this duration would now count."""
        return not self._counted and seconds >= self.wanted_seconds

    def follow(self, result: MultiposeResult | None) -> None:
        """Asks for what the calibration so far lacks most."""
        if result is not None and result.next_orientation is not None:
            self.wanted = result.next_orientation.up

    @property
    def orientations(self) -> int:
        """Number of distinct orientations so far."""
        return 1 + max(_core.multipose_directions(np.array(self.forces))) if self.forces else 0

    @property
    def rests(self) -> int:
        """Number of rests so far."""
        return len(self.forces)


def farthest(candidates: FloatArray, shown: list[FloatArray]) -> FloatArray:
    """Returns of candidates (n, 3) that which is farthest from all that were shown, the first of several."""
    ups = np.array(shown)
    ups /= np.linalg.norm(ups, axis=1)[:, np.newaxis]
    nearest = (candidates @ ups.T).max(axis=1)
    found: FloatArray = candidates[int(np.argmin(np.round(nearest, 2)))]
    return found
