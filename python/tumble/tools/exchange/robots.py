"""ROS 2: parameters of Autoware's corrector, plain ones for a node of one's own, covariances of a message."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from math import sqrt

import numpy as np

from tumble.calibration.document import Calibration, MagnetometerCalibration
from tumble.foundation.body_axes import FLU
from tumble.foundation.errors import ProcedureError
from tumble.foundation.files import FileKind
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS
from tumble.tools.exchange.calibration_parts import BIAS, MATRIX
from tumble.tools.exchange.filter_noise import (
    NOISE_ONLY,
    NOISE_SETTINGS,
    RATE,
    noise_figures,
    noise_in_words,
    noise_remarks,
)
from tumble.tools.exchange.imu_chain import MAGNETIC_LOADS, TESLA, read_autoware, read_ros2
from tumble.tools.exchange.parameters import yaml_number
from tumble.tools.exchange.remark_lines import comment
from tumble.tools.exchange.target import ANY_AXES, Settings, Target, Written

MESSAGE_FIELDS = ("linear_acceleration", "angular_velocity")
"""Fields of `sensor_msgs/Imu`, in the order of the triads."""
_HEAD = ["/**:", "  ros__parameters:"]


def write_autoware(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes `imu_corrector.param.yaml`: Autoware subtracts the offset of angular velocity."""
    (calibration,) = calibrations
    if calibration.gyroscope is None:
        raise ProcedureError(f"{calibration.name}: has no gyroscope section, which is all Autoware corrects")
    lines = [f"# Calibration of {comment(calibration.name)} by Tumble for Autoware's imu_corrector.", *_HEAD]
    for axis, value in zip("xyz", calibration.gyroscope.b, strict=True):
        lines.append(f"    angular_velocity_offset_{axis}: {float(value):.9e}")
    force, turning = _sigmas_of_sample(calibration, settings)
    lines += [f"    angular_velocity_stddev_{axis}{axis}: {turning:.6e}" for axis in "xyz"]
    lines.append(f"    acceleration_stddev: {force:.6e}")
    # Without this, newer versions subtract nothing; older ones do not know it, and subtract always.
    lines += ["    on_off_correction:", "      correct_for_static_bias: true"]
    return Written("\n".join(lines) + "\n", remarks=noise_remarks(settings))


def _sigmas_of_sample(calibration: Calibration, settings: Settings) -> list[float]:
    """Returns the sigma of a sample of each triad, N sqrt(r)."""
    root = sqrt(settings.positive_number(RATE.name))
    return [root * noise_figures(calibration, triad, settings)[0] for triad in TRIADS]


def write_message(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes the covariances of `sensor_msgs/Imu`, 3 x 3 row by row, as its fields are named."""
    (calibration,) = calibrations
    head = (
        f"# Noise of {comment(calibration.name)}, {noise_in_words(settings)}, by Tumble for sensor_msgs/Imu."
    )
    lines = [
        _array(f"{field}_covariance", sigma**2 * np.eye(3)).strip()
        for field, sigma in zip(MESSAGE_FIELDS, _sigmas_of_sample(calibration, settings), strict=True)
    ]
    return Written("\n".join([head, *lines]) + "\n", remarks=noise_remarks(settings))


def write_ros2(calibrations: Sequence[Calibration], settings: Settings) -> Written:
    """Writes correction and bias of both triads as arrays of parameters."""
    (calibration,) = calibrations
    lines = [
        f"# Calibration of {comment(calibration.name)} by Tumble: u = C (y - b), C row by row;",
        "# of the gyroscope u = C (y - b - G f), f the corrected specific force; of the",
        "# magnetometer u = C (y - b - c I), I in A, or c of a throttle from 0 to 1. SI units, and tesla.",
        *_HEAD,
    ]
    for triad in TRIADS:
        if (section := getattr(calibration, triad)) is not None:
            lines.append(_array(f"{triad}_correction", np.linalg.inv(section.M)))
            lines.append(_array(f"{triad}_bias", section.b))
    if calibration.magnetometer is not None:
        lines += _magnetometer(calibration.magnetometer)
    gyroscope = calibration.gyroscope
    response = None if gyroscope is None else gyroscope.g_sensitivity
    lines.append(_array("gyroscope_g_sensitivity", np.zeros(9) if response is None else response))
    return Written("\n".join(lines) + "\n")


def _magnetometer(section: MagnetometerCalibration) -> Iterator[str]:
    """Yields a magnetometer for readings in tesla, as messages have them."""
    yield _array("magnetometer_correction", np.asarray(np.linalg.inv(section.M), np.float64))
    yield _array("magnetometer_bias", section.b / TESLA)
    if section.current is not None:
        yield _array(MAGNETIC_LOADS[section.current_unit], section.current / TESLA)


def _array(name: str, values: FloatArray) -> str:
    return f"    {name}: [{', '.join(map(yaml_number, values.ravel()))}]"


_AUTOWARE_KIND = FileKind(
    "parameters of Autoware's imu_corrector", re.compile(rb"^\s+angular_velocity_offset_x:", re.MULTILINE)
)
_ROS2_KIND = FileKind(
    "a calibration in parameters of ROS 2",
    re.compile(rb"^\s+(accelerometer|gyroscope|magnetometer)_correction:", re.MULTILINE),
)

AUTOWARE = Target(
    word="autoware",
    title="Autoware, imu_corrector.param.yaml",
    ending=".param.yaml",
    kind=_AUTOWARE_KIND,
    holds={"gyroscope": BIAS},
    write=write_autoware,
    source="https://github.com/autowarefoundation/autoware_universe/tree/main/sensing/autoware_imu_corrector",
    axes="those of the IMU's topic, by REP 103, before tf turns into base_link",
    body=FLU,
    own_settings=(RATE, *NOISE_SETTINGS),
    read=read_autoware,
)
ROBOT_LOCALIZATION = Target(
    word="robot-localization",
    title="robot_localization, covariances of sensor_msgs/Imu",
    ending=".yaml",
    kind=FileKind(
        "covariances of sensor_msgs/Imu", re.compile(rb"^linear_acceleration_covariance:", re.MULTILINE)
    ),
    holds={},
    leaves_out=TRIADS,
    write=write_message,
    source="https://github.com/cra-ros-pkg/robot_localization/blob/ros2/doc/preparing_sensor_data.rst",
    axes=ANY_AXES,
    own_settings=(RATE, *NOISE_SETTINGS),
    remarks=(
        NOISE_ONLY,
        "robot_localization has no parameter of noise: the driver sends these in the message",
    ),
)
ROS2 = Target(
    word="ros2",
    title="ROS 2 parameters, for a node of your own",
    ending=".yaml",
    kind=_ROS2_KIND,
    holds={
        "accelerometer": (*BIAS, *MATRIX),
        "gyroscope": (*BIAS, *MATRIX, "g-sensitivity"),
        "magnetometer": (*BIAS, *MATRIX),
    },
    write=write_ros2,
    source="https://docs.ros.org/en/rolling/How-To-Guides/Using-ros2-param.html",
    axes="those of the IMU's topic, by REP 103",
    body=FLU,
    read=read_ros2,
)
