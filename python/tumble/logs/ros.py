"""IMUs of a bag: messages gathered into samples."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import join, quoted
from tumble.logs.bags import Bag, BagMessage, Topic
from tumble.logs.columns import READ_MAGNETOMETER, ImuColumns
from tumble.logs.magnetic_messages import batched, magnetometer_beside, magnetometers_of
from tumble.logs.message_bounds import MOST_LINES, MOST_LINES_OF_BAG
from tumble.logs.message_form import Definition, JsonForm
from tumble.logs.message_imu import (
    ROS_UNITS,
    FieldImu,
    ImuDecoder,
    PlainImu,
    embedded_imus,
    imus_by_names,
    may_hold_imu,
)
from tumble.logs.optional import not_installed
from tumble.logs.options import ReadOptions
from tumble.logs.own_stamps import with_own_stamps
from tumble.logs.rosmsg import MalformedMessageError, decode, seconds
from tumble.logs.row_labels import (
    LabelColumn,
    NamedImu,
    RowLabels,
    choose_named,
    first_found,
    imus_with_labels,
    of_label,
)
from tumble.logs.track import CHUNK_SAMPLES, LoggedImu, LoggedMagnetometer, RawMagnetic, RawSamples

_HEAD_SAMPLES = 1 << 14
_OF_ROS = ("cdr", "ros1")
_IMU_TYPE = re.compile(rb"\bsensor_msgs/(msg/)?Imu\b|\bsensor_msgs::msg::Imu\b")


@dataclass(frozen=True, slots=True)
class _Imu:
    """One IMU of a bag."""

    name: str
    """Its topic, with the field that it is in."""
    topic: str
    decoder: ImuDecoder


def imus_of(bag: Bag) -> tuple[str, ...]:
    """Returns the topics of a bag that hold IMUs, with the fields of messages that hold several things.

    Where a field names the IMU of each message, its labels are part of their names.
    """
    return tuple(_named(bag, _imus(bag)))


def _named(bag: Bag, imus: Mapping[str, _Imu]) -> dict[str, NamedImu]:
    def labels(imu: _Imu, decoder: FieldImu) -> Iterator[LabelColumn]:
        for name in decoder.labels:
            column = LabelColumn(name)
            for some in batched(bag.messages([imu.topic]), CHUNK_SAMPLES):
                try:
                    column.add_words(decoder.form.read_words([message.data for message in some], name))
                except MalformedMessageError:  # which the reader of samples reports
                    return
                if not column.is_open:
                    break
            yield column

    def labels_of(name: str) -> RowLabels | None:
        decoder = imus[name].decoder
        return first_found(labels(imus[name], decoder)) if isinstance(decoder, FieldImu) else None

    return imus_with_labels(imus, labels_of)


def imu_of(bag: Bag, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds an IMU in a bag, and the magnetometer beside it.

    Raises `LogError` where there is no such topic, or several and none is named.
    """
    path = bag.path
    if not options.need_imu and not _may_hold_imus(bag):
        return _magnetometer_alone(bag, imu, options)
    imus = _imus(bag)
    named = _named(bag, imus)
    name = choose_named(path, named, imu, "topic")
    found = imus[named[name].prefix]
    decoder = found.decoder

    def opened(columns: ImuColumns) -> LoggedImu:
        assert isinstance(decoder, FieldImu)
        mine = replace(found, decoder=replace(decoder, columns=columns))
        return of_label(_track(bag, name, mine, options, alone=len(imus) == 1), named[name], name)

    if isinstance(decoder, FieldImu):
        return with_own_stamps(opened, decoder.columns, options)
    return _track(bag, name, found, options, alone=len(imus) == 1)


def _track(bag: Bag, name: str, found: _Imu, options: ReadOptions, *, alone: bool) -> LoggedImu:
    path = bag.path
    first = next(bag.messages([found.topic]), None)
    if first is None:
        raise LogError(f"{path}: topic {found.topic} holds no messages")
    temperature = _temperature_topic(bag, found.topic)
    gatherer = _Gatherer(bag, found, temperature, use_stamps=True)
    head = next(gatherer.samples(_HEAD_SAMPLES))
    stamped = _is_stamped(head)
    if not stamped and isinstance(found.decoder, FieldImu) and found.decoder.outer_time:
        found = replace(found, decoder=found.decoder.by_outer_time())
        gatherer = _Gatherer(bag, found, temperature, use_stamps=True)
        head = next(gatherer.samples(_HEAD_SAMPLES))
        stamped = _is_stamped(head)
    if not stamped:
        gatherer = _Gatherer(bag, found, temperature, use_stamps=False)
        head = next(gatherer.samples(_HEAD_SAMPLES))
    facts, units = bag.facts(), found.decoder.units
    return LoggedImu(
        path=path,
        imu=name,
        format=bag.format,
        read=lambda transform: map(transform, gatherer.samples(CHUNK_SAMPLES)),
        head=lambda: head,
        locate=lambda sample: f"message {sample + 1} of {found.name}",
        accelerometer_unit=units.accelerometer,
        gyroscope_unit=units.gyroscope,
        time_unit=units.time if stamped else ROS_UNITS.time,
        temperature_unit=ROS_UNITS.temperature if temperature else units.temperature,
        frame=found.decoder.frame(first.data) or "case",
        clock="" if stamped else f"{path.resolve()}#log time",
        serial=facts.get("serial", ""),
        already_corrected=True if "corrected" in facts else None,
        correction=facts.get("corrected", ""),
        magnetometer=magnetometer_beside(bag, found.name, options, use_stamps=stamped)
        or _magnetometer_within(bag, found, use_stamps=stamped),
        alone=alone,
        notices=(*bag.remarks, *(() if stamped else ("headers carry no stamp: time is that of recording",))),
    )


