"""Sizes to which the batches of a Feather file unpack, as the file itself states them; nothing is unpacked.

The footer lists the places of all batches, and each packed buffer begins with its length
(https://arrow.apache.org/docs/format/Columnar.html). Both are tables of FlatBuffers.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from typing import BinaryIO

_MAGIC = b"ARROW1"
_FOOTER_DICTIONARIES, _FOOTER_BATCHES = 2, 3
_MESSAGE_HEADER_TYPE, _MESSAGE_HEADER = 1, 2
_BATCH_BUFFERS, _BATCH_COMPRESSION = 2, 3
_DICTIONARY_DATA = 1
_IS_DICTIONARY_BATCH = 2
_BLOCK, _BUFFER = struct.Struct("<qi4xq"), struct.Struct("<qq")
_PREFIX = 8
"""Bytes of a mark and a length before each message."""
_STORED = -1
"""Length of a buffer that is not packed."""


def largest_unpacked(file: BinaryIO) -> int:
    """Returns the bytes that all dictionaries and the largest batch unpack to.

    Raises `ValueError`, `IndexError` or `struct.error` where the file is damaged.
    """
    end = file.seek(0, os.SEEK_END) - len(_MAGIC) - 4
    footer = _Table.root(_read(file, end - _int(_read(file, end, 4), 0), -1))
    dictionaries, batches = (
        [_batch_size(file, offset, length) for offset, length, _ in footer.structures(field, _BLOCK)]
        for field in (_FOOTER_DICTIONARIES, _FOOTER_BATCHES)
    )
    return sum(dictionaries) + max(batches, default=0)


def _batch_size(file: BinaryIO, offset: int, length: int) -> int:
    message = _Table.root(_read(file, offset + _PREFIX, length - _PREFIX))
    batch = message.table(_MESSAGE_HEADER)
    if message.byte(_MESSAGE_HEADER_TYPE) == _IS_DICTIONARY_BATCH:
        batch = batch.table(_DICTIONARY_DATA)
    is_packed = batch.place(_BATCH_COMPRESSION) is not None
    return sum(
        _unpacked(file, offset + length + place, size) if is_packed and size else _length(size)
        for place, size in batch.structures(_BATCH_BUFFERS, _BUFFER)
    )


def _unpacked(file: BinaryIO, place: int, size: int) -> int:
    (stated,) = struct.unpack("<q", _read(file, place, 8))
    return size if stated == _STORED else _length(int(stated))


def _length(stated: int) -> int:
    if stated < 0:
        raise ValueError("a length below zero")
    return stated


def _read(file: BinaryIO, place: int, size: int) -> bytes:
    if place < 0:
        raise ValueError("a place before the file")
    file.seek(place)
    return file.read(size)


def _int(data: bytes, place: int) -> int:
    return int(struct.unpack_from("<i", data, place)[0])


class _Table:
    """Table of FlatBuffers: places of its fields, by their number."""

    def __init__(self, data: bytes, start: int) -> None:
        self._data, self._start = data, start
        self._fields = start - _int(data, start)

    @classmethod
    def root(cls, data: bytes) -> _Table:
        """Returns the table that a buffer holds."""
        return cls(data, _int(data, 0))

    def place(self, field: int) -> int | None:
        """Returns where a field stands; None where the table has none."""
        size, slot = struct.unpack_from("<H", self._data, self._fields)[0], 4 + 2 * field
        found = struct.unpack_from("<H", self._data, self._fields + slot)[0] if slot < size else 0
        return self._start + found if found else None

    def byte(self, field: int) -> int:
        """Returns a field of one byte, 0 where there is none."""
        place = self.place(field)
        return 0 if place is None else self._data[place]

    def table(self, field: int) -> _Table:
        """Returns a table in it."""
        return _Table(self._data, self._target(field))

    def structures(self, field: int, form: struct.Struct) -> Iterator[tuple[int, ...]]:
        """Yields the structures of a vector, none where there is no vector."""
        if self.place(field) is not None:
            first = self._target(field)
            for number in range(_int(self._data, first)):
                yield form.unpack_from(self._data, first + 4 + number * form.size)

    def _target(self, field: int) -> int:
        place = self.place(field)
        if place is None:
            raise ValueError("a part is missing")
        return place + _int(self._data, place)
