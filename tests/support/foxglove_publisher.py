"""A server of Foxglove's own SDK that sends an IMU in several encodings until its standard input is closed.

python foxglove_publisher.py PORT RATE
"""

import json
import sys

import foxglove
from foxglove import Channel, Schema
from foxglove.channels import SceneUpdateChannel
from mcap_protobuf.schema import build_file_descriptor_set
from rosbags.typesys import Stores, get_typestore

import ros2_publisher
from made_up_protobuf import imu_message
from paced import numbers_at


def sample(number, rate):
    message = ros2_publisher.message(number, rate, False)
    force, turn = message.linear_acceleration, message.angular_velocity
    stamp = message.header.stamp
    return message, {
        "header": {"stamp": {"sec": stamp.sec, "nanosec": stamp.nanosec}},
        "linear_acceleration": {"x": force.x, "y": force.y, "z": force.z},
        "angular_velocity": {"x": turn.x, "y": turn.y, "z": turn.z},
    }


def main():
    port, rate = int(sys.argv[1]), float(sys.argv[2])
    newer = get_typestore(Stores.ROS2_HUMBLE)
    definition, _ = newer.generate_msgdef("sensor_msgs/msg/Imu", ros_version=2)
    schema = Schema(name="sensor_msgs/msg/Imu", encoding="ros2msg", data=definition.encode())
    ros = Channel("/imu/data", message_encoding="cdr", schema=schema)
    store = get_typestore(Stores.ROS1_NOETIC)
    older, _ = store.generate_msgdef("sensor_msgs/msg/Imu", ros_version=1)
    schema = Schema(name="sensor_msgs/Imu", encoding="ros1msg", data=older.encode())
    ros1 = Channel("/ros1", message_encoding="ros1", schema=schema)
    plain = Channel("json", message_encoding="json")
    SceneUpdateChannel("/scene")
    kind = imu_message()
    descriptors = build_file_descriptor_set(kind).SerializeToString()
    packed = Channel(
        "/packed",
        message_encoding="protobuf",
        schema=Schema(name=kind.DESCRIPTOR.full_name, encoding="protobuf", data=descriptors),
    )
    foxglove.start_server(host="127.0.0.1", port=port)
    print("serving", flush=True)
    for number in numbers_at(rate):
        message, content = sample(number, rate)
        packed_ros = bytes(message.serialize())
        ros.log(packed_ros)
        ros1.log(bytes(newer.cdr_to_ros1(packed_ros, "sensor_msgs/msg/Imu")))
        plain.log(json.dumps(content).encode())
        force, turn = content["linear_acceleration"], content["angular_velocity"]
        values = [*force.values(), *turn.values()]
        names = ("acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z")
        stamped = kind(time_us=round(1e6 * number / rate), **dict(zip(names, values, strict=True)))
        packed.log(stamped.SerializeToString())


if __name__ == "__main__":
    main()
