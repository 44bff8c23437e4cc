"""Topics of ROS 2, received over DDS without ROS: `ros2:///imu/data`."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from types import TracebackType
from typing import Any

import numpy as np
from cyclonedds.core import Listener
from cyclonedds.sub import DataReader
from numpy.typing import NDArray

from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of
from tumble.live.address import Address
from tumble.live.conditioning import EMPTY, ConditionedSource
from tumble.live.field_pairing import NO_MAGNETOMETER, FieldPairing
from tumble.live.readings import Readings, StreamFacts
from tumble.live.ros2_domain import BEST_EFFORT, MOST_WAITING, QOS, Domain, Sender
from tumble.live.ros2_names import FIELD_TYPE
from tumble.live.ros2_types import FieldMessage, ImuMessage, Vector3
from tumble.live.source import LiveChunk
from tumble.logs.options import ReadOptions
from tumble.logs.track import RawSamples, StatedUnit

_STATED, _STATED_FIELD = "sensor_msgs/Imu", "sensor_msgs/MagneticField"
ANNOUNCED_TOGETHER = 0.1
"""s within which the topics of one driver are announced."""


def open_ros2(address: Address, options: ReadOptions) -> Ros2Source:
    """Opens `ros2:///imu/data`; `domain=` is its number, `qos=` `reliable` or `best-effort`.

    `magnetometer=` is a topic of `sensor_msgs/MagneticField` beside it, `none` for none; by default that of
    the same folder, if there is one. Raises `LogError` where these are none.
    """
    address.refuse_other_settings("domain", "qos", "magnetometer")
    if (qos := address.settings.get("qos", BEST_EFFORT)) not in QOS:
        raise LogError(f"{address.text}: qos={qos}: give {' or '.join(QOS)}")
    return Ros2Source(address, options)


class Ros2Source(ConditionedSource):
    """Reads one topic of `sensor_msgs/Imu`, and the magnetometer beside it; a `Source`.

    It asks for what the senders of the topic offer, as a reader that asks for more would receive nothing.
    """

    def __init__(self, address: Address, options: ReadOptions) -> None:
        super().__init__(options)
        self._address = address
        self.topic = "/" + address.place.strip("/")
        self.name = self.topic.strip("/").replace("/", "-")
        self._reader: DataReader[ImuMessage] | None = None
        self._wanted_field = address.settings.get("magnetometer", options.magnetometer_name)
        self._field_topic = ""
        self._fields: DataReader[FieldMessage] | None = None
        self._pairing = FieldPairing()
        self._quality = ""
        self._ready = -1
        self._open = ExitStack()

    @property
    def remarks(self) -> tuple[str, ...]:
        """See `Source`."""
        lost = 0 if self._reader is None else self._reader.get_sample_lost_status().total_count  # type: ignore[no-untyped-call]
        unheard = (f"lost {count_of('message', lost)} on the way, or unread in time",) if lost else ()
        received = f"topic {self.topic} is received {self._quality}"
        return (*self._conditioner.notices, received, *self._about_field(), *unheard)

    def _about_field(self) -> Iterator[str]:
        if self._field_topic:
            yield f"topic {self._field_topic} is its magnetometer; ?magnetometer= names another, or none"
        if self._pairing.clocks_differ:
            yield "stamps of its magnetometer are of another clock: readings have the time of the next sample"

    def __enter__(self) -> Ros2Source:
        domain = Domain.join(self._address)
        found = domain.find(self.topic)
        if found is None:
            raise LogError(_nobody(self._address, domain, self.topic))
        self._quality = self._address.settings.get("qos", found.reliability)
        with ExitStack() as opened:
            self._ready, signal = os.pipe()
            for descriptor in (self._ready, signal):
                os.set_blocking(descriptor, False)
                opened.callback(os.close, descriptor)
            if (beside := self._field_beside(domain)) is not None:
                self._field_topic = beside.name
                self._fields = domain.reader(beside.name, beside.reliability, Listener(), FieldMessage)  # type: ignore[no-untyped-call]
            self._reader = domain.reader(self.topic, self._quality, _Signal(signal), ImuMessage)
            opened.callback(self._close)
            self._open = opened.pop_all()
        return self

    def _field_beside(self, domain: Domain) -> Sender | None:
        """Returns the topic of the magnetometer; None where there is none, or none is wanted.

        Raises `LogError` where nobody sends the one that is named.
        """
        if self._wanted_field == NO_MAGNETOMETER:
            return None
        if self._wanted_field is not None:
            named = "/" + self._wanted_field.strip("/")
            found = domain.find(named, FIELD_TYPE)
            if found is None:
                raise LogError(_no_field(self._address, domain, named))
            return found
        # Topics of one driver are announced one after another.
        clock.sleep(ANNOUNCED_TOGETHER)
        beside = [each for each in domain.senders() if each.type == FIELD_TYPE and self._is_beside(each.name)]
        return min(
            beside, key=lambda each: (not each.name.startswith(f"{self.topic}/"), each.name), default=None
        )

    def _is_beside(self, topic: str) -> bool:
        folder = topic.rpartition("/")[0]
        return folder in (self.topic, self.topic.rpartition("/")[0])

    def _close(self) -> None:
        if self._reader is not None:
            # Without its listener, which would signal through a descriptor that is closed by then.
            self._reader.set_listener(None)
            self._reader = None
        self._fields = None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.close()

    def fileno(self) -> int:
        """See `Source`."""
        return self._ready

    def read(self) -> LiveChunk:
        """See `Source`."""
        with suppress(BlockingIOError):
            os.read(self._ready, MOST_WAITING)
        fields = [] if self._fields is None else self._fields.take(N=MOST_WAITING)
        fields = [each for each in fields if isinstance(each, FieldMessage)]
        if fields:
            self._pairing.add(_seconds(fields), _rows([(each.magnetic_field, 0.0) for each in fields]))
        messages = [] if self._reader is None else self._reader.take(N=MOST_WAITING)
        messages = [message for message in messages if isinstance(message, ImuMessage)]
        if not messages:
            return EMPTY
        magnetic = None if self._fields is None else self._pairing.beside(_seconds(messages))
        readings = Readings(_samples(messages), magnetic=magnetic)
        return self._conditioner.take(readings, self._facts(), clock.now())

    def _facts(self) -> StreamFacts:
        return StreamFacts(
            self._address.text,
            True,
            StatedUnit("m/s^2", _STATED),
            StatedUnit("rad/s", _STATED),
            StatedUnit("ns", _STATED),
            magnetometer_unit=StatedUnit("T", _STATED_FIELD),
        )


class _Signal(Listener):
    """Makes a descriptor readable as soon as a message has come."""

    def __init__(self, descriptor: int) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self._descriptor = descriptor

    def on_data_available(self, reader: DataReader[ImuMessage]) -> None:
        # A full pipe is readable as it is.
        with suppress(BlockingIOError):
            os.write(self._descriptor, b"\0")


def _stamps(messages: Sequence[ImuMessage | FieldMessage]) -> NDArray[Any]:
    """Returns the stamps of messages, ns, as whole numbers."""
    stamps = [1_000_000_000 * each.header.stamp.sec + each.header.stamp.nanosec for each in messages]
    return np.array(stamps, dtype=np.int64)


def _seconds(messages: Sequence[ImuMessage | FieldMessage]) -> FloatArray:
    seconds: FloatArray = 1e-9 * _stamps(messages)
    return seconds


def _samples(messages: list[ImuMessage]) -> RawSamples:
    return RawSamples(
        _stamps(messages),
        _rows([(each.linear_acceleration, each.linear_acceleration_covariance[0]) for each in messages]),
        _rows([(each.angular_velocity, each.angular_velocity_covariance[0]) for each in messages]),
    )


def _rows(values: list[tuple[Vector3, float]]) -> FloatArray:
    """(n, 3); NaN where the first element of the covariance states that nothing is measured (Imu.msg)."""
    return np.array([(each.x, each.y, each.z) if first != -1.0 else (np.nan,) * 3 for each, first in values])


def _no_field(address: Address, domain: Domain, topic: str) -> str:
    """Returns the error for a magnetometer that nobody sends, with those that somebody does."""
    sent = ", ".join(each.name for each in domain.senders() if each.type == FIELD_TYPE) or "none"
    return (
        f"{address.text}: nobody sends {topic} in domain {domain.number}; topics of "
        f"sensor_msgs/MagneticField there: {sent}"
    )


def _nobody(address: Address, domain: Domain, topic: str) -> str:
    """Returns the error for a topic that nobody sends, with those that somebody does."""
    sent = ", ".join(map(str, domain.sent()))
    where = f"domain {domain.number}"
    if sent:
        return f"{address.text}: nobody sends {topic} in {where}; topics of sensor_msgs/Imu there: {sent}"
    return (
        f"{address.text}: nobody sends a sensor_msgs/Imu in {where}; is the driver running, on this network, "
        "and is ?domain= or ROS_DOMAIN_ID its number?"
    )
