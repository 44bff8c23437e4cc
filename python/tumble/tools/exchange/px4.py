"""PX4: parameters of its calibration, `CAL_*`, and of temperature, `TC_*`, as QGroundControl loads them.

PX4's correction by them is in `tumble.foundation.firmware`. Gyroscopes have no scale, magnetometers no
temperature.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tumble.calibration.document import Calibration, TriadCalibration
from tumble.foundation.body_axes import FRD
from tumble.foundation.errors import ProcedureError
from tumble.foundation.files import FileKind
from tumble.foundation.firmware.magnetometers import GAUSS, KILOAMPERE, px4_magnetometer, symmetric
from tumble.foundation.firmware.px4 import IGNORED, LETTER, MOST, prefix, stored
from tumble.foundation.magnetic import LoadUnit
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS
from tumble.foundation.units import Triad as TriadName
from tumble.tools.exchange.calibration_parts import (
    BIAS,
    MATRIX,
    NOTHING,
    TYPICAL,
    Loss,
    sensing_axes,
)
from tumble.tools.exchange.magnetometers import HeldMagnetometer, held, load_unit, upper
from tumble.tools.exchange.parameters import all_powers, numbers_of, single, stored_calibrations
from tumble.tools.exchange.target import Content, Setting, Settings, Target, Written

INT32, FLOAT = 6, 9
"""Types of parameters, by MAVLink."""
LARGEST_ID = 2**31 - 1
SCALE_LIMITS = 0.1, 3.0
_COMPENSATION: Mapping[LoadUnit, int] = {"1": 1, "A": 2}
"""Type of compensation by the unit of the load; current is that of the first battery."""
_AXES = "XYZ"


def write(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the parameters of up to four IMUs."""
    lines = [
        "# Calibration by Tumble for PX4: load it in QGroundControl, Parameters, Tools, Load from file.",
        "# Vehicle-Id\tComponent-Id\tName\tValue\tType",
    ]
    lost: list[Loss] = []
    first = settings.whole_number("instance")
    if not 0 <= first <= MOST - len(calibrations):
        raise settings.refusal("instance", f"PX4 numbers IMUs 0 to {MOST - 1}")
    load = load_unit(calibrations, "PX4")
    for place, calibration in enumerate(calibrations):
        for triad in TRIADS:
            section = getattr(calibration, triad)
            if section is None:
                continue
            device = _device(settings, f"{triad}-id", place, len(calibrations))
            lines += _parameters(calibration, triad, section, first + place, device)
            lost += _ignored(calibration, triad, section)
        if calibration.magnetometer is not None:
            found = held(calibration, calibration.magnetometer, "PX4")
            device = _device(settings, "magnetometer-id", place, len(calibrations))
            lines += _magnetometer(calibration.name, found, first + place, device, load)
            lost += _lost_of_magnetometer(calibration.name, found)
    if load is not None:
        lines.append(_line("CAL_MAG_COMP_TYP", _COMPENSATION[load], INT32))
    return Written("\n".join(lines) + "\n", tuple(lost))


def _device(settings: Settings, name: str, unit: int, units: int) -> int:
    """Returns a device id, which PX4 keeps as a parameter of 32 bits with a sign; 0 is that of no device."""
    device = settings.whole_number(name, unit, units)
    if not 0 < device <= LARGEST_ID:
        raise settings.refusal(name, f"give a whole number from 1 to {LARGEST_ID}, as the vehicle has it")
    return device


def _parameters(
    calibration: Calibration, triad: TriadName, section: TriadCalibration, instance: int, device: int
) -> Iterator[str]:
    names = prefix(triad, instance)
    scale = 1.0 / sensing_axes(section.M).scale
    drift = section.temperature_drift
    yield _line(f"{names}ID", device, INT32)
    # With a thermal correction the bias stands there: in both it would be subtracted twice.
    offset = section.b if drift is None else np.zeros(3)
    yield from _triple(f"{names}{{}}OFF", offset)
    if triad == "accelerometer":
        _check_scales(calibration.name, f"{names}{{}}SCALE", scale, "m/s^2")
        yield from _triple(f"{names}{{}}SCALE", scale)
    if drift is None:
        return
    thermal = f"TC_{LETTER[triad]}{instance}_"
    yield _line(f"TC_{LETTER[triad]}_ENABLE", 1, INT32)
    yield _line(f"{thermal}ID", device, INT32)
    for power, row in enumerate([section.b, *all_powers(drift.bias)]):
        for axis, value in enumerate(row):
            yield _line(f"{thermal}X{power}_{axis}", float(value), FLOAT)
    low, high = drift.range
    for name, degrees in (("TREF", drift.reference), ("TMIN", low), ("TMAX", high)):
        yield _line(f"{thermal}{name}", float(degrees), FLOAT)


def _ignored(calibration: Calibration, triad: TriadName, section: TriadCalibration) -> Iterator[Loss]:
    """Reports values so small that the firmware keeps its defaults in their place."""
    offset = float(np.linalg.norm(section.b))
    if section.temperature_drift is None and 0.0 < offset <= IGNORED:
        yield Loss(calibration.name, triad, f"bias, as PX4 ignores up to {IGNORED:g},", offset)
    scale = 1.0 / sensing_axes(section.M).scale - 1.0
    if triad == "accelerometer" and 0.0 < np.linalg.norm(scale) <= IGNORED:
        size = TYPICAL[triad] * float(np.abs(scale).max())
        yield Loss(calibration.name, triad, f"scale, as PX4 ignores up to {IGNORED:g},", size, "at 1 g")


