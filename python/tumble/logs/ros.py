"""IMUs of a bag: messages gathered into samples."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tumble.errors import LogError
from tumble.logs.bags import Bag, BagMessage, Topic
from tumble.logs.rosmsg import MalformedMessageError, decode, frame_of, seconds
from tumble.logs.track import CHUNK_SAMPLES, LoggedImu, RawSamples, StatedUnit, choose
from tumble.recording import FloatArray

_HEAD_SAMPLES = 1 << 14


def list_imus(path: Path, kind: str) -> tuple[str, ...]:
    """Give the topics of a bag that hold sensor_msgs/Imu; `kind` is `ros1`, `ros2` or `mcap`."""
    return tuple(_imu_topics(_open_bag(path, kind)))


def open_logged_imu(path: Path, kind: str, imu: str | None) -> LoggedImu:
    """Find an Imu topic in a bag; `kind` is `ros1`, `ros2` or `mcap`.

    Raises `LogError` where there is no such topic, or several and none is named.
    """
    bag = _open_bag(path, kind)
    topics = _imu_topics(bag)
    name = choose(path, tuple(topics), imu, "topic")
    first = next(bag.messages([name]), None)
    if first is None:
        raise LogError(f"{path}: topic {name} holds no messages")
    gatherer = _Gatherer(bag, topics[name], _temperature_topic(bag, name), use_stamps=True)
    head = next(gatherer.samples(_HEAD_SAMPLES))
    stamped = bool(np.any(head.time))
    if not stamped:
        gatherer = _Gatherer(bag, topics[name], _temperature_topic(bag, name), use_stamps=False)
        head = next(gatherer.samples(_HEAD_SAMPLES))
    facts = bag.facts()
    return LoggedImu(
        path=path,
        imu=name,
        format=bag.format,
        read=lambda transform: map(transform, gatherer.samples(CHUNK_SAMPLES)),
        head=lambda: head,
        locate=lambda sample: f"message {sample + 1} of {name}",
        accelerometer_unit=StatedUnit("m/s^2", "message definition"),
        gyroscope_unit=StatedUnit("rad/s", "message definition"),
        time_unit=StatedUnit("s", "message definition"),
        temperature_unit=StatedUnit("degC", "message definition"),
        frame=frame_of(first.data, topics[name].encoding) or "case",
        clock="" if stamped else f"{path.resolve()}#log time",
        serial=facts.get("serial", ""),
        already_corrected=True if "corrected" in facts else None,
        alone=len(topics) == 1,
        notices=(*bag.remarks, *(() if stamped else ("headers carry no stamp: time is that of recording",))),
    )


def _open_bag(path: Path, kind: str) -> Bag:
    """Open a bag with the library of its kind, which is imported only then."""
    if kind == "mcap":
        from tumble.logs.mcap import McapFile

        return McapFile(path)
    if kind == "ros1":
        from tumble.logs.rosbag1 import RosBag1

        return RosBag1(path)
    from tumble.logs.rosbag2 import RosBag2

    return RosBag2(path)


def _imu_topics(bag: Bag) -> dict[str, Topic]:
    topics = {topic.name: topic for topic in bag.topics() if topic.kind == "imu"}
    if not topics:
        found = ", ".join(f"{name} ({kind})" for name, kind in bag.all_topics().items()) or "none"
        raise LogError(f"{bag.path}: no topic holds sensor_msgs/Imu; topics found: {found}")
    return dict(sorted(topics.items()))


def _temperature_topic(bag: Bag, imu: str) -> Topic | None:
    """Temperature that belongs to an IMU by its name: `/imu/temperature` to `/imu/data` or `/imu`."""
    parent = imu.rsplit("/", 1)[0]
    names = (f"{imu}/temperature", f"{parent}/temperature")
    for name in names:
        for topic in bag.topics():
            if topic.name == name and topic.kind == "temperature":
                return topic
    return None


@dataclass(slots=True)
class _Batch:
    """Messages waiting to be decoded together."""

    imu: list[bytes] = field(default_factory=list)
    log_times: list[int] = field(default_factory=list)
    temperature: list[bytes] = field(default_factory=list)
    before: list[int] = field(default_factory=list)
    """How many Imu messages of the batch came before each temperature."""


class _Gatherer:
    """Passes over the messages of one IMU and gathers them into samples."""

    def __init__(self, bag: Bag, imu: Topic, temperature: Topic | None, *, use_stamps: bool) -> None:
        self._bag = bag
        self._imu = imu
        self._temperature = temperature
        self._use_stamps = use_stamps

    def samples(self, size: int) -> Iterator[RawSamples]:
        """Give `size` samples at a time, fewer at the end."""
        names = [self._imu.name, *([self._temperature.name] if self._temperature else [])]
        batch, first, held = _Batch(), 0, np.nan
        for message in self._bag.messages(names):
            self._add(batch, message)
            if len(batch.imu) == size:
                samples, held = self._decode(batch, first, held)
                yield samples
                batch, first = _Batch(), first + size
        if batch.imu:
            yield self._decode(batch, first, held)[0]

    def _add(self, batch: _Batch, message: BagMessage) -> None:
        if message.topic == self._imu.name:
            batch.imu.append(message.data)
            batch.log_times.append(message.log_time)
        else:
            batch.temperature.append(message.data)
            batch.before.append(len(batch.imu))

    def _decode(self, batch: _Batch, first: int, held: float) -> tuple[RawSamples, float]:
        """Decode a batch, and give the last temperature to hold for the next one."""
        try:
            imu = decode(batch.imu, "imu", self._imu.encoding)
        except MalformedMessageError as error:
            number = first + error.index + 1
            raise LogError(
                f"{self._bag.path}: message {number} of {self._imu.name} {error}: not sensor_msgs/Imu; "
                "cut it out of the bag"
            ) from error
        stamps = imu.stamp if self._use_stamps else np.array(batch.log_times, dtype=np.int64)
        temperature, held = self._temperature_at(batch, held)
        return RawSamples(seconds(stamps), imu.specific_force, imu.angular_rate, temperature), held

    def _temperature_at(self, batch: _Batch, held: float) -> tuple[FloatArray | None, float]:
        """Give the latest temperature at every Imu message; NaN before the first."""
        if self._temperature is None:
            return None, held
        values = [held]
        if batch.temperature:
            try:
                decoded = decode(batch.temperature, "temperature", self._temperature.encoding)
            except MalformedMessageError as error:
                raise LogError(
                    f"{self._bag.path}: a message of {self._temperature.name} {error}: not "
                    "sensor_msgs/Temperature; cut it out of the bag"
                ) from error
            values += decoded.numbers[:, 0].tolist()
        latest = np.searchsorted(batch.before, np.arange(len(batch.imu)), side="right")
        return np.array(values)[latest], float(values[-1])
