"""Correction that firmware applies to the readings of a triad, and its inverse.

Both PX4 and ArduPilot give `u = R ((y - t(T) - b) * s)`: thermal polynomial t, offset b, scale s of the axes
of the sensor, and then the rotation R of the board.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.recording import FloatArray

POWERS = (1, 2, 3)
"""Powers of temperature in the polynomials of either firmware."""


@dataclass(frozen=True, slots=True)
class Thermal:
    """`t(T) = constant + c1 d + c2 d^2 + c3 d^3`, d being T, held within its range, minus the reference."""

    reference: float
    """degC."""
    range: tuple[float, float]
    """degC."""
    constant: FloatArray
    """(3,) m/s^2 or rad/s."""
    coefficients: FloatArray
    """(3, 3): a row a power, a column an axis."""

    def at(self, temperature: FloatArray) -> FloatArray:
        """Returns (n, 3) of (n,) degC."""
        apart = np.clip(temperature, *self.range) - self.reference
        return self.constant + np.stack([apart**power for power in POWERS], axis=-1) @ self.coefficients


@dataclass(frozen=True, slots=True)
class Stored:
    """Parameters of one sensor."""

    device: int
    """Id that the firmware knows it by; 0 where it has none."""
    offset: FloatArray
    """(3,) m/s^2 or rad/s; all zero where it was never calibrated."""
    scale: FloatArray
    """(3,)."""
    thermal: Thermal | None


@dataclass(frozen=True, slots=True)
class Correction:
    """Correction of one triad by the parameters of the firmware."""

    offset: FloatArray
    """(3,) m/s^2 or rad/s."""
    scale: FloatArray
    """(3,)."""
    thermal: Thermal | None
    body_from_sensor: FloatArray
    """(3, 3)."""

    def is_other_than(self, before: Correction) -> bool:
        """Returns whether this correction changes readings in another way."""
        same = all(
            np.array_equal(getattr(self, name), getattr(before, name))
            for name in ("offset", "scale", "body_from_sensor")
        )
        return not (same and str(self.thermal) == str(before.thermal))

    def undo(self, corrected: FloatArray, temperature: FloatArray | None) -> FloatArray:
        """Returns the (n, 3) readings that these (n, 3) were before; a thermal needs (n,) degC."""
        with np.errstate(invalid="ignore"):  # of readings that garbling made infinite
            readings = corrected @ self.body_from_sensor / self.scale + self.offset
        if self.thermal is not None:
            assert temperature is not None
            readings += self.thermal.at(temperature)
        return readings


@dataclass(frozen=True, slots=True)
class Corrections:
    """Corrections of a triad over time, as parameters may change."""

    since: FloatArray
    """(k,) s from which each holds; the first holds from the start."""
    each: tuple[Correction, ...]

    @property
    def needs_temperature(self) -> bool:
        """Indicates whether the inverse needs the temperature."""
        return any(correction.thermal is not None for correction in self.each)

    def undo(self, time: FloatArray, corrected: FloatArray, temperature: FloatArray | None) -> FloatArray:
        """Returns the (n, 3) readings that these, at (n,) s, were before."""
        which = np.maximum(np.searchsorted(self.since, time, side="right") - 1, 0)
        readings = np.empty_like(corrected, dtype=np.float64)
        for index in np.unique(which):
            rows = which == index
            degrees = None if temperature is None else temperature[rows]
            readings[rows] = self.each[index].undo(corrected[rows], degrees)
        return readings


def over_time(
    parameters: Mapping[str, float],
    changes: Iterable[tuple[float, str, float]],
    correction: Callable[[Mapping[str, float]], Correction],
) -> Corrections:
    """Follows parameters through their changes: time, s, name and value."""
    now, since, each = dict(parameters), [-np.inf], [correction(parameters)]
    for time, name, value in changes:
        now[name] = value
        following = correction(now)
        if following.is_other_than(each[-1]):
            since.append(time)
            each.append(following)
    return Corrections(np.array(since), tuple(each))


def triple(parameters: Mapping[str, float], names: str, otherwise: float) -> FloatArray:
    """Returns (3,) values of parameters, `{}` in whose names stands for the axis."""
    return np.array([parameters.get(names.format(axis), otherwise) for axis in "XYZ"])


def whole(parameters: Mapping[str, float], name: str, otherwise: int = 0) -> int:
    """Returns a parameter that is an id, or one of a list.

    Raises `CalibrationFileError` where it is no number that can be either.
    """
    found = parameters.get(name, otherwise)
    if not math.isfinite(found):
        raise CalibrationFileError(f"{name} is {found:g}, no whole number")
    return int(found)


def scales(parameters: Mapping[str, float], names: str) -> FloatArray:
    """Returns (3,) factors that readings are multiplied by.

    Raises `CalibrationFileError` where one is none.
    """
    found = triple(parameters, names, 1.0)
    for axis, scale in zip("XYZ", found, strict=True):
        if not 0.0 < scale < np.inf:
            raise CalibrationFileError(f"{names.format(axis)} is {scale:g}, no scale")
    return found
