"""Everything a simulated record at rest is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.noise_terms import BIAS_INSTABILITY, TERM_UNITS, WHITE
from tumble.foundation.units import Triad
from tumble.tools.simulate.grade import Grade
from tumble.tools.simulate.scenario import (
    RecordScenario,
    ScenarioError,
    refuse_beyond_bounds,
    refuse_no_numbers,
    stated_by,
)

Terms = Mapping[str, float]
"""Coefficients by the word of their term, units as `tumble noise` states them; those left out are zero."""


@dataclass(frozen=True, slots=True)
class StaticScenario(RecordScenario):
    """A unit that lies level and still. Terms that are not given are those of its grade."""

    SHORTEST = 1.0
    NUMBERS = ("duration", "rate_hz", "gravity")

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
        refuse_no_numbers(**stated_by(self))
        self._check_record()
        self._check_terms()
        for start, end in self.gaps:
            if not start < end:
                raise ScenarioError(f"gap from {start:g} to {end:g} s ends before it begins; give START:END")
        refuse_beyond_bounds(**stated_by(self))

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
