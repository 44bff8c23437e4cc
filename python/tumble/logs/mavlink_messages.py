"""Messages of MAVLink that hold IMU samples: which, in what units, and how they become samples."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from tumble.logs.track import RawMagnetic, RawSamples

MavlinkMessage: TypeAlias = Any
"""A message as pymavlink, which has no types, gives it."""

DIALECT = "pymavlink.dialects.v20.common"
HIGHRES_TRIADS = 0b111111
HIGHRES_MAGNETOMETER = 0b111000000
HIGHRES_TEMPERATURE = 1 << 12


@dataclass(frozen=True, slots=True)
class Kind:
    """A message with IMU samples, and the units of its definition."""

    time: str
    time_unit: str
    accelerometer_unit: str | None
    gyroscope_unit: str | None
    magnetometer_unit: str | None


SCALED = Kind("time_boot_ms", "ms", "mg", "mrad/s", "mG")
KINDS: Mapping[str, Kind] = {
    "HIGHRES_IMU": Kind("time_usec", "us", "m/s^2", "rad/s", "G"),
    "SCALED_IMU": SCALED,
    "SCALED_IMU2": SCALED,
    "SCALED_IMU3": SCALED,
    "RAW_IMU": Kind("time_usec", "us", None, None, None),
}
"""The best first. RAW_IMU is the raw output of the sensor; autopilots disagree on what that is."""


def holds_both_triads(message: MavlinkMessage, name: str) -> bool:
    """Returns whether both triads were renewed, where a message states it; 0 states nothing."""
    if name != "HIGHRES_IMU" or message.fields_updated == 0:
        return True
    return bool(message.fields_updated & HIGHRES_TRIADS == HIGHRES_TRIADS)


def holds_field(message: MavlinkMessage, name: str) -> bool:
    """Returns whether the magnetometer was renewed, as `holds_both_triads` for both triads."""
    if name != "HIGHRES_IMU" or message.fields_updated == 0:
        return True
    return bool(message.fields_updated & HIGHRES_MAGNETOMETER == HIGHRES_MAGNETOMETER)


def magnetic_of(messages: Sequence[MavlinkMessage], kind: Kind) -> RawMagnetic:
    """Returns the readings of the magnetometer in messages of one kind, in its units."""
    return RawMagnetic(
        np.array([getattr(each, kind.time) for each in messages], dtype=np.float64),
        np.array([(each.xmag, each.ymag, each.zmag) for each in messages], dtype=np.float64).reshape(-1, 3),
    )


def samples_of(messages: Sequence[MavlinkMessage], kind: Kind) -> RawSamples:
    """Returns the samples of messages of one kind, in its units, temperature in degC."""
    return RawSamples(
        np.array([getattr(each, kind.time) for each in messages], dtype=np.float64),
        np.array([(each.xacc, each.yacc, each.zacc) for each in messages], dtype=np.float64),
        np.array([(each.xgyro, each.ygyro, each.zgyro) for each in messages], dtype=np.float64),
        np.array([_temperature(each) for each in messages]),
    )


def _temperature(message: MavlinkMessage) -> float:
    """degC; NaN where the message has none."""
    if message.get_type() == "HIGHRES_IMU":
        return float(message.temperature) if message.fields_updated & HIGHRES_TEMPERATURE else math.nan
    hundredths = getattr(message, "temperature", 0)
    return 0.01 * hundredths if hundredths else math.nan


def coarseness(name: str) -> Iterator[str]:
    """Describes a message with coarse resolution."""
    if KINDS[name].time_unit == "ms":
        yield f"{name} comes in whole mg, mrad/s and ms; HIGHRES_IMU is finer"
