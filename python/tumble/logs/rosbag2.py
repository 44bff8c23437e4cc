"""ROS 2 bags: folders with metadata.yaml, and bare .db3 files."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from rosbags.rosbag2 import Reader

from tumble.logs.bags import BagMessage, remedy
from tumble.logs.damage import damage_said
from tumble.logs.options import ReadOptions
from tumble.logs.ros import imu_of, imus_of
from tumble.logs.rosbag import RosBag
from tumble.logs.rosmsg import CDR
from tumble.logs.track import LoggedImu


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the topics that hold IMUs."""
    return imus_of(RosBag2(path))


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds a topic with an IMU; raises `LogError` where there is none, or several and none is named."""
    return imu_of(RosBag2(path), imu, options)


class RosBag2(RosBag):
    """A folder with metadata.yaml, or a .db3 file."""

    format = "ros2"
    encoding = CDR
    encoding_name = "cdr"

    @staticmethod
    def _reader(path: Path) -> Reader:
        return Reader(path)

    def messages(self, names: Collection[str]) -> Iterator[BagMessage]:
        """Messages of those topics, in the order in which they were recorded."""
        with damage_said(self.path, remedy(self.path)), self._reader(self.path) as reader:
            wanted = [connection for connection in reader.connections if connection.topic in names]
            for connection, log_time, data in reader.messages(connections=wanted):
                yield BagMessage(connection.topic, log_time, data)
