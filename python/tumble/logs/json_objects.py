"""Samples as objects of JSON: their numbers by path, as live sources and logs name them."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from tumble.logs.columns import ImuColumns
from tumble.logs.track import DEFINED, StatedUnit

DEEPEST = 8
"""Levels of a JSON object; a sample of ROS has three."""
_STAMP_FIELDS = (("sec", "nanosec"), ("secs", "nsecs"))
_ROS_IMU = "angular_velocity_covariance[0]"
"""Field that only `sensor_msgs/Imu` has, whose definition states rad/s and m/s^2."""


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Returns the object of its keys; raises `ValueError` where one is given twice: neither value counts."""
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a key is given twice")
    return found


OBJECTS = json.JSONDecoder(parse_int=float, object_pairs_hook=_once)
"""An integer of any length is a number, and one of a thousand digits is infinite."""


def object_in(text: str) -> dict[str, Any] | None:
    """Returns the object that a line holds, perhaps as one of an array; None where it holds none."""
    text = text.strip("[, \t\r\n\ufeff") if text.lstrip("[ \t\ufeff").startswith("{") else ""
    try:
        found = OBJECTS.decode(text.rstrip("], \t\r\n") if text.endswith("]") else text) if text else None
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def numbers_in(value: dict[str, Any]) -> dict[str, float] | None:
    """Returns every number of a JSON object by its path: `acc[0]`, `imu.gyro.x`; texts are passed over.

    None where it is nested deeper than any sample.
    """
    numbers: dict[str, float] = {}
    level: list[tuple[str, Any]] = list(value.items())
    for _ in range(DEEPEST):
        below: list[tuple[str, Any]] = []
        for name, each in level:
            if (stamp := _ros_stamp(each)) is not None:
                numbers[f"{name} [s]"] = stamp
            elif isinstance(each, dict):
                below += [(f"{name}.{key}", part) for key, part in each.items()]
            elif isinstance(each, list):
                below += [(f"{name}[{position}]", part) for position, part in enumerate(each)]
            elif not isinstance(each, str):
                numbers[name] = math.nan if each is None else float(each)
        level = below
    return None if level else numbers


def _ros_stamp(value: object) -> float | None:
    """Returns s of a time as ROS writes it, `{sec, nanosec}` or `{secs, nsecs}`; None of anything else."""
    if not isinstance(value, dict) or len(value) != 2:
        return None
    for seconds, nanoseconds in _STAMP_FIELDS:
        whole, rest = value.get(seconds), value.get(nanoseconds)
        if isinstance(whole, float) and isinstance(rest, float):
            return whole + 1e-9 * rest
    return None


def with_defined_units(columns: ImuColumns, names: Sequence[str]) -> ImuColumns:
    """Returns columns with the units that the definition of their message states, where it does."""
    if not any(name.endswith(_ROS_IMU) for name in names):
        return columns
    return replace(
        columns,
        accelerometer_unit=StatedUnit("m/s^2", DEFINED),
        gyroscope_unit=StatedUnit("rad/s", DEFINED),
    )