def _is_stamped(head: RawSamples) -> bool:
    return head.time is not None and bool(np.any(head.time))


def _may_hold_imus(bag: Bag) -> bool:
    """Returns whether an IMU is found, or nothing is, so that the error is that of an IMU."""
    try:
        return bool(_imus(bag))
    except LogError:
        return not magnetometers_of(bag)


def _magnetometer_alone(bag: Bag, wanted: str | None, options: ReadOptions) -> LoggedImu:
    """Returns the magnetometer of a bag without an IMU; `LOG:NAME` or an option names its topic."""
    named = replace(options, magnetometer_name=options.magnetometer_name or wanted)
    return LoggedImu(
        path=bag.path,
        imu="",
        format=bag.format,
        read=lambda transform: iter(()),
        head=lambda: RawSamples(None, np.empty((0, 3)), np.empty((0, 3))),
        locate=lambda sample: f"message {sample + 1}",
        time_unit=ROS_UNITS.time,
        triads=(),
        magnetometer=magnetometer_beside(bag, "", named, use_stamps=True),
        notices=bag.remarks,
    )


def _magnetometer_within(bag: Bag, imu: _Imu, *, use_stamps: bool) -> LoggedMagnetometer | None:
    """Finds a magnetometer in the messages of the IMU themselves."""
    decoder = imu.decoder
    if not isinstance(decoder, FieldImu) or decoder.columns.magnetometer is None:
        return None

    def read() -> RawMagnetic:
        pieces, recorded = [], []
        for some in batched(bag.messages([imu.topic]), CHUNK_SAMPLES):
            pieces.append(decoder.magnetic([message.data for message in some]))
            recorded += [message.log_time for message in some]
        times = [piece.time for piece in pieces if piece.time is not None]
        stamped = use_stamps and len(times) == len(pieces)
        return RawMagnetic(
            np.concatenate(times) if stamped else seconds(np.array(recorded, dtype=np.int64)),
            np.concatenate([np.empty((0, 3)), *(piece.field for piece in pieces)]),
        )

    return LoggedMagnetometer(read, decoder.columns.magnetometer.unit, name=imu.name, row_wise=True)


def _imus(bag: Bag) -> dict[str, _Imu]:
    """Finds the IMUs: messages and fields of that type, else those that the names of fields show."""
    found = {
        topic.name: _Imu(topic.name, topic.name, PlainImu(topic.encoding))
        for topic in bag.topics()
        if topic.kind == "imu"
    }
    definitions = bag.definitions()
    embedding = {
        topic: definition
        for topic, definition in definitions.items()
        if topic not in found and _IMU_TYPE.search(definition.text)
    }
    _refuse_many_lines(bag, embedding)
    for topic, definition in embedding.items():
        found |= _of_topic(bag, topic, definition, by_names=False)
    if not found:
        named = {
            topic: definition
            for topic, definition in definitions.items()
            if definition.encoding == "json" or may_hold_imu(definition.text)
        }
        _refuse_many_lines(bag, named)
        for topic, definition in named.items():
            found |= _of_topic(bag, topic, definition, by_names=True)
    if not found:
        topics = ", ".join(f"{name} ({kind})" for name, kind in bag.all_topics().items()) or "none"
        beside = READ_MAGNETOMETER if magnetometers_of(bag) else ""
        raise LogError(
            f"{bag.path}: no topic holds sensor_msgs/Imu, or fields such as linear_acceleration and "
            f"angular_velocity; topics found: {topics}{beside}"
        )
    return dict(sorted(found.items()))


