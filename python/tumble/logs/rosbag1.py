"""ROS 1 bags, chunk after chunk."""

from __future__ import annotations

import bz2
import os
import struct
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any

from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]
from rosbags.rosbag1 import Reader
from rosbags.rosbag1.reader import IndexData, decompressors

from tumble.logs.bag_files import BagPath
from tumble.logs.bags import BagMessage, check_one_definition, remedy
from tumble.logs.damage import damage_said
from tumble.logs.options import ReadOptions
from tumble.logs.ros import imu_of, imus_of
from tumble.logs.rosbag import RosBag, definitions_of
from tumble.logs.rosmsg import ROS1
from tumble.logs.track import LARGEST_RATIO, LoggedImu

_UINT32 = struct.Struct("<I")
_TIME = struct.Struct("<II")
_MESSAGE_DATA = b"\x02"
_UNPACKERS: dict[Callable[[bytes], bytes], Callable[[], Any]] = {
    decompressors["bz2"]: bz2.BZ2Decompressor,
    decompressors["lz4"]: LZ4FrameDecompressor,
}
"""Decompressors with a limit, by the function with which the library would decompress everything."""


class _ReaderWithoutIndex(Reader):
    """Skips the index of single messages, which grows with the length of the recording."""

    def read_index_data(self, pos: int, indexes: dict[int, list[IndexData]]) -> None:
        """Step over one index record: a header and data, each after its length."""
        assert self.bio is not None
        for _ in range(2):
            (length,) = _UINT32.unpack(self.bio.read(4))
            self.bio.seek(length, os.SEEK_CUR)


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the topics that hold IMUs."""
    return imus_of(RosBag1(path))


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds a topic with an IMU; raises `LogError` where there is none, or several and none is named."""
    return imu_of(RosBag1(path), imu, options)


class RosBag1(RosBag):
    """A `.bag` file."""

    format = "ros1"
    encoding = ROS1
    encoding_name = "ros1"

    def _reader(self) -> _ReaderWithoutIndex:
        return _ReaderWithoutIndex(BagPath(self.path))

    def messages(self, names: Collection[str]) -> Iterator[BagMessage]:
        """Messages of those topics: chunks in the order of their begin, messages as they stand in them."""
        with damage_said(self.path, remedy(self.path)), self._reader() as reader:
            assert reader.bio is not None
            connections = [connection for connection in reader.connections if connection.topic in names]
            check_one_definition(self.path, definitions_of(connections))
            wanted = {connection.id: connection.topic for connection in connections}
            for info in sorted(reader.chunk_infos, key=lambda info: (info.start_time, info.pos)):
                if wanted.keys().isdisjoint(info.connection_counts):
                    continue
                chunk = reader.chunks[info.pos]
                reader.bio.seek(chunk.datapos)
                raw = reader.bio.read(chunk.datasize)
                if len(raw) != chunk.datasize:
                    raise EOFError(f"{len(raw)} of {chunk.datasize} bytes of a chunk are there")
                yield from _messages(_unpacked(raw, chunk.decompressor), wanted)


def _unpacked(data: bytes, unpack: Callable[[bytes], bytes]) -> bytes:
    """Unpacks a chunk; raises `ValueError` where it becomes more than readings do."""
    if unpack not in _UNPACKERS:
        return data
    unpacker = _UNPACKERS[unpack]()
    unpacked: bytes = unpacker.decompress(data, LARGEST_RATIO * len(data))
    if not unpacker.eof:
        raise ValueError("a compressed chunk has no end, or unpacks to too much")
    return unpacked


def _messages(chunk: bytes, wanted: dict[int, str]) -> Iterator[BagMessage]:
    """Walks the records of a chunk (wiki.ros.org/Bags/Format/2.0): header and data, each after its length."""
    position = 0
    while position < len(chunk):
        header, position = _sized(chunk, position)
        data, position = _sized(chunk, position)
        fields = dict(_fields(header))
        if fields[b"op"] != _MESSAGE_DATA:
            continue
        topic = wanted.get(_UINT32.unpack(fields[b"conn"])[0])
        if topic is not None:
            seconds, nanoseconds = _TIME.unpack(fields[b"time"])
            yield BagMessage(topic, seconds * 1_000_000_000 + nanoseconds, data)


def _sized(source: bytes, position: int) -> tuple[bytes, int]:
    start = position + 4
    end = start + _UINT32.unpack_from(source, position)[0]
    if end > len(source):
        raise EOFError("a record is longer than its chunk")
    return source[start:end], end


def _fields(header: bytes) -> Iterator[tuple[bytes, bytes]]:
    position = 0
    while position < len(header):
        field, position = _sized(header, position)
        name, _, value = field.partition(b"=")
        yield name, value
