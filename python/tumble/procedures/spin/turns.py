"""True turns of a robot from another source: counted turns, dock to dock, wheel odometry."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tumble.foundation.errors import ProcedureError
from tumble.procedures.spin.result import FULL_TURN

Angle = tuple[float, float, float]
"""Truly turned clockwise and counter-clockwise, rad, both positive, NaN where unknown; and its 1-sigma."""
SIGMA = 2.0
"""deg: what a person sees, or a dock gives."""


@dataclass(frozen=True, slots=True)
class TrueTurns:
    """Turns of one spin in each direction, both positive, None where not known."""

    clockwise: float | None
    counter_clockwise: float | None
    sigma: float = SIGMA
    """deg, 1-sigma of the whole angle in one direction."""
    either: bool = False
    """The number holds for every direction in which the robot turned."""

    @classmethod
    def parse(cls, text: str, sigma: float = SIGMA) -> TrueTurns:
        """Reads `3` (in every direction it turned), `+3` (counter-clockwise), `-3` (clockwise), or `+3,-3`.

        `sigma` is in deg.

        Raises `ProcedureError` where it is none of these.
        """
        words = [word.strip() for word in text.split(",")]
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            numbers = []
        signs = [word[:1] for word in words]
        alone = len(numbers) == 1 and signs[0] not in "+-"
        both = len(numbers) == 2 and sorted(signs) == ["+", "-"]
        if not numbers or not (alone or both or len(numbers) == 1) or not all(map(_is_angle, numbers)):
            raise ProcedureError(
                f"true turns {text!r}: give a number of turns, +3 counter-clockwise, -3 clockwise, +3,-3 for "
                "both, or 3 for that angle in every direction in which it turned"
            )
        ccw = next((number for number in numbers if number > 0.0), None)
        cw = next((-number for number in numbers if number < 0.0), None)
        return cls(ccw if alone else cw, ccw, sigma, alone)

    def angle(self, clockwise: float, counter_clockwise: float, least: float) -> Angle:
        """Returns the angles to hold a gyroscope against that has these, rad; below `least` there is none."""
        cw = self._known(self.clockwise, clockwise, least)
        ccw = self._known(self.counter_clockwise, counter_clockwise, least)
        return cw, ccw, math.radians(self.sigma)

    def _known(self, turns: float | None, turned: float, least: float) -> float:
        if turns is None or (self.either and turned < least):
            return math.nan
        return FULL_TURN * turns

    def __str__(self) -> str:
        if self.either:
            return f"{self.clockwise:g}"
        shown = ((self.counter_clockwise, "+"), (self.clockwise, "-"))
        return ",".join(f"{sign}{turns:g}" for turns, sign in shown if turns is not None)


def _is_angle(turns: float) -> bool:
    return math.isfinite(turns) and turns != 0.0
