"""MCAP files with messages of ROS 2 (CDR), ROS 1, JSON or protocol buffers."""

from __future__ import annotations

import os
import struct
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import IO, cast

from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, DataEnd, McapRecord, Metadata, Schema
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap.summary import Summary

from tumble.foundation.regular_files import open_regular
from tumble.foundation.words import count_of
from tumble.logs.bags import BagMessage, Topic, check_name, check_one_definition, kind_of, remedy
from tumble.logs.damage import damage_said
from tumble.logs.mcap_integrity import UpTo, check_summary, chunk_remarks, end_of_whole_records
from tumble.logs.message_form import Definition
from tumble.logs.options import ReadOptions
from tumble.logs.ros import imu_of, imus_of
from tumble.logs.rosmsg import CDR, ROS1, Encoding
from tumble.logs.track import LARGEST_RATIO, LoggedImu

FACTS = "tumble"
"""Name of the metadata record in which Tumble keeps what it knows of a recording."""

_ENCODINGS: dict[str, Encoding] = {"cdr": CDR, "ros1": ROS1}
_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_OP_MESSAGE = 5


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the topics that hold IMUs."""
    return imus_of(McapFile(path))


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds a topic with an IMU; raises `LogError` where there is none, or several and none is named."""
    return imu_of(McapFile(path), imu, options)


class McapFile:
    """An `.mcap` file."""

    format = "mcap"

    def __init__(self, path: Path) -> None:
        self.path = path
        with damage_said(path, remedy(path)), open_regular(path) as file:
            check = check_summary(file)
            file.seek(0)
            reader = make_reader(file)
            self._end = end_of_whole_records(file)
            is_readable = self._end is None and not check.is_damaged
            summary = reader.get_summary() if is_readable else None
            if summary is None or not summary.channels:
                summary, metadata = _summary_by_scan(file, self._end)
                if self._end is not None and not summary.channels:
                    raise EndOfFile("it breaks off before its first message")
            else:
                metadata = list(reader.iter_metadata())
            for channel in summary.channels.values():
                check_name(channel.topic)
            for schema in summary.schemas.values():
                check_name(schema.name)
            self._summary = summary
            self._facts = {
                key: value
                for record in metadata
                if record.name == FACTS
                for key, value in record.metadata.items()
            }
            self.remarks = (
                *filter(None, [check.remark]),
                *_where_it_breaks_off(file, self._end),
                *chunk_remarks(file, summary),
            )

    def all_topics(self) -> dict[str, str]:
        """Type of every topic, by name."""
        schemas = self._summary.schemas
        return {
            channel.topic: schemas[channel.schema_id].name if channel.schema_id in schemas else "no schema"
            for channel in self._summary.channels.values()
        }

    def definitions(self) -> dict[str, Definition]:
        """Definitions of the messages of each topic; those of JSON need no schema."""
        return dict(self._definitions())

    def _definitions(self) -> Iterator[tuple[str, Definition]]:
        none = Schema(id=0, name="", encoding="", data=b"")
        for channel in self._summary.channels.values():
            schema = self._summary.schemas.get(channel.schema_id, none)
            yield channel.topic, Definition(channel.message_encoding, schema.name, schema.data)

    def topics(self) -> list[Topic]:
        """Topics of the kinds we read."""
        found = []
        for channel in self._summary.channels.values():
            schema = self._summary.schemas.get(channel.schema_id)
            kind = kind_of(schema.name) if schema else None
            if kind is not None and channel.message_encoding in _ENCODINGS:
                found.append(Topic(channel.topic, kind, _ENCODINGS[channel.message_encoding]))
        return found

    def facts(self) -> dict[str, str]:
        """Returns what Tumble wrote beside the messages."""
        return self._facts

    def messages(self, names: Collection[str]) -> Iterator[BagMessage]:
        """Messages of those topics, in the order of the file."""
        wanted = {
            channel.id: channel.topic for channel in self._summary.channels.values() if channel.topic in names
        }
        check_one_definition(self.path, (each for each in self._definitions() if each[0] in names))
        with damage_said(self.path, remedy(self.path)), open_regular(self.path) as file:
            if self._summary.chunk_indexes:
                yield from self._indexed(file, wanted)
            else:
                yield from _by_scan(file, self._end, wanted)

    def _indexed(self, file: IO[bytes], wanted: Mapping[int, str]) -> Iterator[BagMessage]:
        """Reads only chunks that hold a wanted topic; a chunk without an index may hold any."""
        for index in sorted(self._summary.chunk_indexes, key=lambda index: index.chunk_start_offset):
            offsets = index.message_index_offsets
            if offsets and wanted.keys().isdisjoint(offsets):
                continue
            file.seek(index.chunk_start_offset)
            chunk = next(StreamReader(file, skip_magic=True, emit_chunks=True).records)
            assert isinstance(chunk, Chunk)
            yield from _messages(chunk, wanted)


def _summary_by_scan(file: IO[bytes], end: int | None) -> tuple[Summary, list[Metadata]]:
    """Gathers channels and metadata from the whole of a file without a summary, or with a damaged one."""
    summary, metadata = Summary(), []
    for record in _records(file, end):
        if isinstance(record, Schema):
            summary.schemas[record.id] = record
        elif isinstance(record, Channel):
            summary.channels[record.id] = record
        elif isinstance(record, Metadata):
            metadata.append(record)
    return summary, metadata


def _by_scan(file: IO[bytes], end: int | None, wanted: Mapping[int, str]) -> Iterator[BagMessage]:
    for record in _records(file, end):
        if isinstance(record, McapMessage) and record.channel_id in wanted:
            yield BagMessage(wanted[record.channel_id], record.log_time, record.data)


def _records(file: IO[bytes], end: int | None) -> Iterator[McapRecord]:
    """Passes over the data; the summary after it, which may be damaged, only repeats them.

    A file that breaks off is read up to `end`, as far as its records are whole.
    """
    file.seek(0)
    readable = file if end is None else cast("IO[bytes]", UpTo(file, end))
    try:
        for record in StreamReader(readable, validate_crcs=True).records:
            yield record
            if isinstance(record, DataEnd):
                return
    except EndOfFile:
        if end is None:
            raise


def _where_it_breaks_off(file: IO[bytes], end: int | None) -> Iterator[str]:
    if end is not None:
        lost = file.seek(0, os.SEEK_END) - end
        yield f"the file breaks off: its last {count_of('byte', lost)} are no whole record, and left out"


def _messages(chunk: Chunk, wanted: Mapping[int, str]) -> Iterator[BagMessage]:
    """Walks the records of a chunk (mcap.dev/spec): an opcode, a length, the content."""
    if chunk.uncompressed_size > LARGEST_RATIO * (len(chunk.data) + 1):
        raise ValueError(f"a chunk of {len(chunk.data)} bytes says it unpacks to {chunk.uncompressed_size}")
    stream, length = get_chunk_data_stream(chunk, validate_crc=True)
    data = stream.read(length)
    position = 0
    while position < length:
        opcode, size = _RECORD.unpack_from(data, position)
        start = position + _RECORD.size
        position = start + size
        if opcode == _OP_MESSAGE:
            channel, _, log_time, _ = _MESSAGE.unpack_from(data, start)
            if channel in wanted:
                yield BagMessage(wanted[channel], log_time, data[start + _MESSAGE.size : position])
