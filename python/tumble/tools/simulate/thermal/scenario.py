"""Everything a simulated thermal session is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import Triad
from tumble.tools.simulate.grade import Grade
from tumble.tools.simulate.scenario import (
    RecordScenario,
    ScenarioError,
    refuse_beyond_bounds,
    refuse_no_numbers,
    stated_by,
)

MOST_POSES = 60
HIGHEST_ORDER = 3
"""Powers of temperature that a calibration keeps."""
SHARES = (1.0, 0.3, 0.1)
"""Size of the powers of a drawn drift, at the ends of the range, over that of the grade's first power
there."""

Powers = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ThermalScenario(RecordScenario):
    """A unit that rests, one pose after the other, while its temperature goes up and down."""

    SHORTEST = 60.0
    NUMBERS = ("duration", "rate_hz", "low", "high", "cycles", "lag", "gravity")

    seed: int = 1
    duration: float = 3600.0
    """s."""
    rate_hz: float = 20.0
    grade: str | Grade = "consumer"
    """Its white noise and bias instability are used, and its temperature coefficient where none is given."""
    low: float = -10.0
    high: float = 60.0
    """degC."""
    cycles: float = 1.0
    """Cycles of warming and cooling; a half is warming alone."""
    poses: int = 1
    """Number of poses for equal times; a hand turns it between them."""
    accelerometer: Powers | None = None
    """Coefficients of t, t^2, t^3 from mid-range, m/s^2/K^k, alike for the three axes; drawn if not given."""
    gyroscope: Powers | None = None
    """The same, rad/s/K^k."""
    scale: Powers = ()
    """Change of the accelerometer's scale, 1/K^k."""
    accelerometer_hysteresis: float = 0.0
    """Excess of the reading while warming over that while cooling, m/s^2."""
    gyroscope_hysteresis: float = 0.0
    """The same, rad/s."""
    lag: float = 0.0
    """Time constant by which the thermometer is behind the sensor, s."""
    step: float | None = None
    """Resolution of the thermometer, K; 0 for none. That of the grade if not given."""
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        refuse_no_numbers(**stated_by(self))
        self._check_record()
        if not self.low <= self.high:
            raise ScenarioError(f"low {self.low:g} degC lies above high {self.high:g}; exchange them")
        if not 1 <= self.poses <= MOST_POSES:
            raise ScenarioError(f"{self.poses} poses cannot be simulated; give 1 to {MOST_POSES}")
        if not self.cycles > 0.0:
            raise ScenarioError(f"{self.cycles:g} cycles are none; give 0.5 or more")
        for name in ("accelerometer", "gyroscope", "scale"):
            if len(getattr(self, name) or ()) > HIGHEST_ORDER:
                raise ScenarioError(f"{name} has more than {HIGHEST_ORDER} powers; leave out the highest")
        refuse_beyond_bounds(**stated_by(self))

    @property
    def reference(self) -> float:
        """Middle of the range, degC."""
        return 0.5 * (self.low + self.high)

    def bias(self, triad: Triad) -> FloatArray:
        """Returns the coefficients (k, 3) of the bias of a triad, a row for each power from 1, unit/K^k."""
        given: Powers | None = getattr(self, triad)
        if given is not None:
            return np.array([[power] * 3 for power in given]).reshape(-1, 3)
        half = max(0.5 * (self.high - self.low), 1.0)
        random = np.random.default_rng([self.seed, *triad.encode()])
        first = getattr(self.unit_grade, triad).temperature_coefficient
        drawn = random.normal(size=(HIGHEST_ORDER, 3)) * np.array(SHARES)[:, None]
        return np.asarray(first * drawn / half ** np.arange(HIGHEST_ORDER)[:, None])

    def hysteresis(self, triad: Triad) -> float:
        """Bias while warming minus that while cooling, unit of the triad."""
        value: float = getattr(self, f"{triad}_hysteresis")
        return value

    @property
    def thermometer_step(self) -> float:
        """Smallest step of the thermometer, K; 0 for none."""
        return self.unit_grade.temperature_step if self.step is None else self.step
