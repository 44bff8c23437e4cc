"""Noise as VINS-Fusion and ORB-SLAM3 want it: keys of their settings files.

VINS-Mono and VINS-Fusion add `acc_n` once a sample, so that it is the density times the root of the rate, and
so for `acc_w`. ORB-SLAM3 takes densities and makes that of them itself (Tracking.cc).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import sqrt

from tumble.calibration.document import Calibration
from tumble.foundation.files import FileKind
from tumble.foundation.noise_terms import VINS as VINS_NAMES
from tumble.foundation.units import TRIADS
from tumble.tools.exchange.kalibr import NOISE_ONLY, NOISE_SETTINGS, noise_figures
from tumble.tools.exchange.parameters import yaml_number
from tumble.tools.exchange.remark_lines import comment
from tumble.tools.exchange.target import ANY_AXES, Setting, Settings, Target, Written

RATE = Setting("rate", "samples a second")
ORB_SLAM_NAMES = {
    "accelerometer": ("IMU.NoiseAcc", "IMU.AccWalk"),
    "gyroscope": ("IMU.NoiseGyro", "IMU.GyroWalk"),
}


def write_vins(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the four keys of VINS-Fusion."""
    (calibration,) = calibrations
    per_sample = sqrt(settings.positive_number("rate"))
    lines = [
        f"{name}: {per_sample * value:.6e}"
        for triad in TRIADS
        for name, value in zip(VINS_NAMES[triad], noise_figures(calibration, triad, settings), strict=True)
    ]
    return Written(_text(calibration, "VINS-Mono and VINS-Fusion", lines))


def write_orb_slam(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the keys of ORB-SLAM3."""
    (calibration,) = calibrations
    lines = [
        f"{name}: {value:.6e}"
        for triad in TRIADS
        for name, value in zip(
            ORB_SLAM_NAMES[triad], noise_figures(calibration, triad, settings), strict=True
        )
    ]
    rate = settings.positive_number("rate")
    return Written(_text(calibration, "ORB-SLAM3", [*lines, f"IMU.Frequency: {yaml_number(rate)}"]))


def _text(calibration: Calibration, program: str, lines: Sequence[str]) -> str:
    head = f"# Noise of {comment(calibration.name)}, root mean square over the axes, by Tumble for {program}."
    return "\n".join([head, *lines]) + "\n"


_KIND = FileKind("keys of noise, as Tumble writes them", re.compile(rb"\A# Noise of "))

VINS = Target(
    word="vins",
    title="VINS-Mono and VINS-Fusion, keys of noise",
    ending=".yaml",
    kind=_KIND,
    holds={},
    leaves_out=TRIADS,
    write=write_vins,
    source="https://github.com/HKUST-Aerial-Robotics/VINS-Fusion",
    axes=ANY_AXES,
    own_settings=(RATE, *NOISE_SETTINGS),
    remarks=(NOISE_ONLY,),
)
ORB_SLAM = Target(
    word="orb-slam3",
    title="ORB-SLAM3, keys of noise",
    ending=".yaml",
    kind=_KIND,
    holds={},
    leaves_out=TRIADS,
    write=write_orb_slam,
    source="https://github.com/UZ-SLAMLab/ORB_SLAM3/blob/master/Calibration_Tutorial.pdf",
    axes=ANY_AXES,
    own_settings=(RATE, *NOISE_SETTINGS),
    remarks=(
        NOISE_ONLY,
        "settings without File.version take IMU.Frequency as a whole number only: write it without a point",
    ),
)
