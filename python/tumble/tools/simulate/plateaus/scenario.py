"""Everything a simulated set of turntable sessions over temperature is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.foundation.units import CALIBRATED_TRIADS, TRIADS, CalibratedTriad
from tumble.tools.simulate.grade import Grade, grade_names
from tumble.tools.simulate.scenario import (
    ScenarioError,
    is_finite,
    refuse_beyond_bounds,
    refuse_no_numbers,
    stated_by,
)

MOST_POWERS = 3
"""Powers of temperature that a calibration keeps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlateausScenario:
    """One unit beside a reference, turned through the same poses at each temperature."""

    seed: int = 1
    """All that is random follows from it, on every machine alike."""
    temperatures: tuple[float, ...] = (-20.0, 10.0, 40.0, 70.0, 10.0)
    """degC of the sessions, in their order."""
    grade: str | Grade = "consumer"
    rate_hz: float = 100.0
    rest_seconds: float = 5.0
    """Time at each pose."""
    accelerometer: tuple[float, ...] = (1e-3, 1e-5)
    """Change of the bias: coefficients of t, t^2, t^3 from mid-range, m/s^2/K^k, alike for the three axes."""
    gyroscope: tuple[float, ...] = (2e-5, 3e-7)
    """The same, rad/s/K^k."""
    accelerometer_scale: tuple[float, ...] = (3e-5,)
    """Change of the scale, 1/K^k."""
    gyroscope_scale: tuple[float, ...] = (5e-5,)
    """The same."""
    accelerometer_hysteresis: float = 0.0
    """Excess of the bias after warming over that after cooling, m/s^2."""
    gyroscope_hysteresis: float = 0.0
    """The same, rad/s."""
    magnetometer: tuple[float, ...] = ()
    """Change of hard iron, uT/K^k; empty for units without a magnetometer."""
    magnetometer_scale: tuple[float, ...] = ()
    """The same of its scale, 1/K^k."""
    magnetometer_hysteresis: float = 0.0
    """The same, uT."""
    mounting_change_deg: float = 0.0
    """Turn of the unit about its x axis from the coldest to the hottest session."""

    bias_instability: bool = True
    """Indicates whether the bias wanders within and between sessions."""

    def __post_init__(self) -> None:
        refuse_no_numbers(**stated_by(self))
        if not self.temperatures or not all(map(is_finite, self.temperatures)):
            raise ScenarioError("give the temperature of each session in degC, such as -20,10,40,70")
        for name in (*CALIBRATED_TRIADS, *(f"{triad}_scale" for triad in CALIBRATED_TRIADS)):
            powers = getattr(self, name)
            if len(powers) > MOST_POWERS or not all(map(is_finite, powers)):
                raise ScenarioError(f"{name} needs {MOST_POWERS} finite powers of temperature at most")
        if isinstance(self.grade, str) and self.grade not in grade_names():
            raise ScenarioError(f"unknown grade {self.grade!r}; known are {', '.join(grade_names())}")
        refuse_beyond_bounds(**stated_by(self))

    @property
    def reference(self) -> float:
        """Middle of the range, degC, at which M and b hold."""
        return 0.5 * (min(self.temperatures) + max(self.temperatures))

    @property
    def triads(self) -> tuple[CalibratedTriad, ...]:
        """Triads that the units have."""
        return CALIBRATED_TRIADS if self.magnetometer else TRIADS

    def bias_at(self, triad: CalibratedTriad, session: int) -> FloatArray:
        """(3,) change of the bias in a session from the reference, unit of the triad."""
        powers: tuple[float, ...] = getattr(self, triad)
        hysteresis: float = getattr(self, f"{triad}_hysteresis")
        change = self._polynomial(powers, session) + 0.5 * self.leg(session) * hysteresis
        return np.full(3, change)

    def scale_at(self, triad: CalibratedTriad, session: int) -> float:
        """Relative change of the scale in a session from the reference."""
        powers: tuple[float, ...] = getattr(self, f"{triad}_scale")
        return self._polynomial(powers, session)

    def leg(self, session: int) -> float:
        """Returns 1 where the temperature rose to that of the session, -1 where it fell, 0 for the first."""
        before = self.temperatures[max(session - 1, 0)]
        return float(np.sign(self.temperatures[session] - before))

    def _polynomial(self, powers: tuple[float, ...], session: int) -> float:
        t = self.temperatures[session] - self.reference
        return float(sum(value * t**power for power, value in enumerate(powers, start=1)))
