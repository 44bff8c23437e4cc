"""ROS 2 bags: folders with metadata.yaml, and bare .db3 files."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from rosbags.rosbag2 import Reader

from tumble.logs.bags import BagMessage, Topic, damage_reported, kind_of
from tumble.logs.rosmsg import CDR


class RosBag2:
    """A folder with metadata.yaml, or a .db3 file."""

    format = "ros2"
    remarks: tuple[str, ...] = ()

    def __init__(self, path: Path) -> None:
        self.path = path
        with damage_reported(path), Reader(path) as reader:
            self._types = {connection.topic: connection.msgtype for connection in reader.connections}

    def all_topics(self) -> dict[str, str]:
        """Type of every topic, by name."""
        return self._types

    def topics(self) -> list[Topic]:
        """Topics of the kinds we read."""
        kinds = {name: kind_of(message_type) for name, message_type in self._types.items()}
        return [Topic(name, kind, CDR) for name, kind in kinds.items() if kind is not None]

    def facts(self) -> dict[str, str]:
        """Tumble writes no ROS 2 bag folders."""
        return {}

    def messages(self, names: Collection[str]) -> Iterator[BagMessage]:
        """Messages of those topics, in the order in which they were recorded."""
        with damage_reported(self.path), Reader(self.path) as reader:
            wanted = [connection for connection in reader.connections if connection.topic in names]
            for connection, log_time, data in reader.messages(connections=wanted):
                yield BagMessage(connection.topic, log_time, data)
