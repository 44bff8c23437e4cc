"""ArduPilot: parameters of its inertial sensors, `INS_*`; what it makes of them is in `firmware`."""

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
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS
from tumble.tools.exchange.calibration_parts import sensing_axes
from tumble.tools.exchange.parameters import all_powers, numbers_of, single, stored_calibrations
from tumble.tools.exchange.target import Content, Setting, Settings, Target, Written

OFFSET_LIMIT = 3.5
"""m/s^2."""
SCALE_LIMITS = 0.8, 1.2
NOT_ZERO = 1e-6
"""m/s^2 or rad/s: offsets that are all zero are those of a sensor that was never calibrated."""
_AXES = "XYZ"


def write(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the parameters of up to five IMUs."""
    lines = ["# Calibration by Tumble for ArduPilot: NAME,VALUE"]
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
    has_gyroscope = any(calibration.gyroscope is not None for calibration in calibrations)
    if has_gyroscope:
        lines.append("INS_GYR_CAL,0")
    remarks = ("INS_GYR_CAL,0 keeps ArduPilot from finding gyroscope biases anew at each start",)
    return Written("\n".join(lines) + "\n", remarks=remarks if has_gyroscope else ())


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
        }
    )


ARDUPILOT = Target(
    word="ardupilot",
    title="ArduPilot parameters",
    ending=".param",
    kind=FileKind("parameters of ArduPilot", re.compile(rb"\A(#[^\n]*\n)*[A-Z][A-Z0-9_]*[,\s]")),
    holds={
        "accelerometer": ("bias", "scale", "bias over temperature"),
        "gyroscope": ("bias", "bias over temperature"),
    },
    write=write,
    source="https://ardupilot.org/copter/docs/parameters.html#ins-parameters",
    axes="those of the board, before AHRS_ORIENTATION",
    body=FRD,
    own_settings=(Setting("instance", f"number of the first IMU, {NUMBERS[0]} to {NUMBERS[-1]}", "1"),),
    most=len(NUMBERS),
    read=read,
    read_parameters=calibrations_in,
)
