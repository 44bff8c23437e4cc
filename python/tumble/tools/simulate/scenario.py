"""Common parts of all scenarios: their error, and the bounds of their numbers."""

from __future__ import annotations

import math
from typing import ClassVar, TypeAlias

from tumble.foundation.errors import TumbleError
from tumble.tools.simulate.grade import Grade, grade_names

Triple: TypeAlias = tuple[float, float, float]

SLOWEST_RATE_HZ, FASTEST_RATE_HZ = 1.0, 10_000.0
STEEPEST_DEG = 60.0


LONGEST_SAMPLES = 2_000_000_000
"""Samples of a record at rest."""


class ScenarioError(TumbleError):
    """A recording was asked for that cannot be simulated."""


def is_finite(value: object) -> bool:
    """Returns whether all numbers of a field are finite; a field without numbers is."""
    if isinstance(value, (tuple, list)):
        return all(map(is_finite, value))
    return not isinstance(value, float) or math.isfinite(value)


class RecordScenario:
    """Common parts of scenarios of one unit for a stated duration: data classes with these fields."""

    __slots__ = ()
    SHORTEST: ClassVar[float]
    """s."""
    NUMBERS: ClassVar[tuple[str, ...]]
    """Fields that need to be finite."""
    duration: float
    rate_hz: float
    grade: str | Grade

    @property
    def samples(self) -> int:
        """Samples, those in gaps among them."""
        return round(self.duration * self.rate_hz)

    @property
    def unit_grade(self) -> Grade:
        """The grade, whether given by its name or as it is."""
        return Grade.named(self.grade) if isinstance(self.grade, str) else self.grade

    def _check_record(self) -> None:
        """Raises `ScenarioError` where duration, rate or grade make no sense."""
        for name in self.NUMBERS:
            if not is_finite(getattr(self, name)):
                raise ScenarioError(f"{name} is no finite number; give one")
        if isinstance(self.grade, str) and self.grade not in grade_names():
            raise ScenarioError(f"grade {self.grade!r} is unknown; give one of {', '.join(grade_names())}")
        if not SLOWEST_RATE_HZ <= self.rate_hz <= FASTEST_RATE_HZ:
            raise ScenarioError(
                f"a rate of {self.rate_hz:g} Hz cannot be simulated; give {SLOWEST_RATE_HZ:g} to "
                f"{FASTEST_RATE_HZ:g}"
            )
        if self.duration < self.SHORTEST or self.samples > LONGEST_SAMPLES:
            raise ScenarioError(
                f"{self.duration:g} s at {self.rate_hz:g} Hz cannot be simulated; give {self.SHORTEST:g} s "
                f"or more, and at most {LONGEST_SAMPLES} samples"
            )
