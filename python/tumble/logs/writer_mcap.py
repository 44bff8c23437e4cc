"""MCAP out: sensor_msgs/Imu, sensor_msgs/Temperature and sensor_msgs/MagneticField in ROS 2 CDR."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from mcap.writer import Writer
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from tumble.foundation.errors import OutputError
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk, FloatArray
from tumble.logs.mcap import FACTS

if TYPE_CHECKING:
    from tumble.logs.writer import Facts

IMU_TOPIC = "/imu/data"
TEMPERATURE_TOPIC = "/imu/temperature"
MAGNETIC_TOPIC = "/imu/mag"

_CDR_LITTLE_ENDIAN = np.frombuffer(b"\x00\x01\x00\x00", np.uint8)
_ORIENTATION_COVARIANCE, _RATE, _FORCE = 4, slice(13, 16), slice(25, 28)
_IMU_NUMBERS, _MAGNETIC_NUMBERS = 37, 12
_TESLA = 1e-6
"""T in a microtesla."""
_STAMPS = (0.0, 2.0**31)
"""Seconds that a ROS 2 stamp and an MCAP time can both hold."""


class McapWriter:
    """MCAP that ROS 2 tools and Foxglove open; it can hold several IMUs."""

    def __init__(self, file: BinaryIO, facts: Facts, path: Path) -> None:
        self._path = path
        self._facts = facts
        self._writer = Writer(file)
        self._writer.start(profile="ros2", library="tumble")
        self._channels: dict[str, int] = {}
        self._sequence = 0

    def write(
        self, chunk: Chunk, imu: str = "", arrival: FloatArray | None = None, frame: str | None = None
    ) -> None:
        """Appends a message a sample, and its temperature just before it.

        `imu` names one of several, which becomes its topic; `arrival` (n,) s is when each was received, the
        time of the sample if not given; `frame` that of this IMU, where they differ.
        """
        frame = self._facts.frame if frame is None else frame
        imu_topic, temperature_topic = (
            (f"/{imu}", f"/{imu}/temperature") if imu else (IMU_TOPIC, TEMPERATURE_TOPIC)
        )
        stamps = nanoseconds_of(chunk.time, self._path)
        logged = (stamps if arrival is None else nanoseconds_of(arrival, self._path)).tolist()
        channels = [self._channel(imu_topic, "sensor_msgs/msg/Imu")]
        messages = [_bytes(stamps, frame, _imu_numbers(chunk))]
        if chunk.temperature is not None:
            numbers = np.column_stack([chunk.temperature, np.zeros(len(chunk))])
            channels.insert(0, self._channel(temperature_topic, "sensor_msgs/msg/Temperature"))
            messages.insert(0, _bytes(stamps, frame, numbers))
        for time, stamp, *sample in zip(logged, stamps.tolist(), *messages, strict=True):
            for channel, data in zip(channels, sample, strict=True):
                self._writer.add_message(channel, time, data, stamp, self._sequence)
            self._sequence = (self._sequence + 1) & 0xFFFFFFFF

    def write_magnetic(self, track: MagneticTrack, imu: str = "", frame: str | None = None) -> None:
        """Appends a message a reading of the magnetometer of an IMU, on `/imu/mag` or `/IMU/mag`."""
        if not len(track):
            return
        channel = self._channel(f"/{imu}/mag" if imu else MAGNETIC_TOPIC, "sensor_msgs/msg/MagneticField")
        stamps = nanoseconds_of(track.time, self._path)
        numbers = np.zeros((len(track), _MAGNETIC_NUMBERS))
        numbers[:, :3] = track.field * _TESLA
        messages = _bytes(stamps, self._facts.frame if frame is None else frame, numbers)
        for stamp, data in zip(stamps.tolist(), messages, strict=True):
            self._writer.add_message(channel, stamp, data, stamp, self._sequence)
            self._sequence = (self._sequence + 1) & 0xFFFFFFFF

    def write_message(self, topic: str, message_type: str, definition: str, stamp: int, data: bytes) -> None:
        """Appends a message; its type is defined with all that it consists of, its stamp is ns."""
        self._writer.add_message(self._channel(topic, message_type, definition), stamp, data, stamp)

    def close(self) -> None:
        """Writes what is known beside the samples, and the index."""
        self._writer.add_metadata(FACTS, self._facts.of_the_samples())
        self._writer.finish()  # type: ignore[no-untyped-call]

    def _channel(self, topic: str, message_type: str, definition: str = "") -> int:
        if topic not in self._channels:
            if not definition:
                definition, _ = get_typestore(Stores.ROS2_HUMBLE).generate_msgdef(message_type, ros_version=2)
            schema = self._writer.register_schema(message_type, "ros2msg", definition.encode())
            self._channels[topic] = self._writer.register_channel(topic, "cdr", schema)
        return self._channels[topic]


def nanoseconds_of(time: FloatArray, path: Path) -> NDArray[np.int64]:
    """Whole seconds apart from the rest, so that times from 1970 on keep all their digits.

    Raises `OutputError` where stamps cannot hold them.
    """
    first, last = float(time.min()), float(time.max())
    if not (_STAMPS[0] <= first and last < _STAMPS[1]):
        raise OutputError(
            f"{path}: its stamps hold 0 s to 2^31 s, not {first:.9g} s to {last:.9g} s; "
            "write CSV or Parquet instead"
        )
    whole = np.floor(time)
    return whole.astype(np.int64) * 1_000_000_000 + np.rint((time - whole) * 1e9).astype(np.int64)


def _imu_numbers(chunk: Chunk) -> FloatArray:
    """(n, 37) numbers of sensor_msgs/Imu; covariance unknown is 0, no orientation is -1 (Imu.msg)."""
    numbers = np.zeros((len(chunk), _IMU_NUMBERS))
    numbers[:, _ORIENTATION_COVARIANCE] = -1.0
    numbers[:, _RATE] = chunk.gyroscope
    numbers[:, _FORCE] = chunk.accelerometer
    return numbers


def _bytes(stamps: NDArray[np.int64], frame: str, numbers: FloatArray) -> list[bytes]:
    """CDR of messages that are a header and numbers: see `rosmsg`."""
    name = frame.encode() + b"\x00"
    padding = -(12 + len(name)) % 8
    layout = np.dtype(
        [
            ("head", np.uint8, (4,)),
            ("seconds", "<i4"),
            ("nanoseconds", "<u4"),
            ("length", "<u4"),
            ("name", np.uint8, (len(name) + padding,)),
            ("numbers", "<f8", (numbers.shape[1],)),
        ]
    )
    messages = np.zeros(len(stamps), layout)
    messages["head"] = _CDR_LITTLE_ENDIAN
    messages["seconds"], messages["nanoseconds"] = np.divmod(stamps, 1_000_000_000)
    messages["length"] = len(name)
    messages["name"][:, : len(name)] = np.frombuffer(name, np.uint8)
    messages["numbers"] = numbers
    data = messages.tobytes()
    return [data[start : start + layout.itemsize] for start in range(0, len(data), layout.itemsize)]
