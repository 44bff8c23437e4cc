"""SI units of what the two triads of an IMU measure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Literal, TypeAlias

Triad: TypeAlias = Literal["accelerometer", "gyroscope"]

UNITS: Final[Mapping[Triad, Literal["m/s^2", "rad/s"]]] = {
    "accelerometer": "m/s^2",
    "gyroscope": "rad/s",
}
"""Unit of a triad's readings and biases."""

TRIADS: Final[tuple[Triad, ...]] = tuple(UNITS)
"""Both triads of an IMU."""
