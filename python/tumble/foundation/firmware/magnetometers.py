"""PX4's `CAL_MAG*` and ArduPilot's `COMPASS_*`, as both apply them to readings in gauss.

PX4: `R S ((y + p comp) - offset)` (src/lib/sensor_calibration/Magnetometer.hpp), p being the current in kA or
the throttle. ArduPilot: `D s (R y + offset) + p m` (libraries/AP_Compass/AP_Compass_Backend.cpp), p being
the current in A or the throttle, and m `COMPASS_MOT`. S and D are symmetric; R turns a sensor that is
outside the autopilot.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.firmware import px4
from tumble.foundation.firmware.correction import triple, whole
from tumble.foundation.firmware.rotations import rotation
from tumble.foundation.magnetic import LoadUnit
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import FIELD_UNITS

GAUSS = FIELD_UNITS["G"]
"""uT in the unit of PX4."""
MILLIGAUSS = FIELD_UNITS["mG"]
"""uT in the unit of ArduPilot."""
KILOAMPERE = 1e3
"""A in the unit of current of PX4."""
COMPASSES = (1, 2, 3)
"""Magnetometers, as names of ArduPilot's parameters count them."""
PX4_LOADS: Mapping[int, LoadUnit] = {1: "1", 2: "A", 3: "A"}
"""Unit of p by `CAL_MAG_COMP_TYP`, where it is applied: throttle, current of either battery."""
ARDUPILOT_LOADS: Mapping[int, LoadUnit] = {1: "1", 2: "A"}
"""Unit of p by `COMPASS_MOTCT`, where it is applied."""
ARDUPILOT_SCALES = 0.85, 1.4
"""Scale factors that ArduPilot applies; others it takes for none (AP_Compass.cpp, have_scale_factor)."""


@dataclass(frozen=True, slots=True)
class StoredMagnetometer:
    """Parameters of one magnetometer, as `u = C (y - b - c p)`."""

    device: int
    """Id that the firmware knows it by; 0 where it has none."""
    correction: FloatArray
    """(3, 3) C."""
    bias: FloatArray
    """(3,) b, uT."""
    current: FloatArray | None
    """(3,) c, uT per `current_unit`; None where it is not applied."""
    current_unit: LoadUnit = "A"


def px4_magnetometer(parameters: Mapping[str, float], number: int) -> StoredMagnetometer | None:
    """Returns what PX4 stores of a magnetometer; None for device id 0, which was never calibrated.

    Raises `CalibrationFileError` where a parameter makes no sense.
    """
    names = f"CAL_MAG{number}_"
    device = whole(parameters, f"{names}ID")
    if device == 0:
        return None
    scale = px4.taken(triple(parameters, names + "{}SCALE", 1.0), np.ones(3))
    diagonal = scale if np.all(scale > 0.0) else np.ones(3)
    others = px4.taken(triple(parameters, names + "{}ODIAG", 0.0), np.zeros(3))
    turned = whole(parameters, f"{names}ROT", px4.INTERNAL)
    turn = np.eye(3) if turned == px4.INTERNAL else _rotation(turned, f"{names}ROT")
    bias = GAUSS * px4.taken(triple(parameters, names + "{}OFF", 0.0), np.zeros(3))
    load = PX4_LOADS.get(whole(parameters, "CAL_MAG_COMP_TYP"))
    effect = -GAUSS * triple(parameters, names + "{}COMP", 0.0)
    if load is None or not effect.any():
        return StoredMagnetometer(device, turn @ symmetric(diagonal, others), bias, None)
    per_unit = effect / KILOAMPERE if load == "A" else effect
    return StoredMagnetometer(device, turn @ symmetric(diagonal, others), bias, per_unit, load)


def ardupilot_magnetometer(parameters: Mapping[str, float], number: int) -> StoredMagnetometer | None:
    """Returns what ArduPilot stores of a magnetometer, counted from 1; None where its offset is all zero.

    Readings are those after its orientation, as ArduPilot logs them.
    Raises `CalibrationFileError` where a parameter makes no sense.
    """
    which = compass_suffix(number)
    offset = triple(parameters, f"COMPASS_OFS{which}_{{}}", 0.0)
    if not offset.any():
        return None
    diagonal = triple(parameters, f"COMPASS_DIA{which}_{{}}", 1.0)
    diagonal = diagonal if diagonal.any() else np.ones(3)
    others = triple(parameters, f"COMPASS_ODI{which}_{{}}", 0.0)
    low, high = ARDUPILOT_SCALES
    factor = parameters.get(f"COMPASS_SCALE{which}", 0.0)
    correction = symmetric(diagonal, others) * (factor if low <= factor <= high else 1.0)
    device = whole(parameters, f"COMPASS_DEV_ID{which}")
    load = ARDUPILOT_LOADS.get(whole(parameters, "COMPASS_MOTCT"))
    added = MILLIGAUSS * triple(parameters, f"COMPASS_MOT{which}_{{}}", 0.0)
    if load is None or not added.any():
        return StoredMagnetometer(device, correction, -MILLIGAUSS * offset, None)
    try:
        effect = np.asarray(-np.linalg.solve(correction, added), np.float64)
    except np.linalg.LinAlgError:
        raise CalibrationFileError(f"COMPASS_DIA{which} and COMPASS_ODI{which} have no inverse") from None
    return StoredMagnetometer(device, correction, -MILLIGAUSS * offset, effect, load)


def compass_suffix(number: int) -> str:
    """Returns the number within the names of a compass; the first bears none."""
    return "" if number == COMPASSES[0] else str(number)


def symmetric(diagonal: FloatArray, others: FloatArray) -> FloatArray:
    """Returns (3, 3) of its diagonal and of xy, xz and yz."""
    matrix = np.diag(diagonal)
    rows, columns = np.triu_indices(3, 1)
    matrix[rows, columns] = matrix[columns, rows] = others
    return matrix


def _rotation(number: int, name: str) -> FloatArray:
    try:
        return rotation(number)
    except KeyError:
        raise CalibrationFileError(f"{name} is {number}, a rotation that is not known") from None
