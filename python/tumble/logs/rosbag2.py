"""ROS 2 bags: folders with metadata.yaml, and bare .db3 files."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from rosbags.rosbag2 import Reader

from tumble.logs.bags import BagMessage, Topic, kind_of, remedy
from tumble.logs.damage import damage_said
from tumble.logs.message_form import Definition
from tumble.logs.options import ReadOptions
from tumble.logs.ros import imu_of, imus_of
from tumble.logs.rosmsg import CDR
from tumble.logs.track import LoggedImu


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the topics that hold IMUs."""
    return imus_of(RosBag2(path))


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds a topic with an IMU; raises `LogError` where there is none, or several and none is named."""
    return imu_of(RosBag2(path), imu)


class RosBag2:
    """A folder with metadata.yaml, or a .db3 file."""

    format = "ros2"
    remarks: tuple[str, ...] = ()

    def __init__(self, path: Path) -> None:
        self.path = path
        with damage_said(path, remedy(path)), Reader(path) as reader:
            self._types = {connection.topic: connection.msgtype for connection in reader.connections}
            self._definitions = {
                connection.topic: Definition(
                    "cdr", connection.msgtype, connection.msgdef.data.encode("utf-8", "replace")
                )
                for connection in reader.connections
            }

    def all_topics(self) -> dict[str, str]:
        """Type of every topic, by name."""
        return self._types

    def definitions(self) -> dict[str, Definition]:
        """Definitions of the messages of each topic."""
        return self._definitions

    def topics(self) -> list[Topic]:
        """Topics of the kinds we read."""
        kinds = {name: kind_of(message_type) for name, message_type in self._types.items()}
        return [Topic(name, kind, CDR) for name, kind in kinds.items() if kind is not None]

    def facts(self) -> dict[str, str]:
        """Tumble writes no ROS 2 bag folders."""
        return {}

    def messages(self, names: Collection[str]) -> Iterator[BagMessage]:
        """Messages of those topics, in the order in which they were recorded."""
        with damage_said(self.path, remedy(self.path)), Reader(self.path) as reader:
            wanted = [connection for connection in reader.connections if connection.topic in names]
            for connection, log_time, data in reader.messages(connections=wanted):
                yield BagMessage(connection.topic, log_time, data)
