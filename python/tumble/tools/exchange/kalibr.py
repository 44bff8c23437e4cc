"""Kalibr: noise and intrinsics of an IMU as `imu.yaml`, model `scale-misalignment`.

`a_m = M a` and `w_m = M C_gyro_i w + A C_gyro_i a` with M lower triangular (Rehder, Nikolic, Schneider,
Hinzmann and Siegwart, "Extending kalibr", 2016). So the frame is that of the accelerometer's own axes.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tumble.calibration.document import Calibration
from tumble.foundation.files import FileKind
from tumble.foundation.noise_terms import KALIBR as NOISE_NAMES
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS
from tumble.tools.exchange.calibration_parts import MATRIX, frame_losses, lower_and_rotation
from tumble.tools.exchange.filter_noise import (
    NOISE_ONLY,
    NOISE_SETTINGS,
    RATE,
    noise_figures,
    noise_in_words,
    noise_remarks,
)
from tumble.tools.exchange.imu_chain import read_kalibr, read_noise
from tumble.tools.exchange.parameters import yaml_number
from tumble.tools.exchange.remark_lines import comment
from tumble.tools.exchange.target import ANY_AXES, OWN_AXES, Setting, Settings, Target, Written

TOPIC = Setting("topic", "topic of the IMU", "/imu/data")
STREAM_SETTINGS = (RATE, TOPIC)


@dataclass(frozen=True, slots=True)
class OwnAxes:
    """A calibration in the frame of the accelerometer's own axes: x along its x, y in the plane of both."""

    accelerometer: FloatArray
    """(3, 3) lower triangular."""
    gyroscope: FloatArray
    """(3, 3) lower triangular."""
    gyroscope_from_frame: FloatArray
    """(3, 3) rotation."""
    g_sensitivity: FloatArray
    """(3, 3) rad/s per m/s^2 of specific force in the frame."""
    frame_from_case: FloatArray
    """(3, 3) rotation."""


def own_axes(calibration: Calibration) -> OwnAxes:
    """Turns a calibration into the frame of its accelerometer."""
    accelerometer, gyroscope = calibration.accelerometer, calibration.gyroscope
    ours = np.eye(3) if accelerometer is None else accelerometer.M
    lower, frame_from_case = lower_and_rotation(ours)
    theirs = np.eye(3) if gyroscope is None else gyroscope.M
    gyroscope_lower, rotation = lower_and_rotation(theirs @ frame_from_case.T)
    response = None if gyroscope is None else gyroscope.g_sensitivity
    turned = np.zeros((3, 3)) if response is None else response @ frame_from_case.T
    return OwnAxes(lower, gyroscope_lower, rotation, turned, frame_from_case)


def noise_lines(calibration: Calibration, settings: Settings) -> list[str]:
    """Returns the four figures of noise, `name: value`; raises the errors of `noise_figures`."""
    return [
        f"{name}: {value:.6e}"
        for triad in TRIADS
        for name, value in zip(NOISE_NAMES[triad], noise_figures(calibration, triad, settings), strict=True)
    ]


def write_noise(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes `imu.yaml`: noise alone."""
    (calibration,) = calibrations
    lines = [
        f"# Noise of {comment(calibration.name)}, {noise_in_words(settings)}, by Tumble.",
        *noise_lines(calibration, settings),
        f"rostopic: {settings.topic('topic')}",
        f"update_rate: {yaml_number(settings.positive_number('rate'))}",
    ]
    return Written("\n".join(lines) + "\n", remarks=noise_remarks(settings))


def write(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes an IMU chain of one IMU: noise and intrinsics."""
    (calibration,) = calibrations
    axes = own_axes(calibration)
    # A is applied to what C_gyro_i has turned already.
    response = axes.g_sensitivity @ axes.gyroscope_from_frame.T
    lines = [
        *heading(calibration, settings, "Kalibr"),
        "imu0:",
        *rows("T_i_b", np.eye(4)),
        *(f"  {line}" for line in noise_lines(calibration, settings)),
        "  time_offset: 0.0",
        f"  rostopic: {settings.topic('topic')}",
        f"  update_rate: {yaml_number(settings.positive_number('rate'))}",
        "  model: scale-misalignment",
        "  accelerometers:",
        *rows("  M", axes.accelerometer),
        "  gyroscopes:",
        *rows("  M", axes.gyroscope),
        *rows("  A", response),
        *rows("  C_gyro_i", axes.gyroscope_from_frame),
    ]
    lost = frame_losses(calibration, axes.frame_from_case)
    return Written("\n".join(lines) + "\n", lost, noise_remarks(settings))


def heading(calibration: Calibration, settings: Settings, program: str) -> list[str]:
    """Returns comments on what the program has no field for."""
    lines = [
        f"# Calibration of {comment(calibration.name)} by Tumble for {program}, in the axes of its "
        "accelerometer.",
        f"# Noise: {noise_in_words(settings)}.",
    ]
    for triad in TRIADS:
        if (section := getattr(calibration, triad)) is not None:
            bias = ", ".join(f"{value:.9g}" for value in section.b)
            lines.append(f"# Bias of the {triad}, to start from: [{bias}] {section.unit}")
    return lines


def rows(name: str, matrix: FloatArray) -> list[str]:
    """Returns a matrix under its name, a row a line."""
    # OpenCV reads no list that is not indented below its key.
    indent = " " * (len(name) - len(name.lstrip()) + 2)
    lines = (", ".join(map(yaml_number, row)) for row in matrix)
    return [f"  {name}:", *(f"  {indent}- [{line}]" for line in lines)]


_NOISE_KIND = FileKind(
    "noise of an IMU for Kalibr", re.compile(rb"^(accelerometer|gyroscope)_noise_density:", re.MULTILINE)
)
_CHAIN_KIND = FileKind("an IMU chain of Kalibr", re.compile(rb"\A(\s|#[^\n]*\n)*imu\d+:\s"))

KALIBR_NOISE = Target(
    word="kalibr-noise",
    title="Kalibr noise, imu.yaml",
    ending=".yaml",
    kind=_NOISE_KIND,
    holds={},
    leaves_out=TRIADS,
    remarks=(NOISE_ONLY,),
    write=write_noise,
    source="https://github.com/ethz-asl/kalibr/wiki/IMU-Noise-Model",
    axes=ANY_AXES,
    own_settings=(*STREAM_SETTINGS, *NOISE_SETTINGS),
    read=read_noise,
)
KALIBR = Target(
    word="kalibr",
    title="Kalibr noise and intrinsics, an IMU chain",
    ending=".yaml",
    kind=_CHAIN_KIND,
    holds={
        "accelerometer": MATRIX,
        "gyroscope": (*MATRIX, "g-sensitivity"),
    },
    write=write,
    source="https://github.com/ethz-asl/kalibr/wiki/Multi-IMU-and-IMU-intrinsic-calibration",
    axes=OWN_AXES,
    own_settings=(*STREAM_SETTINGS, *NOISE_SETTINGS),
    read=read_kalibr,
)
