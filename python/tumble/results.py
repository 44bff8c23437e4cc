"""What several procedures find, as plain data: what reports show and calibration files keep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

from tumble import _core
from tumble.recording import FloatArray

TriadName = Literal["accelerometer", "gyroscope"]

Precision = Literal["f64", "f32"]
"""Floats to compute with: f32 as on a device."""

Figures: TypeAlias = Mapping[str, float]
"""Figures of what the core objects to: SI units, times in s of the clock of the samples."""

NOT_SHOWN = "the data do not show it"
"""Why something is not observable, where nothing more can be said."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One estimated number with its uncertainty, in the unit people read it in."""

    name: str
    """Field term with axis: `bias x`, `scale y`, `non-orthogonality xy`, `mounting z`."""
    unit: str
    """`m/s^2`, `rad/s`, `1`, `deg`."""
    value: float
    sigma: float
    """1-sigma; infinite where the data do not show the parameter."""
    low: float
    high: float
    """Ends of the 95 % interval."""
    observable: bool = True
    reason: str = ""
    """Why it could not be observed."""


@dataclass(frozen=True, slots=True)
class TriadResult:
    """Calibration of three accelerometers or three gyroscopes: `y = M u + b`, `M = K L Q`."""

    triad: TriadName
    unit: str
    """`m/s^2` or `rad/s`: unit of b and of the residuals."""
    M: FloatArray
    """(3, 3) sensor from case."""
    b: FloatArray
    """(3,) in `unit`."""
    K: FloatArray
    """(3, 3) diagonal scale."""
    L: FloatArray
    """(3, 3) lower triangular with unit rows: non-orthogonality."""
    Q: FloatArray
    """(3, 3) rotation, sensor_from_case: mounting."""
    covariance: FloatArray
    """(12, 12) of [M row by row, b]; NaN in rows and columns of what was not observable."""
    parameters: tuple[Parameter, ...]
    """bias, scale, non-orthogonality and mounting, three each."""
    estimated: tuple[str, ...]
    """Groups that the data showed: subset of `bias`, `matrix`, `g-sensitivity`."""
    unobservable: tuple[str, ...]
    """Directions of [M, b] the data did not show, in words; empty if all were seen."""
    rank: int
    chi_square: float
    degrees_of_freedom: int
    residuals: FloatArray
    """(k, 3) measured minus modelled for each rest (accelerometer), rest and turn (gyroscope), in `unit`."""
    residual_sigma: FloatArray
    """(k, 3) 1-sigma of the measured means."""
    residual_labels: tuple[str, ...]
    """(k,) `rest 3: Y up`, `turn 3-4`."""
    noise_density: FloatArray
    """(3,) white noise N, unit / sqrt(Hz)."""
    bias_instability: FloatArray
    """(3,) flicker noise B, unit; zero where the record does not show any."""
    g_sensitivity: FloatArray | None = None
    """(3, 3) rad/s per m/s^2, gyroscope only, on request."""
    g_sensitivity_sigma: FloatArray | None = None

    @property
    def p_value(self) -> float:
        """Chance of a larger chi-square, were the model and the noise right."""
        return _core.chi_square_tail(self.chi_square, self.degrees_of_freedom)


@dataclass(frozen=True, slots=True)
class Rest:
    """A stretch in which the unit stood still."""

    start: float
    end: float
    """Seconds of the recording's own clock."""
    samples: int
    specific_force: FloatArray
    """(3,) mean, m/s^2, as measured."""
    angular_rate: FloatArray
    """(3,) mean, rad/s, as measured."""
    specific_force_sigma: FloatArray
    """(3,) 1-sigma of the mean."""
    angular_rate_sigma: FloatArray
    pose: str = ""
    """Name of the matched pose, empty if none."""
    used: bool = True
    remark: str = ""
    """Why it was not used, or what is odd about it."""


@dataclass(frozen=True, slots=True)
class Trace:
    """A recording at a glance: means over equal stretches, few enough to draw."""

    time: FloatArray
    """(n,) s."""
    accelerometer: FloatArray
    """(n, 3) m/s^2."""
    gyroscope: FloatArray
    """(n, 3) rad/s."""


@dataclass(frozen=True, slots=True)
class LimitCheck:
    """One line of a limits file held against one target."""

    parameter: str
    """`accelerometer bias x`."""
    value: float
    limit: float
    """Largest magnitude allowed."""
    unit: str
    passed: bool
    remark: str = ""
    """Why it could not be shown to be within its limit."""
