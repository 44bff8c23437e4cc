"""PX4: `CAL_*`, `TC_*` and `SENS_BOARD_*`, as src/lib/sensor_calibration applies them.

`R ((y - thermal - offset) * scale)` (Accelerometer.hpp), where `thermal = x0 + x1 t + x2 t^2 + x3 t^3` with t
held within its range (src/modules/temperature_compensation/temperature_compensation.cpp).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.firmware.correction import POWERS, Correction, Stored, Thermal, triple, whole
from tumble.foundation.firmware.rotations import from_euler, rotation
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import Triad

MOST = 4
"""Sensors of a kind."""
IGNORED = 0.01
"""m/s^2, rad/s, or a ratio: length of a change of offset or scale that PX4 takes for none."""
LETTER: Mapping[Triad, str] = {"accelerometer": "A", "gyroscope": "G"}
SENSOR: Mapping[Triad, str] = {"accelerometer": "ACC", "gyroscope": "GYRO"}
_ENABLED = 1
INTERNAL = -1
"""Rotation of a sensor inside the autopilot, which turns with the board."""


def prefix(triad: Triad, number: int) -> str:
    """Begins the names of the parameters of a sensor."""
    return f"CAL_{SENSOR[triad]}{number}_"


def stored(parameters: Mapping[str, float], triad: Triad, number: int) -> Stored | None:
    """Returns what is stored of a sensor; None for device id 0, which was never calibrated.

    Scales of zero and below, and numbers that are not finite, PX4 refuses and keeps its defaults.
    """
    names = prefix(triad, number)
    device = whole(parameters, f"{names}ID")
    if device == 0:
        return None
    scale = triple(parameters, names + "{}SCALE", 1.0)
    return Stored(
        device,
        taken(triple(parameters, names + "{}OFF", 0.0), np.zeros(3)),
        taken(scale, np.ones(3)) if np.all(scale > 0.0) else np.ones(3),
        _thermal(parameters, triad, device),
    )


def taken(values: FloatArray, otherwise: FloatArray) -> FloatArray:
    """Returns (3,) values if all are finite: others PX4 leaves as they were."""
    return values if np.isfinite(values).all() else otherwise


def _thermal(parameters: Mapping[str, float], triad: Triad, device: int) -> Thermal | None:
    """Returns what is subtracted over temperature: the first `TC_*` that names the device, of any number."""
    letter = LETTER[triad]
    if parameters.get(f"TC_{letter}_ENABLE") != _ENABLED:
        return None
    every = (f"TC_{letter}{number}_" for number in range(MOST))
    names = next((each for each in every if parameters.get(f"{each}ID") == device), None)
    if names is None:
        return None
    constant, *coefficients = (
        np.array([parameters.get(f"{names}X{power}_{axis}", 0.0) for axis in range(3)])
        for power in (0, *POWERS)
    )
    low, high = (parameters.get(f"{names}{edge}", 0.0) for edge in ("TMIN", "TMAX"))
    reference = parameters.get(f"{names}TREF", 0.0)
    return Thermal(reference, (low, high), constant, np.array(coefficients))


def correction_of(parameters: Mapping[str, float], triad: Triad, device: int) -> Correction:
    """Returns what PX4 does to the readings of a device; without parameters it only turns them.

    Raises `CalibrationFileError` where a parameter makes no sense.
    """
    for number in range(MOST):
        found = stored(parameters, triad, number)
        if found is not None and found.device == device:
            offset = found.offset if np.linalg.norm(found.offset) > IGNORED else np.zeros(3)
            scale = found.scale if np.linalg.norm(found.scale - 1.0) > IGNORED else np.ones(3)
            turned = _body_from_sensor(parameters, prefix(triad, number))
            return Correction(offset, scale, found.thermal, turned)
    thermal = _thermal(parameters, triad, device)
    return Correction(np.zeros(3), np.ones(3), thermal, _body_from_sensor(parameters, ""))


def _body_from_sensor(parameters: Mapping[str, float], sensor: str) -> FloatArray:
    """Turns a sensor outside the autopilot by its own rotation, one inside by that of the board."""
    own = whole(parameters, f"{sensor}ROT", INTERNAL)
    name = "SENS_BOARD_ROT" if own == INTERNAL else f"{sensor}ROT"
    number = own if own != INTERNAL else whole(parameters, name)
    level = from_euler(*triple(parameters, "SENS_BOARD_{}_OFF", 0.0))
    try:
        return level @ rotation(number)
    except KeyError:
        raise CalibrationFileError(f"{name} is {number}, a rotation that is not known") from None
