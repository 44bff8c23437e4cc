"""Noise as odometry by camera or lidar wants it: keys of the settings files of each program.

With N and K the densities of white noise and of random walk, and r the rate:

- VINS-Mono and VINS-Fusion add `acc_n` once a sample: N sqrt(r), and K sqrt(r) for `acc_w`.
- ORB-SLAM3 makes that of the densities itself (Tracking.cc): N and K.
- LIO-SAM hands densities to GTSAM's preintegration (imuPreintegration.cpp): N and K.
- FAST-LIO adds `(dt)^2 Q` once a sample (esekfom.hpp, predict): N^2 r and K^2 r.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import TypeAlias

from tumble.calibration.document import Calibration
from tumble.foundation.files import FileKind
from tumble.foundation.noise_terms import VINS as VINS_NAMES
from tumble.foundation.units import TRIADS, Triad
from tumble.tools.exchange.filter_noise import (
    NOISE_ONLY,
    NOISE_SETTINGS,
    RATE,
    noise_figures,
    noise_in_words,
    noise_remarks,
)
from tumble.tools.exchange.parameters import yaml_number
from tumble.tools.exchange.remark_lines import comment
from tumble.tools.exchange.target import ANY_AXES, Settings, Target, Written

ORB_SLAM_NAMES: Mapping[Triad, tuple[str, str]] = {
    "accelerometer": ("IMU.NoiseAcc", "IMU.AccWalk"),
    "gyroscope": ("IMU.NoiseGyro", "IMU.GyroWalk"),
}
LIO_SAM_NAMES: Mapping[Triad, tuple[str, str]] = {
    "accelerometer": ("imuAccNoise", "imuAccBiasN"),
    "gyroscope": ("imuGyrNoise", "imuGyrBiasN"),
}
FAST_LIO_NAMES: Mapping[Triad, tuple[str, str]] = {
    "accelerometer": ("acc_cov", "b_acc_cov"),
    "gyroscope": ("gyr_cov", "b_gyr_cov"),
}

_Figure: TypeAlias = Callable[[float, float], float]
"""Figure of a program, of a density and the rate."""


@dataclass(frozen=True, slots=True)
class _Keys:
    """Keys of noise in the settings of a program."""

    program: str
    names: Mapping[Triad, tuple[str, str]]
    """Keys of N and K."""
    figure: _Figure
    above: str = ""
    """Key that the others stand under, if any."""
    rate_name: str = ""
    """Key of the rate, if any."""

    def write(self, calibrations: Sequence[Calibration], settings: Settings) -> Written:
        """Writes the keys of one calibration."""
        (calibration,) = calibrations
        rate = settings.positive_number(RATE.name)
        indent = "  " if self.above else ""
        lines = [
            f"{indent}{name}: {self.figure(value, rate):.6e}"
            for triad in TRIADS
            for name, value in zip(
                self.names[triad], noise_figures(calibration, triad, settings), strict=True
            )
        ]
        noise = f"Noise of {comment(calibration.name)}, {noise_in_words(settings)}"
        above = [f"{self.above}:"] if self.above else []
        last = [f"{self.rate_name}: {yaml_number(rate)}"] if self.rate_name else []
        return Written(
            "\n".join([f"# {noise}, by Tumble for {self.program}.", *above, *lines, *last]) + "\n",
            remarks=noise_remarks(settings),
        )


def _density(value: float, rate: float) -> float:
    return value


def _per_sample(value: float, rate: float) -> float:
    return sqrt(rate) * value


def _variance_per_sample(value: float, rate: float) -> float:
    return rate * value**2


_KIND = FileKind("keys of noise, as Tumble writes them", re.compile(rb"\A# Noise of "))


def _target(word: str, keys: _Keys, source: str, *remarks: str) -> Target:
    return Target(
        word=word,
        title=f"{keys.program}, keys of noise",
        ending=".yaml",
        kind=_KIND,
        holds={},
        leaves_out=TRIADS,
        write=keys.write,
        source=source,
        axes=ANY_AXES,
        own_settings=(RATE, *NOISE_SETTINGS),
        remarks=(NOISE_ONLY, *remarks),
    )


VINS = _target(
    "vins",
    _Keys("VINS-Mono and VINS-Fusion", VINS_NAMES, _per_sample),
    "https://github.com/HKUST-Aerial-Robotics/VINS-Fusion",
)
ORB_SLAM = _target(
    "orb-slam3",
    _Keys("ORB-SLAM3", ORB_SLAM_NAMES, _density, rate_name="IMU.Frequency"),
    "https://github.com/UZ-SLAMLab/ORB_SLAM3/blob/master/Calibration_Tutorial.pdf",
    "settings without File.version take IMU.Frequency as a whole number only: write it without a point",
)
LIO_SAM = _target(
    "lio-sam",
    _Keys("LIO-SAM", LIO_SAM_NAMES, _density),
    "https://github.com/TixiaoShan/LIO-SAM/blob/master/config/params.yaml",
    "imuGravity, beside them, is to be the local gravity",
)
FAST_LIO = _target(
    "fast-lio",
    _Keys("FAST-LIO", FAST_LIO_NAMES, _variance_per_sample, above="mapping"),
    "https://github.com/hku-mars/FAST_LIO",
)
