"""Which orientation to ask for next, and how many were shown, while a unit is held and turned by hand."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.poses.by_hand import natural
from tumble.procedures.magnetometer.result import NextField
from tumble.procedures.multipose.result import MultiposeResult, NextOrientation

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
    wanted_field: FloatArray | None = None
    """(3,) unit vector, case frame: where the magnetic field is to point there; None for any heading."""
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
        self.wanted, self.wanted_field = farthest(natural(), self.forces), None
        return True

    def is_enough(self, seconds: float) -> bool:
        """Returns whether a present rest of this duration would now count."""
        return not self._counted and seconds >= self.wanted_seconds

    def follow(self, result: MultiposeResult | None) -> None:
        """Asks for what the calibration so far lacks most, of accelerometer or magnetometer."""
        if result is None:
            return
        orientation = result.next_orientation
        field = None if result.magnetometer is None else result.magnetometer.next_field
        if field is not None and field.up is not None and _left(field) < _left(orientation):
            self.wanted, self.wanted_field = field.up, field.field
        elif orientation is not None:
            self.wanted, self.wanted_field = orientation.up, None

    @property
    def orientations(self) -> int:
        """Number of distinct orientations so far."""
        return 1 + max(_core.multipose_directions(np.array(self.forces))) if self.forces else 0

    @property
    def rests(self) -> int:
        """Number of rests so far."""
        return len(self.forces)


def _left(advised: NextOrientation | NextField | None) -> float:
    """Returns the share of the largest sigma that is left with an orientation more."""
    return 1.0 if advised is None else advised.after / advised.before


def farthest(candidates: FloatArray, shown: list[FloatArray]) -> FloatArray:
    """Returns of candidates (n, 3) that which is farthest from all that were shown, the first of several."""
    ups = np.array(shown)
    ups /= np.linalg.norm(ups, axis=1)[:, np.newaxis]
    nearest = (candidates @ ups.T).max(axis=1)
    found: FloatArray = candidates[int(np.argmin(np.round(nearest, 2)))]
    return found
