"""Bounds for the libraries that read bags of ROS 2: queries of databases, and what is packed.

A database runs what its file states: a view, a computed column, a tree of pages that leads around. `rosbags`
unpacks files and messages to whatever they become.
"""

from __future__ import annotations

from typing import Any, BinaryIO

import apsw
from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]
from rosbags.rosbag2 import storage_mcap

from tumble.logs.budget import unpacked_budget
from tumble.logs.track import LARGEST_RATIO

_LARGEST_MESSAGE = 1 << 24
"""Bytes of a message that is packed by itself."""
_TABLES = ("messages", "topics", "schema", "metadata", "message_definitions")
_STEPS = 1_000_000
"""Instructions of SQLite between two looks at how many there were."""
_STEPS_A_BYTE = 4
"""Instructions for each byte of a file; a message takes some fifty, and has a hundred bytes at least."""
_LEAST_STEPS = 50 * _STEPS


def bound_queries(connection: apsw.Connection, size: int) -> None:
    """Bounds what a database does when it is read: a query runs what the file states, as for a view.

    Values are no longer than the file, of `size` bytes, tables are plain ones, and a tree of pages that
    leads around ends.
    """
    size = max(size, 1 << 16)
    connection.limit(apsw.SQLITE_LIMIT_LENGTH, min(size, (1 << 31) - 1))
    connection.config(apsw.SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0)
    left = (_LEAST_STEPS + _STEPS_A_BYTE * size) // _STEPS

    def is_over() -> bool:
        nonlocal left
        left -= 1
        return left < 0

    connection.set_progress_handler(is_over, _STEPS)
    for name, kind in connection.execute(
        "SELECT name, type FROM sqlite_master WHERE type IN ('view', 'trigger')"
    ):
        raise ValueError(f"its database has a {kind} {name!r}, which no bag has")
    for table in _TABLES:
        for column, hidden in connection.execute("SELECT name, hidden FROM pragma_table_xinfo(?)", (table,)):
            if hidden:
                raise ValueError(f"column {column!r} of {table} is computed, as in no bag")


class BoundedZstd:
    """Unpacks for the library within a budget: by itself it has none."""

    def __init__(self, library: Any) -> None:  # noqa: ANN401 - a module
        self._library = library

    def open(self, file: BinaryIO, mode: str) -> _BoundedStream:
        """Opens a packed file for reading."""
        budget = unpacked_budget(file.seek(0, 2))
        file.seek(0)
        return _BoundedStream(self._library.open(file, mode), budget)

    def decompress(self, data: bytes) -> bytes:
        """Unpacks a message; raises `ValueError` where it becomes more than a message is."""
        unpacker = self._library.ZstdDecompressor()
        unpacked: bytes = unpacker.decompress(data, _LARGEST_MESSAGE)
        if not unpacker.eof:
            raise ValueError("a packed message has no end, or unpacks to too much")
        return unpacked


class _BoundedStream:
    def __init__(self, stream: Any, budget: int) -> None:  # noqa: ANN401 - as the library opens it
        self._stream = stream
        self._left = budget

    def __enter__(self) -> _BoundedStream:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def read(self, size: int) -> bytes:
        """Returns some of it; raises `ValueError` where that is more than readings are."""
        piece: bytes = self._stream.read(size)
        self._left -= len(piece)
        if self._left < 0:
            raise ValueError("a packed file unpacks to more than readings do")
        return piece


def unpacked_lz4(packed: bytes, size: int) -> bytes:
    """Unpacks a chunk; raises `ValueError` where it becomes more than it states, or than readings do."""
    return _unpacked(LZ4FrameDecompressor(), packed, size)


def unpacked_zstd(packed: bytes, size: int) -> bytes:
    """Unpacks a chunk; raises `ValueError` where it becomes more than it states, or than readings do."""
    return _unpacked(storage_mcap.zstd.ZstdDecompressor(), packed, size)  # type: ignore[attr-defined]


def _unpacked(unpacker: Any, packed: bytes, size: int) -> bytes:  # noqa: ANN401 - of two libraries
    unpacked: bytes = unpacker.decompress(packed, min(size, LARGEST_RATIO * len(packed)) + 1)
    if not unpacker.eof or len(unpacked) > size:
        raise ValueError("a compressed chunk has no end, or unpacks to too much")
    return unpacked
