"""Magnetometers of bags: topics of sensor_msgs/MagneticField, in tesla, and vectors named for one.

Older drivers of ROS 1 publish geometry_msgs/Vector3Stamped on topics such as `/imu/mag`, in their own units.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice, takewhile
from typing import TypeVar

import numpy as np

from tumble.foundation.errors import LogError
from tumble.logs.bags import Bag, BagMessage, Topic
from tumble.logs.options import ReadOptions
from tumble.logs.rosmsg import MalformedMessageError, decode, seconds
from tumble.logs.track import CHUNK_SAMPLES, DEFINED, LoggedMagnetometer, RawMagnetic, StatedUnit, none_such

_Item = TypeVar("_Item")
_KIND = "magnetometer"
_TYPES = {_KIND: "sensor_msgs/MagneticField", "vector": "geometry_msgs/Vector3Stamped"}


def magnetometers_of(bag: Bag) -> dict[str, Topic]:
    """Returns the topics of magnetometers, by name."""
    return {topic.name: topic for topic in bag.topics() if topic.kind == _KIND or _is_named_for_one(topic)}


def _is_named_for_one(topic: Topic) -> bool:
    return topic.kind == "vector" and "mag" in topic.name.rsplit("/", 1)[-1].lower()


def magnetometer_beside(
    bag: Bag, imu: str, options: ReadOptions, *, use_stamps: bool
) -> LoggedMagnetometer | None:
    """Finds the magnetometer of an IMU: the one named, else the topic with a path most like that of the IMU.

    `use_stamps` is False where headers of the IMU carry none, so that both have the time of recording.

    Raises `LogError` where the one that is wanted is not there.
    """
    topics = magnetometers_of(bag)
    wanted = options.magnetometer_name
    if wanted is not None and wanted.strip("/") not in {name.strip("/") for name in topics}:
        raise none_such(bag.path, "magnetometer", wanted, list(topics))
    if not topics:
        return None
    likeness = {name: _shared(name, imu) for name in topics}
    named = next((name for name in topics if wanted and name.strip("/") == wanted.strip("/")), None)
    name = named or max(sorted(topics), key=lambda each: likeness[each])
    alike = [each for each in topics if each != name and likeness[each] == likeness[name]]
    notices = (
        (f"reads the magnetometer {name}; {', '.join(alike)} may be named with --magnetometer-name",)
        if alike and named is None
        else ()
    )
    return LoggedMagnetometer(
        lambda: _read(bag, topics[name], use_stamps=use_stamps),
        StatedUnit("T", DEFINED) if topics[name].kind == _KIND else None,
        StatedUnit("s", DEFINED),
        name,
        notices=notices,
    )


def _shared(one: str, other: str) -> int:
    """Counts the names of folders with which both topics begin."""
    pairs = zip(one.strip("/").split("/"), other.strip("/").split("/"), strict=False)
    return len(list(takewhile(lambda pair: pair[0] == pair[1], pairs)))


def _read(bag: Bag, topic: Topic, *, use_stamps: bool) -> RawMagnetic:
    """Reads all messages; those without stamps have the time of recording."""
    stamps, recorded, fields = [np.empty(0, np.int64)], [np.empty(0, np.int64)], [np.empty((0, 3))]
    for some in batched(bag.messages([topic.name]), CHUNK_SAMPLES):
        found = _decoded(bag, topic, some, sum(map(len, fields)))
        stamps.append(found[0])
        fields.append(found[1])
        recorded.append(np.array([message.log_time for message in some], dtype=np.int64))
    stamp = np.concatenate(stamps)
    if not use_stamps or not stamp.any():
        stamp = np.concatenate(recorded)
    return RawMagnetic(seconds(stamp), np.concatenate(fields))


def _decoded(
    bag: Bag, topic: Topic, messages: list[BagMessage], first: int
) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], np.ndarray[tuple[int, int], np.dtype[np.float64]]]:
    try:
        found = decode([message.data for message in messages], topic.kind, topic.encoding)
    except MalformedMessageError as error:
        raise LogError(
            f"{bag.path}: message {first + error.index + 1} of {topic.name} {error}: not "
            f"{_TYPES[topic.kind]}; cut it out of the bag"
        ) from error
    return found.stamp, found.magnetic_field


def batched(items: Iterable[_Item], size: int) -> Iterator[list[_Item]]:
    """Returns items in lists of `size`, the last of which may be shorter."""
    left = iter(items)
    while some := list(islice(left, size)):
        yield some
