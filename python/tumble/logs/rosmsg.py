"""Bytes of messages of ROS that are a header and numbers, such as sensor_msgs/Imu, many at once.

All are fixed but for the name of the frame in their header, and every number after it has eight bytes,
so the numbers are the last bytes of a message: no generic deserialiser is needed.
ROS 1: docs.ros.org, sensor_msgs/Imu.msg; ROS 2: OMG CDR (DDS-RTPS 10.2), plain, in either byte order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FloatArray

_DOUBLES = {"imu": 37, "temperature": 2, "magnetometer": 12, "vector": 3}
_RATE, _FORCE = slice(13, 16), slice(25, 28)
"""Places of angular velocity and linear acceleration among the 37 numbers of an Imu message."""
_RATE_COVARIANCE, _FORCE_COVARIANCE = 16, 28


@dataclass(frozen=True, slots=True)
class Encoding:
    """Where header and numbers stand in the bytes of a message."""

    stamp_offset: int
    """Bytes before the seconds of the stamp."""
    alignment: int
    """Numbers start at a multiple of this, counted after `head` bytes."""
    head: int
    """Bytes of encapsulation."""


ROS1 = Encoding(stamp_offset=4, alignment=1, head=0)
CDR = Encoding(stamp_offset=4, alignment=8, head=4)


class MalformedMessageError(ValueError):
    """Bytes that are no such message; carries the number of the message in its batch."""

    def __init__(self, index: int, problem: str) -> None:
        super().__init__(problem)
        self.index = index


@dataclass(frozen=True, slots=True)
class Decoded:
    """Header and numbers of many messages."""

    stamp: NDArray[np.int64]
    """(n,) nanoseconds."""
    numbers: FloatArray
    """(n, 37) for Imu, (n, 2) for Temperature, (n, 12) for MagneticField, (n, 3) for Vector3Stamped."""

    @property
    def angular_rate(self) -> FloatArray:
        """(n, 3) rad/s; NaN where the publisher states that it has none."""
        return _unless_absent(self.numbers[:, _RATE], self.numbers[:, _RATE_COVARIANCE])

    @property
    def magnetic_field(self) -> FloatArray:
        """(n, 3) T of MagneticField; of Vector3Stamped in whatever unit its publisher has."""
        return np.array(self.numbers[:, :3], order="C")

    @property
    def specific_force(self) -> FloatArray:
        """(n, 3) m/s^2; NaN where the publisher states that it has none."""
        return _unless_absent(self.numbers[:, _FORCE], self.numbers[:, _FORCE_COVARIANCE])


def _unless_absent(values: FloatArray, first_covariance: FloatArray) -> FloatArray:
    """Imu.msg: the first element of a covariance is -1 where the publisher does not measure the quantity."""
    values = np.array(values, order="C")
    values[first_covariance == -1.0] = np.nan
    return values


def frame_of(message: bytes, encoding: Encoding) -> str:
    """Name of the frame in the header of a message."""
    order = _byte_order(message, encoding)
    length = int(np.frombuffer(message, f"{order}u4", 1, encoding.stamp_offset + 8)[0])
    start = encoding.stamp_offset + 12
    return message[start : start + length].rstrip(b"\x00").decode("utf-8", errors="replace")


def frames_of(messages: Sequence[bytes], encoding: Encoding) -> set[str]:
    """Names of the frames in the headers of messages that have one byte order."""
    begin = encoding.stamp_offset + 8
    end = begin + 4 + len(frame_of(messages[0], encoding).encode()) if messages else begin
    # The length of the name stands before it: names that begin alike differ there.
    different = {message[begin:end]: message for message in messages}
    return {frame_of(message, encoding) for message in different.values()}


def decode(messages: Sequence[bytes], kind: str, encoding: Encoding) -> Decoded:
    """Decodes messages of one kind, `imu`, `temperature`, `magnetometer` or `vector`.

    Raises `MalformedMessageError` where the bytes of one do not add up to such a message.
    """
    order = _byte_order(messages[0], encoding)
    size = 8 * _DOUBLES[kind]
    header = encoding.stamp_offset + 12
    for index, message in enumerate(messages):
        if len(message) < header + size:
            raise MalformedMessageError(index, f"has {len(message)} bytes, too few for its type")
    headers = np.frombuffer(b"".join([message[:header] for message in messages]), np.uint8)
    words = headers.reshape(len(messages), header)[:, encoding.stamp_offset :].copy().view(f"{order}u4")
    _check_sizes(messages, words[:, 2].astype(np.int64), size, encoding)
    seconds = words[:, 0].astype(np.int64)
    if encoding is CDR:
        seconds = words[:, 0].copy().view(f"{order}i4").astype(np.int64)
    numbers = np.frombuffer(b"".join([message[-size:] for message in messages]), f"{order}f8")
    return Decoded(
        seconds * 1_000_000_000 + words[:, 1].astype(np.int64),
        numbers.reshape(len(messages), _DOUBLES[kind]).astype(np.float64, copy=False),
    )


def _byte_order(message: bytes, encoding: Encoding) -> str:
    if encoding is CDR:
        if message[:2] not in (b"\x00\x00", b"\x00\x01"):
            raise MalformedMessageError(0, f"has CDR representation {message[:2].hex()}, not plain CDR")
        return "<" if message[1] == 1 else ">"
    return "<"


def _check_sizes(
    messages: Sequence[bytes], frame_length: NDArray[np.int64], size: int, encoding: Encoding
) -> None:
    """Header, name of the frame, padding and numbers have to fill a message exactly."""
    start = encoding.stamp_offset - encoding.head + 12 + frame_length
    start = -(-start // encoding.alignment) * encoding.alignment
    wrong = encoding.head + start + size != np.array([len(message) for message in messages])
    if wrong.any():
        index = int(np.argmax(wrong))
        raise MalformedMessageError(index, f"has {len(messages[index])} bytes, not those of its type")


def seconds(nanoseconds: NDArray[np.int64]) -> FloatArray:
    """Nanoseconds as the nearest float64 seconds, also where they count from 1970."""
    whole, rest = np.divmod(nanoseconds, 1_000_000_000)
    exact = nanoseconds / 1e9
    return np.where(np.abs(nanoseconds) < 1 << 53, exact, whole + rest / 1e9)
