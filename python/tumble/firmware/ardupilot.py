"""ArduPilot: `INS_*` and `AHRS_ORIENTATION`, as libraries/AP_InertialSensor applies them.

`R ((y - P(T) + P(T_cal) - offset) * scale)` (AP_InertialSensor_Backend.cpp), with
`P = c1 t + c2 t^2 + c3 t^3`, t being T less 35 degC, T and T_cal held within the range
(AP_InertialSensor_tempcal.cpp). Coefficients are stored a million times as large.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tumble.errors import CalibrationFileError
from tumble.firmware.correction import POWERS, Correction, Stored, Thermal, scales, triple, whole
from tumble.firmware.rotations import rotation
from tumble.recording import FloatArray
from tumble.units import Triad

REFERENCE = 35.0
"""degC."""
COEFFICIENT = 1e6
NUMBERS = (1, 2, 3)
"""Of IMUs, in names of parameters."""
SENSOR: Mapping[Triad, str] = {"accelerometer": "ACC", "gyroscope": "GYR"}
_FIRST = NUMBERS[0]
_CUSTOM = (101, 102)


def names_of(sensor: str, number: int) -> str:
    """Begin the names of offsets and scales: `INS_GYRO` is the first gyroscope, `INS_GYR2` the second."""
    name = "GYRO" if sensor == "GYR" and number == _FIRST else sensor
    return f"INS_{name}" if number == _FIRST else f"INS_{sensor}{number}"


def stored(parameters: Mapping[str, float], triad: Triad, number: int) -> Stored:
    """Give what is stored of a sensor, counted from 1."""
    sensor = SENSOR[triad]
    names = names_of(sensor, number)
    device = whole(parameters, f"INS_{sensor}{'' if number == _FIRST else number}_ID")
    return Stored(
        device,
        triple(parameters, names + "OFFS_{}", 0.0),
        scales(parameters, names + "SCAL_{}"),
        _thermal(parameters, sensor, number),
    )


def _thermal(parameters: Mapping[str, float], sensor: str, number: int) -> Thermal | None:
    """Give what a sensor does over temperature, about the temperature of its calibration."""
    names = f"INS_TCAL{number}_"
    if not parameters.get(f"{names}ENABLE"):
        return None
    low, high = parameters.get(f"{names}TMIN", 0.0), parameters.get(f"{names}TMAX", 70.0)
    calibrated = float(np.clip(parameters.get(f"INS_{sensor}{number}_CALTEMP", REFERENCE), low, high))
    powers = np.array([triple(parameters, f"{names}{sensor}{k}_" + "{}", 0.0) for k in POWERS])
    return Thermal(calibrated, (low, high), np.zeros(3), about(powers / COEFFICIENT, REFERENCE, calibrated))


def about(powers: FloatArray, old: float, new: float) -> FloatArray:
    """Give powers 1 to 3 of T less `new`, degC, that change by as much as those of T less `old` do."""
    first, second, third = powers
    h = new - old
    return np.array([first + 2.0 * h * second + 3.0 * h * h * third, second + 3.0 * h * third, third])


def correction_of(parameters: Mapping[str, float], triad: Triad, number: int) -> Correction:
    """Give what ArduPilot does to the readings of a sensor, counted from 1.

    Raises `CalibrationFileError` where a parameter makes no sense.
    """
    found = stored(parameters, triad, number)
    turned = whole(parameters, "AHRS_ORIENTATION")
    try:
        body_from_sensor = rotation(turned)
    except KeyError:
        custom = " (CUST_ROT)" if turned in _CUSTOM else ""
        raise CalibrationFileError(f"AHRS_ORIENTATION is {turned}{custom}, which is not undone") from None
    return Correction(found.offset, found.scale, found.thermal, body_from_sensor)
