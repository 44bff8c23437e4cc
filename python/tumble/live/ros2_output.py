"""Corrected samples as a topic of ROS 2, over DDS without ROS: `--to ros2:///imu/calibrated`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from cyclonedds.core import DDSException
from cyclonedds.pub import DataWriter

from tumble.foundation.errors import LogError, OutputError
from tumble.foundation.recording import Chunk
from tumble.foundation.units import FIELD_UNITS
from tumble.live.address import Address
from tumble.live.outputs import field_of
from tumble.live.ros2_domain import Domain
from tumble.live.ros2_types import FieldMessage, Header, ImuMessage, Quaternion, Time, Vector3
from tumble.logs.writer import Facts, Writer

FRAME = "imu"
_UNKNOWN = [0.0] * 9
_ABSENT = [-1.0, *[0.0] * 8]


@dataclass(frozen=True, slots=True)
class Ros2Output:
    """`sensor_msgs/Imu`, a message a sample, without orientation and with unknown covariances.

    Readings of a magnetometer are `sensor_msgs/MagneticField` on TOPIC/mag, or the topic of `magnetometer=`.
    """

    address: Address

    @property
    def name(self) -> str:
        """See `Output`."""
        return self.address.text

    @contextmanager
    def open(self, facts: Facts) -> Iterator[Writer]:
        """See `Output`."""
        topic = "/" + self.address.place.strip("/")
        magnetic = "/" + self.address.settings.get("magnetometer", f"{topic}/mag").strip("/")
        try:
            domain = Domain.join(self.address)
        except LogError as error:
            raise OutputError(str(error)) from error
        yield _Messages(self.address.text, domain, topic, magnetic)


class _Messages:
    """Sends on both topics, from the first samples on: these show whether there is a magnetometer."""

    def __init__(self, name: str, domain: Domain, topic: str, magnetic_topic: str) -> None:
        self._name = name
        self._domain = domain
        self._topic = topic
        self._magnetic_topic = magnetic_topic
        self._writer: DataWriter[ImuMessage] | None = None
        self._magnetic: DataWriter[FieldMessage] | None = None

    def write(self, chunk: Chunk) -> None:
        rows = zip(chunk.time.tolist(), chunk.accelerometer.tolist(), chunk.gyroscope.tolist(), strict=True)
        try:
            self._write_magnetic(chunk)
            if self._writer is None:
                self._writer = self._domain.writer(self._topic, ImuMessage)
            for time, force, rate in rows:
                self._writer.write(_message(time, force, rate))
        except DDSException as error:
            raise OutputError(f"{self._name}: cannot send: {error.msg}; check the network") from error

    def _write_magnetic(self, chunk: Chunk) -> None:
        """Sends readings, and announces their topic, before the samples beside them."""
        # Whoever finds the topic of the IMU finds that of its magnetometer then.
        field = field_of(chunk)
        if field is None:
            return
        if self._magnetic is None:
            self._magnetic = self._domain.writer(self._magnetic_topic, FieldMessage)
        rows = np.isfinite(field).all(axis=1)
        for time, reading in zip(chunk.time[rows].tolist(), field[rows].tolist(), strict=True):
            self._magnetic.write(_field_message(time, reading))

    def close(self) -> None: ...


def _header(time: float) -> Header:
    nanoseconds = max(0, round(1e9 * time))
    return Header(Time(*divmod(nanoseconds, 1_000_000_000)), FRAME)


def _message(time: float, force: list[float], rate: list[float]) -> ImuMessage:
    return ImuMessage(
        _header(time),
        Quaternion(0.0, 0.0, 0.0, 1.0),
        _ABSENT,
        Vector3(*rate),
        _UNKNOWN,
        Vector3(*force),
        _UNKNOWN,
    )


def _field_message(time: float, field: list[float]) -> FieldMessage:
    return FieldMessage(_header(time), Vector3(*(each / FIELD_UNITS["T"] for each in field)), _UNKNOWN)
