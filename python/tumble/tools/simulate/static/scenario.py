"""Everything a simulated record at rest is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.noise_terms import BIAS_INSTABILITY, TERM_UNITS, WHITE
from tumble.foundation.units import Triad
from tumble.tools.simulate.grade import Grade, grade_names
from tumble.tools.simulate.scenario import FASTEST_RATE_HZ, SLOWEST_RATE_HZ, ScenarioError, is_finite

SHORTEST, LONGEST_SAMPLES = 1.0, 2_000_000_000
"""s, and samples."""

Terms = Mapping[str, float]
"""Coefficients by the word of their term, units as `tumble noise` states them; those left out are zero."""


@dataclass(frozen=True, slots=True)
class StaticScenario:
    """A unit that lies level and still. Terms that are not given are those of its grade."""

    seed: int = 1
    duration: float = 3600.0
    """s."""
    rate_hz: float = 100.0
    grade: str | Grade = "consumer"
    """White noise and bias instability of which are used."""
    accelerometer: Terms = field(default_factory=dict)
    gyroscope: Terms = field(default_factory=dict)
    """Terms instead of those of the grade."""
    gaps: tuple[tuple[float, float], ...] = ()
    """Start and end, s, of what the logger missed."""
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        for name in ("duration", "rate_hz", "gravity"):
            if not is_finite(getattr(self, name)):
                raise ScenarioError(f"{name} is no finite number; give one")
        if isinstance(self.grade, str) and self.grade not in grade_names():
            raise ScenarioError(f"grade {self.grade!r} is unknown; give one of {', '.join(grade_names())}")
        if not SLOWEST_RATE_HZ <= self.rate_hz <= FASTEST_RATE_HZ:
            raise ScenarioError(
                f"a rate of {self.rate_hz:g} Hz cannot be simulated; give {SLOWEST_RATE_HZ:g} to "
                f"{FASTEST_RATE_HZ:g}"
            )
        if self.duration < SHORTEST or self.samples > LONGEST_SAMPLES:
            raise ScenarioError(
                f"{self.duration:g} s at {self.rate_hz:g} Hz cannot be simulated; give {SHORTEST:g} s "
                f"or more, and at most {LONGEST_SAMPLES} samples"
            )
        self._check_terms()
        for start, end in self.gaps:
            if not start < end:
                raise ScenarioError(f"gap from {start:g} to {end:g} s ends before it begins; give START:END")

    @property
    def samples(self) -> int:
        """Samples, those in gaps among them."""
        return round(self.duration * self.rate_hz)

    @property
    def unit_grade(self) -> Grade:
        """The grade, whether given by its name or as it is."""
        return Grade.named(self.grade) if isinstance(self.grade, str) else self.grade

    def coefficients(self, triad: Triad) -> dict[str, float]:
        """Returns all terms of a triad, by their words."""
        grade = getattr(self.unit_grade, triad)
        usual = {WHITE: grade.noise_density, BIAS_INSTABILITY: grade.bias_instability}
        given: Terms = getattr(self, triad)
        return {word: float(given.get(word, usual.get(word, 0.0))) for word in TERM_UNITS[triad]}

    def _check_terms(self) -> None:
        for triad in TERM_UNITS:
            given: Terms = getattr(self, triad)
            for word, value in given.items():
                if word not in TERM_UNITS[triad]:
                    raise ScenarioError(
                        f"{triad} {word!r} is no term of noise; give one of {', '.join(TERM_UNITS[triad])}"
                    )
                if not (np.isfinite(value) and value >= 0.0):
                    raise ScenarioError(f"{triad} {word} of {value} is impossible; give zero or more")
