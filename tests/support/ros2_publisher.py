"""A driver of ROS 2 as others write it: sends `sensor_msgs/Imu` with types of its own, not with Tumble's.

python ros2_publisher.py TOPIC SAMPLES RATE reliable|best-effort [--absent] [--field TOPIC]

With --field every fifth sample has a reading of a magnetometer, 20 uT along x and its number along z.
"""

import math
import os
import sys
import threading
from dataclasses import dataclass
from itertools import islice

from cyclonedds.core import Listener, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from paced import numbers_at

LOOPBACK = """
<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces></General>
<Discovery>
<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address='localhost'/></Peers>
</Discovery>
</Domain></CycloneDDS>
"""
"""Settings for tests, which then need no network."""


@dataclass
class Stamp(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Head(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Stamp
    frame_id: str


@dataclass
class Four(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Three(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Message(IdlStruct, typename="sensor_msgs::msg::dds_::Imu_"):
    header: Head
    orientation: Four
    orientation_covariance: array[float64, 9]
    angular_velocity: Three
    angular_velocity_covariance: array[float64, 9]
    linear_acceleration: Three
    linear_acceleration_covariance: array[float64, 9]


@dataclass
class Magnetic(IdlStruct, typename="sensor_msgs::msg::dds_::MagneticField_"):
    header: Head
    magnetic_field: Three
    magnetic_field_covariance: array[float64, 9]


def magnetic(number, rate):
    stamp = message(number, rate, False).header
    return Magnetic(stamp, Three(20e-6, 0.0, 1e-6 * number), [0.0] * 9)


def message(number, rate, absent):
    nanoseconds = 1_700_000_000_000_000_000 + round(number * 1e9 / rate)
    phase = 2.0 * math.pi * number / rate
    return Message(
        Head(Stamp(*divmod(nanoseconds, 1_000_000_000)), "imu_link"),
        Four(0.0, 0.0, 0.0, 1.0),
        [-1.0] + [0.0] * 8,
        Three(0.01 * number, 0.2 * math.sin(phase), -0.3),
        [-1.0 if absent else 0.0] * 9,
        Three(0.5 * math.sin(phase), 0.001 * number, 9.81),
        [0.0] * 9,
    )


def main():
    topic, samples, rate, reliability = sys.argv[1:5]
    policy = Policy.Reliability.Reliable(duration(seconds=1))
    policy = policy if reliability == "reliable" else Policy.Reliability.BestEffort
    participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    qos = Qos(policy, Policy.History.KeepLast(1000))
    matched = threading.Event()

    class Matched(Listener):
        def on_publication_matched(self, _writer, _status):
            matched.set()

    about = Topic(participant, f"rt{topic}", Message)
    writer = DataWriter(participant, about, qos=qos, listener=Matched())
    field = None
    if "--field" in sys.argv:
        topic = sys.argv[sys.argv.index("--field") + 1]
        field = DataWriter(participant, Topic(participant, f"rt{topic}", Magnetic), qos=qos)
    print("there", flush=True)
    matched.wait()
    for number in islice(numbers_at(float(rate)), int(samples)):
        if field is not None and number % 5 == 0:
            field.write(magnetic(number, float(rate)))
        writer.write(message(number, float(rate), "--absent" in sys.argv))
    # Those that are on their way still arrive: it stays until nobody wants it any more.
    sys.stdin.read()


if __name__ == "__main__":
    main()
