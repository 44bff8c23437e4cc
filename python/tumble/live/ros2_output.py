"""Corrected samples as a topic of ROS 2, over DDS without ROS: `--to ros2:///imu/calibrated`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from cyclonedds.core import DDSException
from cyclonedds.pub import DataWriter

from tumble.foundation.errors import LogError, OutputError
from tumble.foundation.recording import Chunk
from tumble.live.address import Address
from tumble.live.ros2_domain import Domain
from tumble.live.ros2_types import Header, ImuMessage, Quaternion, Time, Vector3
from tumble.logs.writer import Facts, Writer

FRAME = "imu"
_UNKNOWN = [0.0] * 9
_ABSENT = [-1.0, *[0.0] * 8]


@dataclass(frozen=True, slots=True)
class Ros2Output:
    """`sensor_msgs/Imu`, a message a sample, without orientation and with unknown covariances."""

    address: Address

    @property
    def name(self) -> str:
        """See `Output`."""
        return self.address.text

    @contextmanager
    def open(self, facts: Facts) -> Iterator[Writer]:
        """See `Output`."""
        try:
            writer = Domain.join(self.address).writer("/" + self.address.place.strip("/"))
        except (DDSException, LogError) as error:
            raise OutputError(str(error)) from error
        yield _Messages(self.address.text, writer)


class _Messages:
    def __init__(self, name: str, writer: DataWriter[ImuMessage]) -> None:
        self._name = name
        self._writer = writer

    def write(self, chunk: Chunk) -> None:
        rows = zip(chunk.time.tolist(), chunk.accelerometer.tolist(), chunk.gyroscope.tolist(), strict=True)
        try:
            for time, force, rate in rows:
                self._writer.write(_message(time, force, rate))
        except DDSException as error:
            raise OutputError(f"{self._name}: cannot send: {error.msg}; check the network") from error

    def close(self) -> None: ...


def _message(time: float, force: list[float], rate: list[float]) -> ImuMessage:
    nanoseconds = max(0, round(1e9 * time))
    stamp = Time(*divmod(nanoseconds, 1_000_000_000))
    return ImuMessage(
        Header(stamp, FRAME),
        Quaternion(0.0, 0.0, 0.0, 1.0),
        _ABSENT,
        Vector3(*rate),
        _UNKNOWN,
        Vector3(*force),
        _UNKNOWN,
    )
