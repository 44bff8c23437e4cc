"""SI units of what the two triads of an IMU measure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Literal, TypeAlias, get_args

Triad: TypeAlias = Literal["accelerometer", "gyroscope"]

UNITS: Final[Mapping[Triad, Literal["m/s^2", "rad/s"]]] = {
    "accelerometer": "m/s^2",
    "gyroscope": "rad/s",
}
"""Unit of a triad's readings and biases."""

TRIADS: Final[tuple[Triad, ...]] = tuple(UNITS)
"""Both triads of an IMU."""

CalibratedTriad: TypeAlias = Literal["accelerometer", "gyroscope", "magnetometer"]
"""A triad that a calibration file has a section for."""

CALIBRATED_UNITS: Final[Mapping[CalibratedTriad, Literal["m/s^2", "rad/s", "uT"]]] = {
    "accelerometer": "m/s^2",
    "gyroscope": "rad/s",
    "magnetometer": "uT",
}
"""Unit of the readings and biases of each."""

CALIBRATED_TRIADS: Final[tuple[CalibratedTriad, ...]] = tuple(CALIBRATED_UNITS)

Channel: TypeAlias = Literal["ax", "ay", "az", "gx", "gy", "gz"]
"""One axis of one triad."""

CHANNELS: Final[tuple[Channel, ...]] = get_args(Channel)
"""All channels of an IMU, the accelerometer's first."""


def channels_of(triad: Triad) -> tuple[Channel, ...]:
    """Returns the three channels of a triad, x first."""
    start = 3 * TRIADS.index(triad)
    return CHANNELS[start : start + 3]


def triad_of(channel: Channel) -> Triad:
    """Returns the triad that a channel is an axis of."""
    return TRIADS[CHANNELS.index(channel) // 3]


FIELD_UNITS: Final[Mapping[str, float]] = {"uT": 1.0, "nT": 1e-3, "T": 1e6, "G": 100.0, "mG": 0.1}
"""Microtesla in one unit of the magnetic field, by its name."""