def _magnetometer(
    name: str, found: HeldMagnetometer, instance: int, device: int, load: LoadUnit | None
) -> Iterator[str]:
    names = f"CAL_MAG{instance}_"
    yield _line(f"{names}ID", device, INT32)
    # The number of no rotation is left to the vehicle: a sensor inside the autopilot has another.
    if found.number:
        yield _line(f"{names}ROT", found.number, INT32)
    yield from _triple(f"{names}{{}}OFF", found.bias / GAUSS)
    scale = np.diag(found.matrix)
    _check_scales(name, f"{names}{{}}SCALE", scale, "uT")
    yield from _triple(f"{names}{{}}SCALE", scale)
    yield from _triple(f"{names}{{}}ODIAG", upper(found.matrix))
    if found.current is not None:
        per_unit = found.current * (KILOAMPERE if load == "A" else 1.0)
        yield from _triple(f"{names}{{}}COMP", -per_unit / GAUSS)


def _lost_of_magnetometer(name: str, found: HeldMagnetometer) -> Iterator[Loss]:
    if found.loss.size > NOTHING:
        yield found.loss
    ignored = f"as PX4 ignores up to {IGNORED:g},"
    if 0.0 < np.linalg.norm(found.bias) <= IGNORED * GAUSS:
        size = float(np.linalg.norm(found.bias))
        yield Loss(name, "magnetometer", f"bias, as PX4 ignores up to {IGNORED * GAUSS:g} uT,", size)
    scale = np.diag(found.matrix) - 1.0
    if 0.0 < np.linalg.norm(scale) <= IGNORED:
        size = TYPICAL["magnetometer"] * float(np.abs(scale).max())
        yield Loss(name, "magnetometer", f"scale, {ignored}", size, "in 50 uT")
    others = upper(found.matrix)
    if NOTHING < np.linalg.norm(others) <= IGNORED:
        size = TYPICAL["magnetometer"] * float(np.linalg.norm(symmetric(np.zeros(3), others), 2))
        yield Loss(name, "magnetometer", f"non-orthogonality, {ignored}", size, "in 50 uT")


def _triple(names: str, values: FloatArray) -> Iterator[str]:
    for letter, value in zip(_AXES, values, strict=True):
        yield _line(names.format(letter), float(value), FLOAT)


def _check_scales(name: str, names: str, scales: FloatArray, unit: str) -> None:
    low, high = SCALE_LIMITS
    for letter, value in zip(_AXES, scales, strict=True):
        if not low <= value <= high:
            raise ProcedureError(
                f"{name}: {names.format(letter)} would be {value:.4g}, and PX4 takes {low} to {high}; "
                f"calibrate readings in {unit}"
            )


def _line(name: str, value: float, kind: int) -> str:
    return f"1\t1\t{name}\t{int(value) if kind == INT32 else single(value)}\t{kind}"


def read(text: str) -> list[Content]:
    """Reads the calibrations of all IMUs."""
    return calibrations_in(numbers_of(text, r"\t", 2, 3))


def calibrations_in(parameters: Mapping[str, float]) -> list[Content]:
    """Returns the calibrations of all IMUs that parameters hold."""
    return stored_calibrations(
        {
            f"imu{number}": {
                triad: found for triad in TRIADS if (found := stored(parameters, triad, number)) is not None
            }
            for number in range(MOST)
        },
        {
            f"imu{number}": magnetometer
            for number in range(MOST)
            if (magnetometer := px4_magnetometer(parameters, number)) is not None
        },
    )


_ID = "device id of the {} ({} of the vehicle; see its parameters, or sensor_{} in a log)"

PX4 = Target(
    word="px4",
    title="PX4 parameters, for QGroundControl",
    ending=".params",
    kind=FileKind("parameters of PX4", re.compile(rb"\A(#[^\n]*\n)*\d+\t\d+\t\w+\t")),
    holds={
        "accelerometer": ("bias", "scale", "bias over temperature"),
        "gyroscope": ("bias", "bias over temperature"),
        "magnetometer": (*BIAS, *MATRIX),
    },
    write=write,
    source="https://docs.px4.io/main/en/advanced_config/parameter_reference.html",
    axes="those of the board, before SENS_BOARD_ROT, in which sensor_accel and sensor_gyro are logged",
    body=FRD,
    own_settings=(
        Setting("accelerometer-id", _ID.format("accelerometer", "CAL_ACC0_ID", "accel")),
        Setting("gyroscope-id", _ID.format("gyroscope", "CAL_GYRO0_ID", "gyro")),
        Setting("magnetometer-id", _ID.format("magnetometer", "CAL_MAG0_ID", "mag")),
        Setting("instance", "number of the first IMU and magnetometer", "0"),
    ),
    most=MOST,
    read=read,
    read_parameters=calibrations_in,
)
