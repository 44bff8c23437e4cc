"""Sensor grades, made by scripts/write_grades.py from the lab's `simulate/grade.rs`; edit that instead."""

from __future__ import annotations

from dataclasses import dataclass

from tumble import _core
from tumble.foundation.bounded_json import parse_json


@dataclass(frozen=True, slots=True, kw_only=True)
class TriadGrade:
    """Grade of three accelerometers or three gyroscopes. `unit` below is m/s^2 or rad/s."""

    noise_density: float
    """White noise `N` of IEEE Std 952, unit / sqrt(Hz): a sample at rate `r` scatters by `N sqrt(r)`."""
    bias_instability: float
    """Bias instability `B` of IEEE Std 952, unit: the Allan deviation has its floor at `0.664 B`."""
    turn_on_bias: float
    """Bias found after power-on, unit, 1 sigma for each axis."""
    scale_error: float
    """Deviation of the scale from 1, 1 sigma for each axis."""
    non_orthogonality: float
    """Deviation of two sensing axes from 90 degrees, rad, 1 sigma for each pair."""
    alignment: float
    """Rotation of the triad inside its package, rad, 1 sigma about each axis."""
    temperature_coefficient: float
    """Change of the bias with temperature, unit / K, 1 sigma for each axis."""
    quantisation: float
    """Smallest step of the output, unit; 0 for none."""
    range: float
    """Largest magnitude of the output, unit."""
    g_sensitivity: float
    """Response of a gyroscope to specific force, rad/s per m/s^2, 1 sigma for each element; 0 for
    accelerometers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Grade:
    """Grade of an inertial measurement unit."""

    name: str
    """One of `grade_names()`, or one's own for a grade made with `dataclasses.replace`."""
    accelerometer: TriadGrade
    """Specific force, m/s^2."""
    gyroscope: TriadGrade
    """Angular rate, rad/s."""
    temperature_step: float
    """Smallest step of the temperature reading, K; 0 for none."""

    @classmethod
    def named(cls, name: str) -> Grade:
        """One of `grade_names()`; raises `ValueError` for another name."""
        figures = parse_json(_core.sensor_grade(name))
        accelerometer = TriadGrade(**figures.pop("accelerometer"))
        gyroscope = TriadGrade(**figures.pop("gyroscope"))
        return cls(name=name, accelerometer=accelerometer, gyroscope=gyroscope, **figures)


def grade_names() -> tuple[str, ...]:
    """Names of the grades there are, best last."""
    return tuple(_core.sensor_grades())
