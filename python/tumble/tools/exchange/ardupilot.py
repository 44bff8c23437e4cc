"""ArduPilot: parameters of its inertial sensors, `INS_*`, and compasses, `COMPASS_*`.

ArduPilot's correction by them is in `tumble.foundation.firmware`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tumble.calibration.document import Calibration, TriadCalibration
from tumble.foundation.body_axes import FRD
from tumble.foundation.errors import ProcedureError
from tumble.foundation.files import FileKind
from tumble.foundation.firmware.ardupilot import (
    COEFFICIENT,
    NUMBERS,
    REFERENCE,
    SENSOR,
    about,
    names_of,
    stored,
)
from tumble.foundation.firmware.magnetometers import (
    COMPASSES,
    MILLIGAUSS,
    ardupilot_magnetometer,
    compass_suffix,
)
from tumble.foundation.firmware.rotations import to_euler
from tumble.foundation.magnetic import LoadUnit
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS
from tumble.tools.exchange.calibration_parts import BIAS, MATRIX, NOTHING, Loss, sensing_axes
from tumble.tools.exchange.magnetometers import HeldMagnetometer, held, load_unit, upper
from tumble.tools.exchange.parameters import all_powers, numbers_of, single, stored_calibrations
from tumble.tools.exchange.target import Content, Setting, Settings, Target, Written

OFFSET_LIMIT = 3.5
"""m/s^2."""
SCALE_LIMITS = 0.8, 1.2
NOT_ZERO = 1e-6
"""m/s^2 or rad/s: offsets that are all zero are those of a sensor that was never calibrated."""
OFFSET_OF_COMPASS = 1800.0
"""mGauss: default of COMPASS_OFFS_MAX."""
_COMPENSATION: Mapping[LoadUnit, int] = {"1": 1, "A": 2}
"""COMPASS_MOTCT by the unit of the load."""
CUSTOM, NEAREST = "custom", "nearest"
"""Choices of a rotation: one of the two that the user defines, or a numbered one."""
_CUSTOM_ROTATION = "CUST_ROT"
_CUSTOM = 101
"""Number of the first custom rotation; the second has the next."""
_AXES = "XYZ"


def write(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the parameters of up to five IMUs."""
    lines = ["# Calibration by Tumble for ArduPilot: NAME,VALUE"]
    lost: list[Loss] = []
    remarks: list[str] = []
    load = load_unit(calibrations, "ArduPilot")
    if settings.text("compass-rotation") not in (CUSTOM, NEAREST):
        raise settings.refusal("compass-rotation", f"give {NEAREST} or {CUSTOM}")
    for place, calibration in enumerate(calibrations):
        number = place + settings.whole_number("instance")
        if number not in NUMBERS:
            raise ProcedureError(
                f"--set instance={number}: ArduPilot numbers IMUs {NUMBERS[0]} to {NUMBERS[-1]}"
            )
        if calibration.accelerometer is not None:
            lines += _accelerometer(calibration, calibration.accelerometer, number)
        if calibration.gyroscope is not None:
            lines += _triple(names_of("gyroscope", number).offset, _not_zero(calibration.gyroscope.b))
        lines += _thermal(calibration, number)
        if calibration.magnetometer is not None:
            if number not in COMPASSES:
                raise ProcedureError(
                    f"{calibration.name}: ArduPilot numbers compasses {COMPASSES[0]} to {COMPASSES[-1]}, and "
                    f"this would be {number}; give another --set instance"
                )
            custom = _CUSTOM + place if settings.text("compass-rotation") == CUSTOM else None
            found = held(calibration, calibration.magnetometer, "ArduPilot", custom=custom)
            lines += _compass(found, number)
            lost += [found.loss] if found.loss.size > NOTHING else []
            remarks += _compass_remarks(found, number)
    if load is not None:
        lines.append(f"COMPASS_MOTCT,{_COMPENSATION[load]}")
    if any(calibration.gyroscope is not None for calibration in calibrations):
        lines.append("INS_GYR_CAL,0")
        remarks.append("INS_GYR_CAL,0 keeps ArduPilot from finding gyroscope biases anew at each start")
    return Written("\n".join(lines) + "\n", tuple(lost), tuple(remarks))


def _accelerometer(calibration: Calibration, section: TriadCalibration, number: int) -> Iterator[str]:
    scale = 1.0 / sensing_axes(section.M).scale
    low, high = SCALE_LIMITS
    if np.abs(section.b).max() > OFFSET_LIMIT:
        raise ProcedureError(
            f"{calibration.name}: a bias of {np.abs(section.b).max():.3g} m/s^2 is more than the "
            f"{OFFSET_LIMIT:g} that ArduPilot takes; check the sensor"
        )
    if scale.min() < low or scale.max() > high:
        worst = float(scale[np.argmax(np.abs(scale - 1.0))])
        raise ProcedureError(
            f"{calibration.name}: a scale of {worst:.4g} is not within the {low} to {high} that ArduPilot "
            "takes; calibrate readings in m/s^2"
        )
    names = names_of("accelerometer", number)
    yield from _triple(names.offset, _not_zero(section.b))
    yield from _triple(names.scale, scale)


