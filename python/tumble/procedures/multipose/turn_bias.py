"""The gyroscope's bias in turns against that at rest: one that zeroes itself has two, or ends turns short.

Method: docs/theory/multipose.md, section 13.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray


@dataclass(frozen=True, slots=True)
class TurnBias:
    """Bias that turns show less that of rests."""

    difference: FloatArray
    """(3,) rad/s."""
    sigma: FloatArray
    """(3,) rad/s, 1-sigma, as turns scatter."""
    chance: float
    """Chance of a larger difference, were it zero."""
    contradicts: bool
    """True where turns and rests have two biases."""

    def sentence(self) -> str:
        """Names the difference and what makes one."""
        axis = int(np.argmax(np.abs(self.difference) / self.sigma))
        apart = (
            f"{1e3 * self.difference[axis]:+.2g} ± {1e3 * self.sigma[axis]:.1g} mrad/s about {'xyz'[axis]}"
        )
        return (
            f"the gyroscope reads otherwise in turns than at rest, by {apart}: it zeroes itself at rest, or "
            "has a dead band; its bias cannot be found from rests"
        )


@dataclass(frozen=True, slots=True)
class TurnLoss:
    """Angle that every turn loses, however far it goes."""

    angle: float
    """rad."""
    sigma: float
    """rad, 1-sigma, as turns scatter."""

    def sentence(self) -> str:
        """Names the angle, and the gyroscope that loses it."""
        angle, sigma = math.degrees(self.angle), math.degrees(self.sigma)
        return (
            f"the gyroscope loses {angle:.2g} ± {sigma:.1g} deg in every turn, however far it goes: it "
            "zeroes itself while it turns slowly, or has a dead band; turns do not show its scale"
        )
