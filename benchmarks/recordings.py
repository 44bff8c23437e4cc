"""The same recording in every format, written as common loggers would."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from benchmarks.settings import ORDER, design_scenario
from tumble.foundation.recording import Chunk, FloatArray
from tumble.logs import open_writer
from tumble.tools.simulate import simulate_turntable

PIECE = 50_000
"""Samples written at a time."""
TOPIC = "/imu/data"
TOUR_SECONDS = 6 * 15.0


def tours_of(tours: int, seed: int) -> Chunk:
    """Simulates a session that visits the six poses again and again, 18 000 samples a tour."""
    base = design_scenario()
    scenario = replace(base, seed=seed, visits=ORDER * tours, mounting_angle_deg=1.0)
    samples = simulate_turntable(scenario).target_units[0].samples
    return Chunk(samples.time, samples.accelerometer, samples.gyroscope)


def pieces(chunk: Chunk) -> Iterator[Chunk]:
    """Cuts a recording into the portions it is written in."""
    for start in range(0, len(chunk), PIECE):
        rows = slice(start, start + PIECE)
        yield Chunk(chunk.time[rows], chunk.accelerometer[rows], chunk.gyroscope[rows])


def _write_table(path: Path, chunk: Chunk) -> None:
    with open_writer(path) as writer:
        for piece in pieces(chunk):
            writer.write(piece)


def _stamps(time: FloatArray) -> NDArray[np.int64]:
    nanoseconds: NDArray[np.int64] = np.rint(time * 1e9).astype(np.int64) + 1_700_000_000_000_000_000
    return nanoseconds


def imu_messages(template: bytes, chunk: Chunk) -> list[bytes]:
    """Messages of sensor_msgs/Imu, patterned on one that was serialised.

    In ROS 1 and ROS 2 alike the stamp stands in bytes 4 to 12 and the 37 numbers at the end.
    """
    raw = np.tile(np.frombuffer(template, np.uint8), (len(chunk), 1))
    seconds, nanoseconds = np.divmod(_stamps(chunk.time), 1_000_000_000)
    raw[:, 4:12] = np.column_stack([seconds, nanoseconds]).astype("<u4").view(np.uint8)
    numbers = np.zeros((len(chunk), 37))
    numbers[:, 13:16], numbers[:, 25:28] = chunk.gyroscope, chunk.accelerometer
    raw[:, -37 * 8 :] = numbers.view(np.uint8)
    return [row.tobytes() for row in raw]


def _write_ros1(path: Path, chunk: Chunk) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    with Ros1Writer(path) as writer:
        connection = writer.add_connection(TOPIC, "sensor_msgs/msg/Imu", typestore=store)
        template = bytes(store.serialize_ros1(_message(store), connection.msgtype))
        for piece in pieces(chunk):
            for stamp, data in zip(_stamps(piece.time).tolist(), imu_messages(template, piece), strict=True):
                writer.write(connection, stamp, data)


def _write_ros2(path: Path, chunk: Chunk) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Ros2Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection(TOPIC, "sensor_msgs/msg/Imu", typestore=store)
        template = bytes(store.serialize_cdr(_message(store), connection.msgtype))
        for piece in pieces(chunk):
            for stamp, data in zip(_stamps(piece.time).tolist(), imu_messages(template, piece), strict=True):
                writer.write(connection, stamp, data)


def _message(store: Typestore) -> object:
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    sequence = (
        {"seq": 0} if "seq" in (field for field, _ in store.fielddefs["std_msgs/msg/Header"][1]) else {}
    )
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="case", **sequence)
    vector, nine = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0), np.zeros(9)
    level = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    message: object = types["sensor_msgs/msg/Imu"](header, level, nine, vector, nine, vector, nine)
    return message


FORMATS: dict[str, tuple[str, Callable[[Path, Chunk], None]]] = {
    "CSV": ("log.csv", _write_table),
    "Parquet": ("log.parquet", _write_table),
    "MCAP": ("log.mcap", _write_table),
    "ROS 2 bag (db3)": ("log", _write_ros2),
    "ROS 1 bag": ("log.bag", _write_ros1),
}
"""File or folder name, and how it is written."""
