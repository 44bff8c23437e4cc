"""Preset motion of a robot in the second stage of a spin, the turn, and departures from it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from tumble.foundation.errors import ProcedureError
from tumble.procedures.spin.result import FULL_TURN

LARGEST_DEPARTURE = 0.1
"""Share by which a turn may differ from what was preset: nobody turns exactly two turns."""


@dataclass(frozen=True, slots=True)
class TurnPreset:
    """Duration, speed and angle of the turn; None for what was not preset. Two of them give the third.

    Raises `ProcedureError` where all three are given and contradict each other.
    """

    duration: float | None = None
    """s of turning, without the rests between."""
    rate: float | None = None
    """rad/s, either way."""
    turns: float | None = None
    """Full turns, both directions added."""

    def __post_init__(self) -> None:
        if self.duration is None or self.rate is None or self.turns is None:
            return
        needed = self.turns * FULL_TURN / self.rate
        if _departs(needed, self.duration):
            raise ProcedureError(
                f"--turns {self.turns:g} at --turn-rate {self.rate:g} take {needed:.3g} s, not the "
                f"--spin-duration of {self.duration:g} s; leave one of the three out"
            )

    def completed(self, rate: float, turns: float) -> TurnPreset:
        """Returns all three, by these where fewer than two are preset: `rate` in rad/s."""
        if self.duration is None:
            return TurnPreset(None, self.rate or rate, self.turns or turns)
        if self.turns is None:
            speed = self.rate or rate
            return TurnPreset(self.duration, speed, speed * self.duration / FULL_TURN)
        return TurnPreset(self.duration, self.turns * FULL_TURN / self.duration, self.turns)

    def departures(self, duration: float, rate: float, turns: float) -> Iterator[str]:
        """Describes departures of a spin, of this duration, rate and angle, from the preset."""
        if self.duration is not None and _departs(duration, self.duration):
            yield f"turned for {duration:.3g} s, where {self.duration:g} s were preset"
        if self.rate is not None and _departs(rate, self.rate):
            yield f"turned at {rate:.2g} rad/s, where {self.rate:g} rad/s were preset"
        if self.turns is not None and _departs(turns, self.turns):
            yield f"turned {turns:.2f} times, where {self.turns:g} were preset"

    @property
    def options(self) -> dict[str, object]:
        """Preset options, by the names of the command."""
        return {"spin-duration": self.duration, "turn-rate": self.rate, "turns": self.turns}


def _departs(value: float, preset: float) -> bool:
    return not math.isclose(value, preset, rel_tol=0.0, abs_tol=LARGEST_DEPARTURE * preset)
