"""ROS 2 bags: folders with metadata.yaml, and bare .db3 files."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from rosbags.rosbag2 import Reader, reader, storage_mcap, storage_sqlite3

from tumble.logs.bag_files import BagPath, RegularDatabases
from tumble.logs.bag_journal import JoinedBag
from tumble.logs.bags import BagMessage, check_one_definition, remedy
from tumble.logs.bounded_bags import BoundedZstd, unpacked_lz4, unpacked_zstd
from tumble.logs.damage import damage_said
from tumble.logs.options import ReadOptions
from tumble.logs.ros import imu_of, imus_of
from tumble.logs.rosbag import RosBag, definitions_of
from tumble.logs.rosmsg import CDR
from tumble.logs.track import LoggedImu

storage_sqlite3.apsw = RegularDatabases  # type: ignore[attr-defined,assignment]
reader.zstd = BoundedZstd(reader.zstd)  # type: ignore[attr-defined,assignment]
storage_mcap.DECOMPRESSORS |= {"lz4": unpacked_lz4, "zstd": unpacked_zstd}


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

    def __init__(self, path: Path) -> None:
        with damage_said(path, remedy(path)):
            self._joined = JoinedBag(path)
        self.remarks = self._joined.remarks
        super().__init__(path)

    def _reader(self) -> Reader:
        return Reader(BagPath(self._joined.path))

    def messages(self, names: Collection[str]) -> Iterator[BagMessage]:
        """Messages of those topics, in the order in which they were recorded."""
        with damage_said(self.path, remedy(self.path)), self._reader() as reader:
            wanted = [connection for connection in reader.connections if connection.topic in names]
            check_one_definition(self.path, definitions_of(wanted))
            for connection, log_time, data in reader.messages(connections=wanted):
                if not isinstance(data, bytes):
                    raise TypeError(f"a message is {type(data).__name__}, no bytes")
                yield BagMessage(connection.topic, log_time, data)
