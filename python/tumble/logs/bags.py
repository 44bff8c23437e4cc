"""Bags as a stream of raw messages: what ROS 1 bags, ROS 2 bags and MCAP files have in common."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol

from tumble.foundation.errors import LogError
from tumble.foundation.names import check_length
from tumble.logs.message_form import Definition
from tumble.logs.rosmsg import Encoding


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic that holds messages of a kind we read as they are."""

    name: str
    kind: str
    """`imu`, `temperature`, `magnetometer` or `vector`."""
    encoding: Encoding


class BagMessage(NamedTuple):
    """One message as it stands in the file."""

    topic: str
    log_time: int
    """Nanoseconds at which it was recorded."""
    data: bytes


class Bag(Protocol):
    """A file, or folder of files, with messages."""

    path: Path
    format: str
    remarks: tuple[str, ...]
    """Remarks on the file for the user: damage to unneeded parts, and parts that cannot be checked."""

    def topics(self) -> list[Topic]:
        """Topics of the kinds we read as they are."""
        ...

    def all_topics(self) -> dict[str, str]:
        """Type of every topic, by name."""
        ...

    def definitions(self) -> dict[str, Definition]:
        """Definitions of the messages of each topic, by name, as far as the file states them."""
        ...

    def facts(self) -> dict[str, str]:
        """Returns what Tumble wrote beside the messages: `serial`, `corrected`."""
        ...

    def messages(self, names: Collection[str]) -> Iterator[BagMessage]:
        """Messages of those topics, in the order of the file."""
        ...


def check_name(stated: object) -> str:
    """Returns the name of a topic or of a type as a file states it.

    Raises `TypeError` where a database holds something else, `ValueError` where it is longer than any name.
    """
    if not isinstance(stated, str):
        raise TypeError(f"a topic or type is {type(stated).__name__}, no text")
    check_length(stated)
    return stated


def check_one_definition(path: Path, definitions: Iterable[tuple[str, Hashable]]) -> None:
    """Raises `LogError` where messages of one topic are laid out in two ways.

    `definitions` are topics, and whatever two publishers share only if their messages are laid out alike.
    """
    known: dict[str, Hashable] = {}
    for topic, definition in definitions:
        if known.setdefault(topic, definition) != definition:
            raise LogError(
                f"{path}: topic {topic} is published with two definitions of its messages; record each on a "
                "topic of its own"
            )


def kind_of(message_type: str) -> str | None:
    """Kind of a type, or None for another type; ROS 1 and ROS 2 spell types differently."""
    kinds = {
        "sensor_msgs/Imu": "imu",
        "sensor_msgs/Temperature": "temperature",
        "sensor_msgs/MagneticField": "magnetometer",
        "geometry_msgs/Vector3Stamped": "vector",
    }
    return kinds.get(message_type.replace("/msg/", "/"))


def remedy(path: Path) -> str:
    """Returns the remedy for a damaged one."""
    tool = {".bag": "rosbag reindex", ".mcap": "mcap recover"}.get(path.suffix, "ros2 bag reindex")
    return f"copy it again, or repair it with {tool}"
