"""Integrity checks of an MCAP file: its checksums and its index, and the damage they find (mcap.dev/spec)."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from typing import IO, NamedTuple

import numpy as np
from mcap.records import ChunkIndex
from mcap.summary import Summary

_MAGIC = b"\x89MCAP0\r\n"
_FOOTER = struct.Struct("<BQQQI")
_CHUNK_HEAD = struct.Struct("<BQQQQI")
_INDEX_HEAD = struct.Struct("<BQHI")
_OP_FOOTER, _OP_MESSAGE_INDEX, _OP_DATA_END, _LAST_OP = 2, 7, 15, 15
_RECORD = struct.Struct("<BQ")
_ENTRY = np.dtype([("log_time", "<u8"), ("offset", "<u8")])
_RECORD_HEAD = 9
"""Bytes of the operation and the length before each record."""


class SummaryCheck(NamedTuple):
    """Reliability of the summary at the end of a file, which holds its index."""

    is_damaged: bool
    remark: str
    """Remark for the user; empty if the summary was checked and is whole, or there is none."""


def check_summary(file: IO[bytes]) -> SummaryCheck:
    """Verifies the summary's checksum. Whoever reads a file without an end handles that."""
    size = file.seek(0, os.SEEK_END)
    tail_size = _FOOTER.size + len(_MAGIC)
    if size < tail_size:
        return SummaryCheck(False, "")
    file.seek(size - tail_size)
    tail = file.read(tail_size)
    if not tail.endswith(_MAGIC):
        return SummaryCheck(False, "")
    opcode, length, start, _, checksum = _FOOTER.unpack_from(tail)
    end = size - len(_MAGIC) - 4
    if opcode != _OP_FOOTER or length != _FOOTER.size - _RECORD_HEAD or start > end:
        return SummaryCheck(True, "the footer is damaged: read without the index")
    if start == 0:
        return SummaryCheck(False, "")
    if checksum == 0:
        return SummaryCheck(False, "the index carries no checksum: damage to it would not show")
    file.seek(start)
    if zlib.crc32(file.read(end - start)) != checksum:
        return SummaryCheck(True, "the index is damaged, its checksum differs: read without it")
    return SummaryCheck(False, "")


def end_of_whole_records(file: IO[bytes]) -> int | None:
    """Returns where the last whole record of a file that breaks off ends; None where its data have an end.

    A file that lost power holds whole records, then a part of one, or what the disk held before.
    """
    size = file.seek(0, os.SEEK_END)
    file.seek(max(0, size - len(_MAGIC)))
    if file.read() == _MAGIC:
        return None
    position = len(_MAGIC)
    while position + _RECORD_HEAD <= size:
        file.seek(position)
        opcode, length = _RECORD.unpack(file.read(_RECORD_HEAD))
        if opcode == _OP_DATA_END:
            return None
        if not 0 < opcode <= _LAST_OP or length > size - position - _RECORD_HEAD:
            break
        position += _RECORD_HEAD + length
    return min(position, size)


class UpTo:
    """A file that ends where its whole records do."""

    def __init__(self, file: IO[bytes], end: int) -> None:
        self._file, self._end = file, end

    def read(self, size: int = -1) -> bytes:
        """Returns up to that many bytes, none behind the end."""
        left = max(0, self._end - self._file.tell())
        return self._file.read(left if size < 0 else min(size, left))


def chunk_remarks(file: IO[bytes], summary: Summary) -> Iterator[str]:
    """Describes the number of chunks that cannot be checked, and of those with a damaged index."""
    chunks = summary.chunk_indexes
    unchecked = sum(not _has_checksum(file, chunk) for chunk in chunks)
    if unchecked:
        yield f"{unchecked} of {len(chunks)} chunks carry no checksum: damaged readings would not show"
    damaged = sum(not _index_is_whole(file, chunk) for chunk in chunks)
    if damaged:
        yield f"the index of messages is damaged in {damaged} of {len(chunks)} chunks: it is not used"


def _has_checksum(file: IO[bytes], chunk: ChunkIndex) -> bool:
    file.seek(chunk.chunk_start_offset)
    head = file.read(_CHUNK_HEAD.size)
    return len(head) == _CHUNK_HEAD.size and bool(_CHUNK_HEAD.unpack(head)[-1])


def _index_is_whole(file: IO[bytes], chunk: ChunkIndex) -> bool:
    """Returns whether the records after a chunk match the summary: lists of messages, one a channel."""
    for channel, offset in chunk.message_index_offsets.items():
        file.seek(offset)
        head = file.read(_INDEX_HEAD.size)
        if len(head) < _INDEX_HEAD.size:
            return False
        opcode, length, named, entries_size = _INDEX_HEAD.unpack(head)
        if (opcode, named) != (_OP_MESSAGE_INDEX, channel) or length != entries_size + 6:
            return False
        if entries_size % _ENTRY.itemsize or entries_size > chunk.message_index_length:
            return False
        entries = np.frombuffer(file.read(entries_size), _ENTRY)
        times = entries["log_time"]
        if (times < chunk.message_start_time).any() or (times > chunk.message_end_time).any():
            return False
        if (entries["offset"] >= chunk.uncompressed_size).any():
            return False
    return True
