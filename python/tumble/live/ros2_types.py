"""`sensor_msgs/Imu` and `sensor_msgs/MagneticField` as ROS 2 names them on DDS, for CycloneDDS.

Names are those of design.ros2.org, "Topic and Service name mapping to DDS": `::msg::dds_::` before the type
and an underscore behind it.
"""

# Without annotations of the future, which CycloneDDS would have to find by the names of this module.
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, uint32

from tumble.live.ros2_names import FIELD_TYPE, IMU_TYPE

if TYPE_CHECKING:
    Covariance: TypeAlias = Sequence[float]
else:
    Covariance = array[float64, 9]


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    """Time since the epoch of its clock."""

    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    """Stamp and frame of a message."""

    stamp: Time
    frame_id: str


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    """Orientation."""

    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    """Three components."""

    x: float64
    y: float64
    z: float64


@dataclass
class ImuMessage(IdlStruct, typename=IMU_TYPE):
    """A sample, m/s^2 and rad/s; a covariance that begins with -1 states that there is no such quantity."""

    header: Header
    orientation: Quaternion
    orientation_covariance: Covariance
    angular_velocity: Vector3
    angular_velocity_covariance: Covariance
    linear_acceleration: Vector3
    linear_acceleration_covariance: Covariance


@dataclass
class FieldMessage(IdlStruct, typename=FIELD_TYPE):
    """A reading of a magnetometer, T; a covariance of zeros is not known."""

    header: Header
    magnetic_field: Vector3
    magnetic_field_covariance: Covariance
