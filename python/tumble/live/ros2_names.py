"""Names of ROS 2 on the wire, whatever carries it: domains and types."""

from __future__ import annotations

import os
import re
from typing import Final

from tumble.foundation.errors import LogError
from tumble.foundation.numbers import whole_number
from tumble.live.address import Address

IMU_TYPE: Final = "sensor_msgs::msg::dds_::Imu_"
"""Type of `sensor_msgs/Imu`: design.ros2.org, "Topic and Service name mapping to DDS"."""
FIELD_TYPE: Final = "sensor_msgs::msg::dds_::MagneticField_"
"""Type of `sensor_msgs/MagneticField`."""
MOST_DOMAIN: Final = 232
"""Largest number of a domain whose ports exist."""
_MANGLED: Final = re.compile(r"(?P<package>\w+)::(?P<kind>\w+)::dds_::(?P<name>\w+)_")


def ros_domain(address: Address) -> int:
    """Returns the domain of an address, else that of ROS_DOMAIN_ID, else 0; `LogError` where it is none."""
    text = address.settings.get("domain", os.environ.get("ROS_DOMAIN_ID", "") or "0")
    number = whole_number(text)
    if number is None or number > MOST_DOMAIN:
        raise LogError(f"{address.text}: domain {text!r}: give a number from 0 to {MOST_DOMAIN}")
    return number


def ros_name(mangled: str) -> str:
    """Returns a type as ROS names it, `sensor_msgs/msg/Imu`; one of another kind as it is."""
    found = _MANGLED.fullmatch(mangled)
    return f"{found['package']}/{found['kind']}/{found['name']}" if found else mangled