def _refuse_many_lines(bag: Bag, definitions: Mapping[str, Definition]) -> None:
    """Raises `LogError` where definitions take long to parse; topics share them, long ones are left out."""
    texts = {each.text for each in definitions.values() if each.encoding in _OF_ROS}
    lines = sum(min(text.count(b"\n"), MOST_LINES) for text in texts)
    if lines > MOST_LINES_OF_BAG:
        raise LogError(
            f"{bag.path}: defines messages in {lines} lines, where {MOST_LINES_OF_BAG} are allowed; copy the "
            "topic of the IMU into a bag of its own"
        )


def _of_topic(bag: Bag, topic: str, definition: Definition, *, by_names: bool) -> dict[str, _Imu]:
    """Finds the IMUs in the fields of a topic's messages; none where they are unknown."""
    from tumble.logs.message_types import protobuf_form, ros_form

    decoders: Mapping[str, ImuDecoder] = {}
    try:
        if definition.encoding in _OF_ROS:
            form, embedded = ros_form(definition)
            decoders = (
                imus_by_names(form, definition.type)
                if by_names
                else embedded_imus(form, embedded, definition.type)
            )
        elif by_names and definition.encoding == "protobuf":
            decoders = imus_by_names(protobuf_form(definition), definition.type)
        elif by_names and definition.encoding == "json":
            first = next(bag.messages([topic]), None)
            if first is not None:
                decoders = imus_by_names(JsonForm(first.data), definition.type or "JSON")
    except ModuleNotFoundError as error:
        raise not_installed(f"{bag.path}:{topic}", "protobuf", "formats") from error
    except LogError:
        raise
    except Exception:  # a library raises anything over a definition that is none
        return {}
    return {
        name: _Imu(name, topic, decoder)
        for name, decoder in (
            (f"{topic}.{field}" if field else topic, each) for field, each in decoders.items()
        )
    }


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
    """Number of Imu messages of the batch before each temperature."""


class _Gatherer:
    """Passes over the messages of one IMU and gathers them into samples."""

    def __init__(self, bag: Bag, imu: _Imu, temperature: Topic | None, *, use_stamps: bool) -> None:
        self._bag = bag
        self._imu = imu
        self._temperature = temperature
        self._use_stamps = use_stamps

    def samples(self, size: int) -> Iterator[RawSamples]:
        """Returns `size` samples at a time, fewer at the end."""
        names = [self._imu.topic, *([self._temperature.name] if self._temperature else [])]
        batch, first, held, frames = _Batch(), 0, np.nan, set[str]()
        for message in self._bag.messages(names):
            self._add(batch, message)
            if len(batch.imu) == size:
                samples, held = self._decode(batch, first, held)
                self._note_frames(batch, frames)
                yield samples
                batch, first = _Batch(), first + size
        if batch.imu:
            samples, held = self._decode(batch, first, held)
            self._note_frames(batch, frames)
            yield samples

    def _add(self, batch: _Batch, message: BagMessage) -> None:
        if message.topic == self._imu.topic:
            batch.imu.append(message.data)
            batch.log_times.append(message.log_time)
        else:
            batch.temperature.append(message.data)
            batch.before.append(len(batch.imu))

    def _note_frames(self, batch: _Batch, frames: set[str]) -> None:
        """Adds the frames of a batch; raises `LogError` where two drivers publish to one topic."""
        frames |= self._imu.decoder.frames(batch.imu)
        if len(frames) > 1:
            raise LogError(
                f"{self._bag.path}: {len(frames)} IMUs publish to {self._imu.name}, with the frame_id "
                f"{join([quoted(frame) for frame in sorted(frames)])}; record each on a topic of its own, or "
                "split the topic by frame_id"
            )

    def _decode(self, batch: _Batch, first: int, held: float) -> tuple[RawSamples, float]:
        """Decodes a batch, and returns the last temperature to hold for the next one."""
        try:
            samples = self._imu.decoder.decode(batch.imu)
        except MalformedMessageError as error:
            number = first + error.index + 1
            raise LogError(
                f"{self._bag.path}: message {number} of {self._imu.topic} {error}: not "
                f"{self._imu.decoder.what}; cut it out of the bag"
            ) from error
        recorded = self._recorded(batch)
        if self._use_stamps:
            samples.received = recorded
        else:
            samples.time = recorded
        if self._temperature is not None:
            samples.temperature, held = self._temperature_at(batch, held)
        return samples, held

    def _recorded(self, batch: _Batch) -> FloatArray:
        """Returns when each message was recorded, (n,) s."""
        try:
            return seconds(np.array(batch.log_times, dtype=np.int64))
        except OverflowError as error:
            raise LogError(
                f"{self._bag.path}: a message of {self._imu.topic} says it was recorded after the year 2262: "
                "the file is damaged; copy it again"
            ) from error

    def _temperature_at(self, batch: _Batch, held: float) -> tuple[FloatArray, float]:
        """Returns the latest temperature at every Imu message; NaN before the first."""
        assert self._temperature is not None
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
