"""Betaflight: the lines of its command line that set the offsets of accelerometer and magnetometer.

Betaflight subtracts whole counts from what it has turned into the axes of the board: of the accelerometer
`acc_1G` make 1 g (src/main/sensors/acceleration.c), of the magnetometer as many as its chip has
(src/main/sensors/compass.c). Scale, soft iron and gyroscope it does not keep. The fourth number of
`acc_calibration` states that the sensor is calibrated.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from tumble.calibration.document import Calibration
from tumble.foundation.body_axes import FLU
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import ProcedureError
from tumble.foundation.files import FileKind
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import FIELD_UNITS
from tumble.tools.exchange.calibration_parts import BIAS, Loss
from tumble.tools.exchange.remark_lines import comment
from tumble.tools.exchange.target import Setting, Settings, Target, Written

LARGEST = 2**15 - 1
COUNTS_OF_FIELD = "counts-per-gauss"


def write(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the offsets of one accelerometer and one magnetometer, or of either."""
    (calibration,) = calibrations
    lines: list[str] = []
    losses: list[Loss] = []
    if (accelerometer := calibration.accelerometer) is not None:
        unit = STANDARD_GRAVITY / settings.positive_number("counts-per-g")
        numbers, rounding = _counts(calibration.name, accelerometer.b, unit)
        lines.append(f"set acc_calibration = {numbers},1")
        losses.append(Loss(calibration.name, "accelerometer", "rounding to counts", rounding))
    if (magnetometer := calibration.magnetometer) is not None and settings.text(COUNTS_OF_FIELD):
        unit = FIELD_UNITS["G"] / settings.positive_number(COUNTS_OF_FIELD)
        numbers, rounding = _counts(calibration.name, magnetometer.b, unit)
        lines.append(f"set mag_calibration = {numbers}")
        losses.append(Loss(calibration.name, "magnetometer", "rounding to counts", rounding))
    elif magnetometer is not None:
        part = f"bias, without --set {COUNTS_OF_FIELD},"
        losses.append(Loss(calibration.name, "magnetometer", part, float(np.abs(magnetometer.b).max())))
    if not lines:
        raise ProcedureError(
            f"{calibration.name}: has no section that Betaflight keeps: the accelerometer's, or with --set "
            f"{COUNTS_OF_FIELD} the magnetometer's"
        )
    head = f"# Calibration of {comment(calibration.name)} by Tumble"
    return Written("\n".join([head, *lines, "save", ""]), tuple(losses))


def _counts(name: str, bias: FloatArray, unit: float) -> tuple[str, float]:
    """Returns a bias in whole counts, as Betaflight takes them, and the largest error that this leaves.

    `unit` is one count. Raises `ProcedureError` where Betaflight cannot hold as many.
    """
    exact = bias / unit
    counts = np.rint(exact)
    if np.abs(counts).max() > LARGEST:
        raise ProcedureError(f"{name}: a bias of {exact.max():.0f} counts is none of a sensor")
    return ",".join(str(int(count)) for count in counts), float(np.abs(exact - counts).max()) * unit


BETAFLIGHT = Target(
    word="betaflight",
    title="Betaflight, for its command line",
    ending=".txt",
    kind=FileKind("commands for Betaflight, as Tumble writes them", re.compile(rb"\A# Calibration of ")),
    holds={"accelerometer": BIAS, "magnetometer": BIAS},
    write=write,
    source="https://betaflight.com/docs/wiki/guides/current/Betaflight-CLI",
    axes="those of the craft, after align_acc, align_mag and the alignment of the board",
    body=FLU,
    own_settings=(
        Setting("counts-per-g", "acc_1G of the sensor, 2048 at 16 g and 16 bits", "2048"),
        Setting(
            COUNTS_OF_FIELD,
            "counts of the magnetometer in a gauss, such as 1090 of an HMC5883L and 3000 of a QMC5883L at "
            "8 G; without it the magnetometer is left out",
            "",
        ),
    ),
    remarks=("Betaflight finds gyroscope biases anew at each start",),
)
