"""MCAP files and bags with JSON, protocol buffers, and messages that embed sensor_msgs/Imu."""

from __future__ import annotations

import json

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from bag_fixtures import header, imu_message

STATE = "robot_msgs/msg/State"
STATE_TEXT = """std_msgs/Header header
string mode
float64[] joints
sensor_msgs/Imu front
sensor_msgs/Imu rear
float32 battery
"""
RAW = "vehicle_msgs/msg/RawImu"
RAW_TEXT = "uint64 timestamp_us\nfloat64[3] gyro_rad\nfloat64[3] accelerometer_m_s2\nfloat64 temperature\n"


def stores(version):
    """A store that knows these messages beside those of ROS."""
    store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(STATE_TEXT, STATE))
    store.register(get_types_from_msg(RAW_TEXT, RAW))
    return store


def state_messages(version, chunk):
    """Robots' states with two IMUs: one measures `chunk`, the other the same turned round."""
    store = stores(version)
    serialise = store.serialize_ros1 if version == 1 else store.serialize_cdr
    for index in range(len(chunk)):
        front, rear = imu_message(store, chunk, index), imu_message(store, chunk, index)
        rear.linear_acceleration.z *= -1.0
        message = store.types[STATE](
            header(store, chunk.time[index], "base"),
            "walk" * (index % 3),
            np.arange(index % 5, dtype=float),
            front,
            rear,
            12.5,
        )
        yield round(chunk.time[index] * 1e9), bytes(serialise(message, STATE))


def raw_messages(chunk):
    store = stores(2)
    for index in range(len(chunk)):
        stamp = round(chunk.time[index] * 1e6)
        message = store.types[RAW](
            stamp, chunk.gyroscope[index].copy(), chunk.accelerometer[index].copy(), chunk.temperature[index]
        )
        yield 1000 * stamp, bytes(store.serialize_cdr(message, RAW))


def write_state_bag(path, version, chunk, topic="/state"):
    writer = Writer1(path) if version == 1 else Writer2(path, version=9)
    with writer:
        connection = writer.add_connection(topic, STATE, typestore=stores(version))
        for stamp, data in state_messages(version, chunk):
            writer.write(connection, stamp, data)
    return path


def write_messages(path, encoding, messages, schema=("", "", b""), topic="/imu", **options):
    """Writes an MCAP file of one topic."""
    with path.open("wb") as file:
        writer = McapWriter(file, **options)
        writer.start()
        schema_id = writer.register_schema(*schema) if schema[0] else 0
        channel = writer.register_channel(topic, encoding, schema_id)
        for stamp, data in messages:
            writer.add_message(channel, stamp, data, stamp)
        writer.finish()
    return path


def json_messages(chunk):
    for index in range(len(chunk)):
        stamp = round(chunk.time[index] * 1e9)
        yield (
            stamp,
            json.dumps(
                {
                    "timestamp": {"sec": stamp // 10**9, "nsec": stamp % 10**9},
                    "frame_id": "imu_link",
                    "linear_acceleration": dict(zip("xyz", chunk.accelerometer[index], strict=True)),
                    "angular_velocity": dict(zip("xyz", chunk.gyroscope[index], strict=True)),
                    "temperature": chunk.temperature[index],
                }
            ).encode(),
        )


def imu_descriptors():
    """The schema of a message with a stamp, two vectors and a temperature, as MCAP keeps it."""
    from google.protobuf import timestamp_pb2

    files = descriptor_pb2.FileDescriptorSet()
    own = descriptor_pb2.FileDescriptorProto(
        name="imu.proto", package="demo", syntax="proto3", dependency=["google/protobuf/timestamp.proto"]
    )
    vector = own.message_type.add(name="Vector3")
    for number, name in enumerate("xyz", start=1):
        vector.field.add(name=name, number=number, type=1, label=1)
    imu = own.message_type.add(name="Imu")
    for number, (name, kind) in enumerate(
        [
            ("timestamp", ".google.protobuf.Timestamp"),
            ("linear_acceleration", ".demo.Vector3"),
            ("angular_velocity", ".demo.Vector3"),
        ],
        start=1,
    ):
        imu.field.add(name=name, number=number, type=11, label=1, type_name=kind)
    imu.field.add(name="temperature", number=4, type=1, label=1)
    imu.field.add(name="frame_id", number=5, type=9, label=1)
    stamp = descriptor_pb2.FileDescriptorProto()
    timestamp_pb2.DESCRIPTOR.CopyToProto(stamp)
    files.file.extend([own, stamp])  # what it depends on comes behind it, as some writers have it
    return files


def protobuf_messages(chunk):
    pool = descriptor_pool.DescriptorPool()
    for file in reversed(imu_descriptors().file):
        pool.Add(file)
    make = message_factory.GetMessageClass(pool.FindMessageTypeByName("demo.Imu"))
    for index in range(len(chunk)):
        stamp = round(chunk.time[index] * 1e9)
        message = make(temperature=chunk.temperature[index], frame_id="imu_link")
        message.timestamp.seconds, message.timestamp.nanos = divmod(stamp, 10**9)
        for number, axis in enumerate("xyz"):
            setattr(message.linear_acceleration, axis, chunk.accelerometer[index, number])
            setattr(message.angular_velocity, axis, chunk.gyroscope[index, number])
        yield stamp, message.SerializeToString()


def write_json(path, chunk, **options):
    return write_messages(path, "json", json_messages(chunk), ("demo.Imu", "jsonschema", b"{}"), **options)


def write_protobuf(path, chunk, **options):
    schema = ("demo.Imu", "protobuf", imu_descriptors().SerializeToString())
    return write_messages(path, "protobuf", protobuf_messages(chunk), schema, **options)


def write_raw(path, chunk):
    return write_messages(path, "cdr", raw_messages(chunk), (RAW, "ros2msg", RAW_TEXT.encode()))
