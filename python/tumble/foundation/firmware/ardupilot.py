"""ArduPilot: `INS_*` and `AHRS_ORIENTATION`, as libraries/AP_InertialSensor applies them.

`R ((y - P(T) + P(T_cal) - offset) * scale)` (AP_InertialSensor_Backend.cpp), with
`P = c1 t + c2 t^2 + c3 t^3`, t being T less 35 degC, T and T_cal held within the range
(AP_InertialSensor_tempcal.cpp). Coefficients are stored a million times as large.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.firmware.correction import POWERS, Correction, Stored, Thermal, scales, triple, whole
from tumble.foundation.firmware.rotations import from_euler, rotation
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import Triad

REFERENCE = 35.0
"""degC."""
COEFFICIENT = 1e6
NUMBERS = (1, 2, 3, 4, 5)
"""IMUs, as names of parameters count them."""
SENSOR: Mapping[Triad, str] = {"accelerometer": "ACC", "gyroscope": "GYR"}
_FIRST = NUMBERS[0]
_GROUPED = 4
"""First IMU whose parameters are a group of their own, `INS4_*`."""
_NEVER = -300.0
"""degC: temperature of calibration of a sensor that has none, below every range."""
_APPLIED = 1
"""Value of ENABLE under which a thermal correction is applied; 2 learns one and applies none."""
_CUSTOM = (101, 102)
_ANGLES = {38: (90.0, 68.8, 293.3), 41: (0.0, 7.0, 0.0), 42: (45.0, 0.0, 0.0), 43: (315.0, 0.0, 0.0)}
"""Roll, pitch and yaw, degrees, of rotations that are not PX4's of that number (AP_Math/rotations.h)."""


@dataclass(frozen=True, slots=True)
class Names:
    """Names of the parameters of one sensor (AP_InertialSensor.cpp and AP_InertialSensor_Params.cpp)."""

    device: str
    offset: str
    """Name of the offset, with `{}` for the axis."""
    scale: str
    """Name of the scale, with `{}` for the axis; an accelerometer's only."""
    calibration_temperature: str
    thermal: str
    """Beginning of the names of the thermal correction, which both triads of an IMU share."""


def names_of(triad: Triad, number: int) -> Names:
    """Returns the names of a sensor of IMU `number`, counted from 1.

    The first accelerometer and the first gyroscope bear no number: `INS_ACCOFFS_X`, `INS_GYROFFS_X`.
    """
    sensor = SENSOR[triad]
    if number >= _GROUPED:
        group = f"INS{number}_"
        return Names(
            f"{group}{sensor}_ID", f"{group}{sensor}OFFS_{{}}", f"{group}{sensor}SCAL_{{}}",
            f"{group}{sensor}_CALTEMP", f"{group}TCAL_",
        )  # fmt: skip
    numbered = f"INS_{sensor}{'' if number == _FIRST else number}"
    return Names(
        f"{numbered}_ID", f"{numbered}OFFS_{{}}", f"{numbered}SCAL_{{}}", f"INS_{sensor}{number}_CALTEMP",
        f"INS_TCAL{number}_",
    )  # fmt: skip


def stored(parameters: Mapping[str, float], triad: Triad, number: int) -> Stored:
    """Returns the parameters of a sensor, counted from 1.

    Raises `CalibrationFileError` where one makes no sense.
    """
    names = names_of(triad, number)
    return Stored(
        whole(parameters, names.device),
        triple(parameters, names.offset, 0.0),
        _scale(parameters, names),
        _thermal(parameters, triad, names),
    )


def _scale(parameters: Mapping[str, float], names: Names) -> FloatArray:
    """Returns (3,) factors; three zeros, the default of older firmware, it replaces by ones as it starts."""
    if not triple(parameters, names.scale, 1.0).any():
        return np.ones(3)
    return scales(parameters, names.scale)


def _thermal(parameters: Mapping[str, float], triad: Triad, names: Names) -> Thermal | None:
    """Returns the thermal correction of a sensor, about the temperature of its calibration."""
    if parameters.get(f"{names.thermal}ENABLE") != _APPLIED:
        return None
    low, high = parameters.get(f"{names.thermal}TMIN", 0.0), parameters.get(f"{names.thermal}TMAX", 70.0)
    calibrated = float(np.clip(parameters.get(names.calibration_temperature, _NEVER), low, high))
    powers = np.array([triple(parameters, f"{names.thermal}{SENSOR[triad]}{k}_" + "{}", 0.0) for k in POWERS])
    return Thermal(calibrated, (low, high), np.zeros(3), about(powers / COEFFICIENT, REFERENCE, calibrated))


def about(powers: FloatArray, old: float, new: float) -> FloatArray:
    """Returns powers 1 to 3 of T less `new`, degC, that change by as much as those of T less `old` do."""
    first, second, third = powers
    h = new - old
    return np.array([first + 2.0 * h * second + 3.0 * h * h * third, second + 3.0 * h * third, third])


def correction_of(parameters: Mapping[str, float], triad: Triad, number: int) -> Correction:
    """Returns what ArduPilot does to the readings of a sensor, counted from 1.

    Raises `CalibrationFileError` where a parameter makes no sense.
    """
    found = stored(parameters, triad, number)
    turned = whole(parameters, "AHRS_ORIENTATION")
    try:
        body_from_sensor = from_euler(*_ANGLES[turned]) if turned in _ANGLES else rotation(turned)
    except KeyError:
        custom = " (CUST_ROT)" if turned in _CUSTOM else ""
        raise CalibrationFileError(f"AHRS_ORIENTATION is {turned}{custom}, which is not undone") from None
    return Correction(found.offset, found.scale, found.thermal, body_from_sensor)
