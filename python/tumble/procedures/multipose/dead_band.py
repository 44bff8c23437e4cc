"""A dead band of a gyroscope: rates that it never reads between those at rest and those of turns.

Method: docs/theory/multipose.md, section 13.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DeadBand:
    """An axis whose readings near its bias are those at rest, whatever turns it."""

    axis: int
    half_width: float
    """rad/s from the bias."""

    def sentence(self) -> str:
        """Names the axis and the band."""
        return (
            f"the gyroscope has a dead band: about {'xyz'[self.axis]} it reads no rate below "
            f"{1e3 * self.half_width:.2g} mrad/s in any turn; its bias cannot be found from rests"
        )
