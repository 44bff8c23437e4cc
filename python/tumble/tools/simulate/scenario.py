"""Common parts of all scenarios: their error, and the bounds of their numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np

from tumble.foundation.errors import TumbleError
from tumble.foundation.words import short
from tumble.tools.simulate.grade import Grade, grade_names

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Triple: TypeAlias = tuple[float, float, float]

SLOWEST_RATE_HZ, FASTEST_RATE_HZ = 1.0, 10_000.0
STEEPEST_DEG = 60.0


LONGEST_SAMPLES = 2_000_000_000
"""Samples of a record at rest."""


_SHARES = dict.fromkeys(("intensity", "sway", "turning", "at_rest"), (0.0, 1.0))
_SPANS = ("duration", "motion_seconds", "rest_seconds", "seconds_per_rate", "stop_seconds")
_DELAYS = ("batch_seconds", "delay_seconds", "duration_seconds", "jitter_seconds", "latency_seconds", "lag")
_ANGLES = ("heading_turn_deg", "mounting_angle_deg", "mounting_deg", "pitch_deg", "roll_deg", "yaw_deg")
_MORE_ANGLES = ("target_mounting_deg", "tipped_deg", "uphill_deg", "mounting_change_deg")
_OF_TEMPERATURE = ("accelerometer", "gyroscope", "accelerometer_hysteresis", "gyroscope_hysteresis")
_MORE_OF_TEMPERATURE = ("magnetometer", "magnetometer_hysteresis", "scale")
_SCALES = ("accelerometer_scale", "gyroscope_scale", "magnetometer_scale")
_NOISE = ("accelerometer_noise", "gyroscope_noise", "angular_rate", "specific_force", "vibration", "flexing")
_BIASES = ("accelerometer_ageing", "accelerometer_bias", "gyroscope_ageing", "gyroscope_bias")
BOUNDS: Mapping[str, tuple[float, float]] = {
    "seed": (0, 2**64 - 1),
    "rate_hz": (SLOWEST_RATE_HZ, FASTEST_RATE_HZ),
    "rate": (SLOWEST_RATE_HZ, FASTEST_RATE_HZ),
    "gravity": (0.0, 1000.0),
    "latitude_deg": (-90.0, 90.0),
    **_SHARES,
    **dict.fromkeys(_SPANS, (0.0, 1e15)),
    **dict.fromkeys((*_DELAYS, "warm_up_seconds"), (0.0, 1e9)),
    "clock_offset_seconds": (-1e9, 1e9),
    "clock_skew_ppm": (-1e5, 1e5),
    "phase": (-1e6, 1e6),
    **dict.fromkeys((*_ANGLES, *_MORE_ANGLES), (-1e4, 1e4)),
    "dip_deg": (-90.0, 90.0),
    "floor_tilt_deg": (0.0, STEEPEST_DEG),
    "ground_tilt_deg": (0.0, STEEPEST_DEG),
    "table_error_deg": (0.0, 180.0),
    "lever_arm_m": (-1e4, 1e4),
    **dict.fromkeys(("low", "high", "temperature_celsius", "temperatures"), (-273.15, 1e4)),
    "warm_up_kelvin": (-1e4, 1e4),
    **dict.fromkeys((*_OF_TEMPERATURE, *_MORE_OF_TEMPERATURE, *_BIASES), (-1e6, 1e6)),
    **dict.fromkeys(_SCALES, (-1.0, 1.0)),
    **dict.fromkeys((*_NOISE, "ageing", "field_noise", "matrix_errors", "slips"), (0.0, 1e6)),
    "accelerometer_range": (0.0, 1e6),
    **dict.fromkeys(("turn_rate", "turn_acceleration", "drive_speed", "unevenness_hz"), (0.0, 1e6)),
    **dict.fromkeys(("turn_rate_dps", "turn_acceleration_dps2"), (0.0, 1e6)),
    "rates_dps": (-1e6, 1e6),
    "slow_turn": (-1e6, 1e6),
    "unevenness": (0.0, 1.0),
    **dict.fromkeys(("band_hz", "tones_hz"), (0.0, FASTEST_RATE_HZ)),
    "gaps": (-1e15, 1e15),
    "cycles": (0.0, 1e6),
    "speed": (0.0, 1e6),
    **dict.fromkeys(("flights", "stops", "poses", "orientations", "disturbed"), (0, 1e6)),
    **dict.fromkeys(("port", "table_port"), (0, 2**16 - 1)),
    "still": (0.0, 3600.0),
    **dict.fromkeys(("strength", "field_strength"), (1.0, 1000.0)),
    "dip": (-90.0, 90.0),
    "noise": (0.0, 1000.0),
    "step": (0.0, 1000.0),
    "field_difference": (-1000.0, 1000.0),
}
"""Least and largest number of each field of a scenario, in its unit; no simulated thing is beyond them."""
_WHOLE = {"seed", "flights", "stops", "poses", "orientations", "disturbed", "port", "table_port"}


def refuse_no_numbers(**stated: object) -> None:
    """Raises `ScenarioError`, in one line, where a field is no number, a whole one where it has to be."""
    for name, number in _numbers(stated):
        kind = "whole number" if name in _WHOLE else "number"
        if not isinstance(number, Integral if name in _WHOLE else Real):
            raise ScenarioError(f"{name} is {short(number)}; give a {kind}")
        if name == "seed":
            _refuse_beyond(name, number)


def refuse_beyond_bounds(**stated: object) -> None:
    """Raises `ScenarioError`, in one line, where a field is beyond its bounds."""
    for name, number in _numbers(stated):
        _refuse_beyond(name, number)


def stated_by(scenario: DataclassInstance) -> dict[str, Any]:
    """Returns the fields of a scenario by name."""
    return {each.name: getattr(scenario, each.name) for each in fields(scenario)}


def _numbers(stated: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in stated.items():
        if name in BOUNDS:
            yield from ((name, number) for number in _flat(value))


def _flat(value: object) -> Iterator[object]:
    """Yields all that may be numbers; what is not given and what has fields of its own is none."""
    if isinstance(value, Mapping):
        value = tuple(value.values())
    if isinstance(value, tuple | list | np.ndarray):
        for each in value:
            yield from _flat(each)
    elif value is not None and not isinstance(value, bool) and not is_dataclass(value):
        yield value


def _refuse_beyond(name: str, number: Any) -> None:  # noqa: ANN401 - what a user states
    least, largest = BOUNDS[name]
    if not least <= number <= largest:
        raise ScenarioError(f"{name} is {number:g}; give {least:g} to {largest:g}")


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