def _thermal(calibration: Calibration, number: int) -> Iterator[str]:
    drifts = {
        triad: section.temperature_drift
        for triad in TRIADS
        if (section := getattr(calibration, triad)) is not None and section.temperature_drift is not None
    }
    if not drifts:
        return
    low, high = next(iter(drifts.values())).range
    if any(tuple(drift.range) != (low, high) for drift in drifts.values()):
        raise ProcedureError(
            f"{calibration.name}: its triads were seen in different ranges of temperature, and ArduPilot has "
            "one for both; run tumble thermal on logs of both"
        )
    shared = names_of(TRIADS[0], number).thermal
    yield f"{shared}ENABLE,1"
    yield f"{shared}TMIN,{single(low)}"
    yield f"{shared}TMAX,{single(high)}"
    for triad, drift in drifts.items():
        yield f"{names_of(triad, number).calibration_temperature},{single(drift.reference)}"
        powers = COEFFICIENT * about(all_powers(drift.bias), drift.reference, REFERENCE)
        for power, row in enumerate(powers, start=1):
            yield from _triple(f"{shared}{SENSOR[triad]}{power}_{{}}", row)


def _compass(found: HeldMagnetometer, number: int) -> Iterator[str]:
    """Yields a compass; ArduPilot turns readings before it corrects them, so all holds in turned axes."""
    which = compass_suffix(number)
    turned = found.turn @ found.matrix @ found.turn.T
    if found.number:
        yield f"COMPASS_ORIENT{which},{found.number}"
    if found.number >= _CUSTOM:
        yield f"{_CUSTOM_ROTATION}_ENABLE,1"
        for name, angle in zip(("ROLL", "PITCH", "YAW"), to_euler(found.turn), strict=True):
            yield f"{_CUSTOM_ROTATION}{found.number - _CUSTOM + 1}_{name},{single(angle)}"
    yield from _triple(f"COMPASS_OFS{which}_{{}}", _not_zero(-(found.turn @ found.bias) / MILLIGAUSS))
    yield f"COMPASS_SCALE{which},1"
    yield from _triple(f"COMPASS_DIA{which}_{{}}", np.diag(turned))
    yield from _triple(f"COMPASS_ODI{which}_{{}}", upper(turned))
    if found.current is not None:
        yield from _triple(f"COMPASS_MOT{which}_{{}}", -(turned @ found.turn @ found.current) / MILLIGAUSS)


def _compass_remarks(found: HeldMagnetometer, number: int) -> Iterator[str]:
    which = compass_suffix(number)
    offset = float(np.linalg.norm(found.bias)) / MILLIGAUSS
    if offset > OFFSET_OF_COMPASS:
        yield f"ArduPilot does not arm with COMPASS_OFS{which} unless COMPASS_OFFS_MAX is above {offset:.0f}"
    if found.number:
        yield f"ArduPilot applies COMPASS_ORIENT{which} to a compass that it takes for an external one"


def _triple(names: str, values: FloatArray) -> list[str]:
    return [f"{names.format(axis)},{single(value)}" for axis, value in zip(_AXES, values, strict=True)]


def _not_zero(offset: FloatArray) -> FloatArray:
    return offset if np.any(offset) else np.array([NOT_ZERO, 0.0, 0.0])


def read(text: str) -> list[Content]:
    """Reads the calibrations of all IMUs."""
    return calibrations_in(numbers_of(text, r"[,\s]+", 0, 1))


def calibrations_in(parameters: Mapping[str, float]) -> list[Content]:
    """Returns the calibrations of all IMUs that parameters hold."""
    return stored_calibrations(
        {
            f"imu{number}": {
                triad: found
                for triad in TRIADS
                # Offsets that are all zero are those of none.
                if (found := stored(parameters, triad, number)).offset.any()
            }
            for number in NUMBERS
        },
        {
            f"imu{number}": magnetometer
            for number in COMPASSES
            if (magnetometer := ardupilot_magnetometer(parameters, number)) is not None
        },
    )


ARDUPILOT = Target(
    word="ardupilot",
    title="ArduPilot parameters",
    ending=".param",
    kind=FileKind("parameters of ArduPilot", re.compile(rb"\A(#[^\n]*\n)*[A-Z][A-Z0-9_]*[,\s]")),
    holds={
        "accelerometer": ("bias", "scale", "bias over temperature"),
        "gyroscope": ("bias", "bias over temperature"),
        "magnetometer": (*BIAS, *MATRIX),
    },
    write=write,
    source="https://ardupilot.org/copter/docs/parameters.html#ins-parameters",
    axes="those of the board, before AHRS_ORIENTATION",
    body=FRD,
    own_settings=(
        Setting("instance", f"number of the first IMU and compass, {NUMBERS[0]} to {NUMBERS[-1]}", "1"),
        Setting(
            "compass-rotation",
            f"{CUSTOM} turns an external compass by CUST_ROT1_*; {NEAREST} by a numbered rotation",
            NEAREST,
        ),
    ),
    most=len(NUMBERS),
    read=read,
    read_parameters=calibrations_in,
)
