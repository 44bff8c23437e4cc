"""OpenVINS: `kalibr_imu_chain.yaml`, model `kalibr`.

OpenVINS corrects `w = R_GYROtoIMU Tw^-1 (w_m - b_g - Tg a)` and `a = R_ACCtoIMU Ta^-1 (a_m - b_a)`
(docs.openvins.com, propagation, inertial intrinsics; VioManagerOptions.h). All five matrices have to be
there, and as OpenCV reads the file, no comment may follow a value.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from tumble.calibration.document import Calibration
from tumble.foundation.files import FileKind
from tumble.tools.exchange.calibration_parts import MATRIX, frame_losses
from tumble.tools.exchange.filter_noise import NOISE_SETTINGS, noise_remarks
from tumble.tools.exchange.imu_chain import read_openvins
from tumble.tools.exchange.kalibr import (
    STREAM_SETTINGS,
    heading,
    noise_lines,
    own_axes,
    rows,
)
from tumble.tools.exchange.parameters import yaml_number
from tumble.tools.exchange.target import OWN_AXES, Settings, Target, Written


def write(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the chain of one IMU."""
    (calibration,) = calibrations
    axes = own_axes(calibration)
    lines = [
        "%YAML:1.0",
        *heading(calibration, settings, "OpenVINS"),
        "imu0:",
        *rows("T_i_b", np.eye(4)),
        *(f"  {line}" for line in noise_lines(calibration, settings)),
        f"  rostopic: {settings.topic('topic')}",
        "  time_offset: 0.0",
        f"  update_rate: {yaml_number(settings.positive_number('rate'))}",
        '  model: "kalibr"',
        *rows("Tw", axes.gyroscope),
        *rows("R_IMUtoGYRO", axes.gyroscope_from_frame),
        *rows("Ta", axes.accelerometer),
        *rows("R_IMUtoACC", np.eye(3)),
        *rows("Tg", axes.g_sensitivity),
    ]
    lost = frame_losses(calibration, axes.frame_from_case)
    return Written("\n".join(lines) + "\n", lost, noise_remarks(settings))


OPENVINS = Target(
    word="openvins",
    title="OpenVINS IMU chain, kalibr_imu_chain.yaml",
    ending=".yaml",
    kind=FileKind("an IMU chain of OpenVINS", re.compile(rb"\A%YAML:1.0[^\n]*\n(\s|#[^\n]*\n)*imu\d+:\s")),
    holds={"accelerometer": MATRIX, "gyroscope": (*MATRIX, "g-sensitivity")},
    write=write,
    source="https://docs.openvins.com/gs-calibration.html",
    axes=OWN_AXES,
    own_settings=(*STREAM_SETTINGS, *NOISE_SETTINGS),
    read=read_openvins,
)
