"""Bags of ROS 1 and ROS 2, and MCAP, written as others write them."""

from __future__ import annotations

import numpy as np
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

MAGNETIC = "sensor_msgs/msg/MagneticField"
IMU, TEXT, TEMPERATURE = "sensor_msgs/msg/Imu", "std_msgs/msg/String", "sensor_msgs/msg/Temperature"
ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)


def header(store, time, frame):
    nanoseconds = round(time * 1e9)
    stamp = store.types["builtin_interfaces/msg/Time"](nanoseconds // 10**9, nanoseconds % 10**9)
    make = store.types["std_msgs/msg/Header"]
    has_count = "seq" in make.__dataclass_fields__  # that of ROS 1
    return make(seq=0, stamp=stamp, frame_id=frame) if has_count else make(stamp=stamp, frame_id=frame)


def imu_message(store, chunk, index, frame="imu_link", stamped=True):
    vector, quaternion = store.types["geometry_msgs/msg/Vector3"], store.types["geometry_msgs/msg/Quaternion"]
    none = np.zeros(9)
    return store.types[IMU](
        header=header(store, chunk.time[index] if stamped else 0.0, frame),
        orientation=quaternion(0.0, 0.0, 0.0, 1.0),
        orientation_covariance=none,
        angular_velocity=vector(*chunk.gyroscope[index]),
        angular_velocity_covariance=none,
        linear_acceleration=vector(*chunk.accelerometer[index]),
        linear_acceleration_covariance=none,
    )


def magnetic_message(store, time, field):
    """MagneticField with (3,) T at a time, s."""
    vector = store.types["geometry_msgs/msg/Vector3"](*field)
    return store.types[MAGNETIC](header(store, time, "mag_link"), vector, np.zeros(9))


def magnetic_messages(store, topic, track):
    """Messages of the magnetometer of a track, in T."""
    serialise = store.serialize_ros1 if store is ROS1 else store.serialize_cdr
    for time, field in zip(track.time, track.field * 1e-6, strict=True):
        message = magnetic_message(store, time, field)
        yield topic, MAGNETIC, round(time * 1e9), bytes(serialise(message, MAGNETIC))


def messages(store, topics, stamped=True, frames=("imu_link",), magnetic=None):
    """Messages of several IMUs in the order of time, with a text topic between."""
    for topic, track in (magnetic or {}).items():
        yield from magnetic_messages(store, topic, track)
    serialise = store.serialize_ros1 if store is ROS1 else store.serialize_cdr
    count = max(len(chunk.time) for chunk in topics.values())
    for index in range(count):
        for topic, chunk in topics.items():
            if index < len(chunk.time):
                message = imu_message(store, chunk, index, frames[index % len(frames)], stamped)
                yield topic, IMU, round(chunk.time[index] * 1e9), bytes(serialise(message, IMU))
                if chunk.temperature is not None:
                    degrees = store.types[TEMPERATURE](
                        header(store, chunk.time[index], "imu_link"), chunk.temperature[index], 0.0
                    )
                    stamp = round(chunk.time[index] * 1e9)
                    yield f"{topic}/temperature", TEMPERATURE, stamp, bytes(serialise(degrees, TEMPERATURE))
        text = store.types[TEXT]("hello" * (index % 7))
        yield "/chatter", TEXT, round(index * 1e7), bytes(serialise(text, TEXT))


def write_bag(path, writer, store, topics, **kwargs):
    with writer:
        connections = {}
        for topic, kind, stamp, data in messages(store, topics, **kwargs):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], stamp, data)
    return path


def write_ros1(path, topics, compression=None, **kwargs):
    writer = Writer1(path)
    if compression:
        writer.set_compression(compression)
    return write_bag(path, writer, ROS1, topics, **kwargs)


def write_ros2(path, topics, storage=StoragePlugin.SQLITE3, **kwargs):
    return write_bag(path, Writer2(path, version=9, storage_plugin=storage), ROS2, topics, **kwargs)


def write_mcap(path, topics, store=ROS2, profile="", **options):
    with path.open("wb") as file:
        writer = McapWriter(file, **options)
        writer.start(profile=profile)
        channels = {}
        for topic, kind, stamp, data in messages(store, topics):
            if topic not in channels:
                ros1 = store is ROS1
                text, _ = store.generate_msgdef(kind, ros_version=1 if ros1 else 2)
                name = kind.replace("/msg/", "/") if ros1 else kind
                schema = writer.register_schema(name, "ros1msg" if ros1 else "ros2msg", text.encode())
                channels[topic] = writer.register_channel(topic, "ros1" if ros1 else "cdr", schema)
            writer.add_message(channels[topic], stamp, data, stamp)
        writer.finish()
    return path
