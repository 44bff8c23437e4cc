"""Betaflight: the line of its command line that sets the offset of the accelerometer.

Betaflight subtracts whole counts, of which `acc_1G` make 1 g, from what it has turned into the axes of the
board (src/main/sensors/acceleration.c); scale and gyroscope it does not keep. The fourth number states that
the sensor is calibrated.
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
from tumble.tools.exchange.calibration_parts import BIAS, Loss
from tumble.tools.exchange.remark_lines import comment
from tumble.tools.exchange.target import Setting, Settings, Target, Written

LARGEST = 2**15 - 1


def write(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the offset of one accelerometer."""
    (calibration,) = calibrations
    if calibration.accelerometer is None:
        raise ProcedureError(
            f"{calibration.name}: has no accelerometer section, which is all Betaflight keeps"
        )
    per_g = settings.positive_number("counts-per-g")
    exact = calibration.accelerometer.b / STANDARD_GRAVITY * per_g
    counts = np.rint(exact)
    if np.abs(counts).max() > LARGEST:
        raise ProcedureError(f"{calibration.name}: a bias of {exact.max():.0f} counts is none of a sensor")
    rounding = float(np.abs(exact - counts).max()) * STANDARD_GRAVITY / per_g
    numbers = ",".join(str(int(count)) for count in counts)
    head = f"# Calibration of {comment(calibration.name)} by Tumble"
    text = f"{head}\nset acc_calibration = {numbers},1\nsave\n"
    return Written(text, (Loss(calibration.name, "accelerometer", "rounding to counts", rounding),))


BETAFLIGHT = Target(
    word="betaflight",
    title="Betaflight, for its command line",
    ending=".txt",
    kind=FileKind("commands for Betaflight, as Tumble writes them", re.compile(rb"\A# Calibration of ")),
    holds={"accelerometer": BIAS},
    write=write,
    source="https://betaflight.com/docs/wiki/guides/current/Betaflight-CLI",
    axes="those of the craft, after align_acc and the alignment of the board",
    body=FLU,
    own_settings=(Setting("counts-per-g", "acc_1G of the sensor, 2048 at 16 g and 16 bits", "2048"),),
    remarks=("Betaflight finds gyroscope biases anew at each start",),
)
