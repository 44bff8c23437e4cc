"""All formats of other programs."""

from __future__ import annotations

import difflib

from tumble.foundation.errors import ProcedureError
from tumble.tools.exchange.ardupilot import ARDUPILOT
from tumble.tools.exchange.betaflight import BETAFLIGHT
from tumble.tools.exchange.c_source import C_SOURCE
from tumble.tools.exchange.device_record import RECORD, RECORD_C, RECORD_HEXADECIMAL
from tumble.tools.exchange.fusion import FUSION
from tumble.tools.exchange.imu_tk import IMU_TK_ACCELEROMETER, IMU_TK_GYROSCOPE
from tumble.tools.exchange.imucal import IMUCAL
from tumble.tools.exchange.kalibr import KALIBR, KALIBR_NOISE
from tumble.tools.exchange.offset_registers import REGISTERS
from tumble.tools.exchange.openvins import OPENVINS
from tumble.tools.exchange.px4 import PX4
from tumble.tools.exchange.robots import AUTOWARE, ROBOT_LOCALIZATION, ROS2
from tumble.tools.exchange.slam import FAST_LIO, LIO_SAM, ORB_SLAM, VINS
from tumble.tools.exchange.target import Target

TARGETS = {
    target.word: target
    for target in (
        PX4, ARDUPILOT, BETAFLIGHT, KALIBR, KALIBR_NOISE, OPENVINS, VINS, ORB_SLAM, LIO_SAM,
        FAST_LIO, IMU_TK_ACCELEROMETER, IMU_TK_GYROSCOPE, IMUCAL, AUTOWARE, ROBOT_LOCALIZATION, ROS2, FUSION,
        C_SOURCE, RECORD, RECORD_HEXADECIMAL, RECORD_C, *REGISTERS,
    )
}  # fmt: skip


def target(word: str) -> Target:
    """Finds a format; raises `ProcedureError` with the likely one where there is none of that name."""
    if word in TARGETS:
        return TARGETS[word]
    near = difflib.get_close_matches(word, TARGETS, 1)
    guess = f"did you mean {near[0]}?" if near else "see tumble export --format list"
    raise ProcedureError(f"--format {word}: no such format; {guess}")
