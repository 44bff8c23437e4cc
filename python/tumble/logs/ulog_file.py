"""ULog, the log file of PX4, block by block (docs.px4.io/main/en/dev_log/ulog_file_format).

pyulog reads what stands before the data: formats, parameters, facts. It would hold all of the data in memory,
so these are walked here, as its own loop does.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from pyulog.core import ULog  # type: ignore[import-untyped]

from tumble.foundation.errors import LogError
from tumble.foundation.files import once_per_file
from tumble.foundation.regular_files import open_regular
from tumble.logs.walk import Damage, walk

HEADER_BYTES = 16
SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
MOST_DEFINITIONS = 1 << 24
"""Bytes before the data; PX4 writes less than a hundredth."""
LARGEST_MESSAGE = 0xFFFF
"""Bytes that the length of a message can state."""
MOST_CHANGES = 10_000
"""Largest number of changes of parameters in one log."""
_MESSAGE = struct.Struct("<HB")
"""Length and kind."""
_HEAD = struct.Struct("<HBH")
"""Head with the number of the subscription, as data have it."""
_FORMAT, _INFO, _MORE_INFO, _PARAMETER, _DEFAULT, _FLAGS = b"FIMPQB"
_SUBSCRIPTION, _REMOVAL, _DATA, _DROPOUT, _SYNC = b"ARDOS"
_DEFINITIONS = frozenset((_FORMAT, _INFO, _MORE_INFO, _PARAMETER, _DEFAULT, _FLAGS))
_KINDS = frozenset(range(ord("A"), ord("Z") + 1))
"""Kinds of messages, including future ones, which are skipped."""
_TYPES = {
    "int8_t": "i1", "uint8_t": "u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4", "uint32_t": "<u4",
    "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8", "bool": "u1", "char": "S1",
}  # fmt: skip

_VECTORS = {
    "gyro_rad", "accelerometer_m_s2", "magnetometer_ga", "delta_angle", "delta_velocity", "mean_accel",
    "mean_gyro",
}  # fmt: skip
"""Fields that are arrays of three in every topic."""
_BATCHES = {"x", "y", "z"}
"""Fields that are arrays in topics of batches, and in no others."""

UlogRecords: TypeAlias = "np.ndarray[tuple[int], np.dtype[np.void]]"
"""Messages of a topic, by its fields; arrays of three are (n, 3)."""


@dataclass(frozen=True, slots=True, order=True)
class UlogTopic:
    """One instance of a topic."""

    name: str
    instance: int

    def __str__(self) -> str:
        return f"{self.name} {self.instance}"


@dataclass(frozen=True, slots=True)
class ULogFile:
    """Header and data of a log."""

    path: Path
    formats: Mapping[str, Any]
    """Formats as pyulog gives them, by topic."""
    parameters: Mapping[str, float]
    """Parameters at the start."""
    sections: tuple[tuple[int, int], ...]
    """Begin and end of data in the file; more than one section where some were appended."""
    clock: str
    """Names the time since start."""
    release: tuple[int, ...]
    """Release of PX4: major, minor, patch; empty where it is not stated."""

    def layout(self, topic: str) -> np.dtype[np.void]:
        """Returns the fields of a topic without padding at the end; no fields where it has no format."""
        return _layout(self.formats, topic)

    def blocks(
        self,
        wanted: Collection[str],
        damage: Damage,
        changed: Callable[[int, str, float], None] | None = None,
    ) -> Iterator[dict[UlogTopic, UlogRecords]]:
        """Returns the messages of these topics, those of about a megabyte of file at a time.

        `damage` counts errors; `changed` the time, us, name and value of each parameter
        that changes.
        """
        found = _Walk(self, wanted, damage, changed)
        with open_regular(self.path) as file:
            for start, end in self.sections:
                for _ in walk(file, start, end, found.messages, damage):
                    if records := found.records():
                        yield records


@once_per_file
def opened(path: Path) -> ULogFile:
    """Reads what stands before the data.

    Raises `LogError` where it is not whole.
    """
    size = path.stat().st_size
    start, definitions = _definitions(path)
    ulog = _described(path, definitions)
    offsets = sorted({offset for offset in ulog._appended_offsets if start < offset < size})
    numbers = {
        name: float(value)
        for name, value in ulog.initial_parameters.items()
        if isinstance(value, int | float)
    }
    edges = [start, *offsets, size]
    return ULogFile(
        path,
        ulog.message_formats,
        numbers,
        tuple(pairwise(edges)),
        f"{path.resolve()}#time since start",
        tuple(ulog.get_version_info() or ())[:3],
    )


def _definitions(path: Path) -> tuple[int, bytes]:
    """Returns where data begin, and all that stands before."""
    with open_regular(path) as file:
        read = file.read(HEADER_BYTES)
        if len(read) < HEADER_BYTES:
            raise LogError(f"{path}: is cut short in its first {HEADER_BYTES} bytes; copy it again")
        parts = [read]
        position = HEADER_BYTES
        while position < MOST_DEFINITIONS:
            header = file.read(_MESSAGE.size)
            if len(header) < _MESSAGE.size:
                break
            size, kind = _MESSAGE.unpack(header)
            if kind not in _DEFINITIONS:
                return position, b"".join(parts)
            body = file.read(size)
            if len(body) < size:
                break
            parts += [header, body]
            position += len(header) + size
    raise LogError(f"{path}: ends, or is damaged, before its data begin; copy it again")


def _described(path: Path, definitions: bytes) -> Any:  # noqa: ANN401 - pyulog has no types
    try:
        with redirect_stdout(io.StringIO()):  # where pyulog comments on the file
            return ULog(io.BytesIO(definitions), parse_header_only=True)
    except Exception as error:
        raise LogError(f"{path}: damaged before its data begin ({error}); copy it again") from error


def _layout(formats: Mapping[str, Any], topic: str) -> np.dtype[np.void]:
    names, types, offsets, offset = [], [], [], 0
    fields = list(formats[topic].fields) if topic in formats else []
    while fields and fields[-1][2].startswith("_padding"):
        fields.pop()
    for kind, count, name in fields:
        size = _size(formats, kind, 0) * max(count, 1)
        if kind in _TYPES and name not in names and _is_as_defined(topic, name, count):
            names.append(name)
            types.append((_TYPES[kind], (count,)) if count else _TYPES[kind])
            offsets.append(offset)
        offset += size
    if offset > LARGEST_MESSAGE:
        return np.dtype([])
    return np.dtype({"names": names, "formats": types, "offsets": offsets, "itemsize": offset})


def _is_as_defined(topic: str, name: str, count: int) -> bool:
    """Returns whether a field of `count` values, 0 of a single one, is what PX4 has under that name."""
    if name in _VECTORS:
        return count == 3
    return (count > 0) == (name in _BATCHES and topic.endswith("_fifo"))


_DEEPEST = 8


def _size(formats: Mapping[str, Any], kind: str, depth: int) -> int:
    """Returns the bytes of a type; more than any message has where its format makes no sense."""
    if kind in _TYPES:
        return np.dtype(_TYPES[kind]).itemsize
    if kind not in formats or depth > _DEEPEST:
        return LARGEST_MESSAGE + 1
    size = 0
    for inner, count, _ in formats[kind].fields:
        size += _size(formats, inner, depth + 1) * max(count, 1)
        if size > LARGEST_MESSAGE:
            break
    return size


@dataclass(slots=True)
class _Walk:
    """Steps from message to message."""

    log: ULogFile
    wanted: Collection[str]
    damage: Damage
    changed: Callable[[int, str, float], None] | None
    _layouts: dict[UlogTopic, np.dtype[np.void]] = field(default_factory=dict)
    _gathered: dict[UlogTopic, list[int]] = field(default_factory=dict)
    """Places of data in the block, by their topic."""
    _bound: dict[int, list[int]] = field(default_factory=dict)
    """Where data of a subscription are gathered, by its number, from its beginning to its end."""
    _block: bytes = b""
    _last: int = 0
    """us of the last data."""
    _begin: int = 0
    """Place of the block in the file."""

    def messages(self, data: bytes, position: int, whole: bool) -> int:
        """Splits off complete messages; returns their number of bytes."""
        self._block, self._begin = data, position
        at, length, last_data, head, places = 0, len(data), -1, _HEAD.unpack_from, self._bound
        while at + _HEAD.size <= length:
            size, kind, number = head(data, at)
            end = at + _MESSAGE.size + size
            if kind == _DATA and end <= length:
                last_data = at
                found = places.get(number)
                if found is not None:
                    found.append(at)
            elif kind not in _KINDS or not size:
                end = self._past_damage(data, at, whole)
                self.damage.add(position + at, end - at)
            elif end > length:
                break
            elif kind != _SYNC:
                self._note_time(data, last_data)
                self._handle(kind, data[at + _MESSAGE.size : end])
            at = end
        self._note_time(data, last_data)
        return at

    def _past_damage(self, data: bytes, at: int, whole: bool) -> int:
        """Finds where to go on: behind the next mark that is there for that."""
        found = data.find(SYNC, at + 1)
        if found >= 0:
            return found + len(SYNC)
        # The mark may lie across the end of this block.
        return len(data) if whole else max(at + 1, len(data) - len(SYNC) + 1)

    def _note_time(self, data: bytes, at: int) -> None:
        begin = at + _HEAD.size
        if at >= 0 and begin + 8 <= len(data):
            self._last = int.from_bytes(data[begin : begin + 8], "little")

    def _handle(self, kind: int, body: bytes) -> None:
        if kind == _SUBSCRIPTION and len(body) > 3:
            name = body[3:].decode("utf-8", "replace")
            number = int.from_bytes(body[1:3], "little")
            self._bound.pop(number, None)
            if name in self.wanted and (layout := self.log.layout(name)).names:
                topic = UlogTopic(name, body[0])
                self._layouts[topic] = layout
                self._bound[number] = self._gathered.setdefault(topic, [])
        elif kind == _REMOVAL and len(body) == 2:
            self._bound.pop(int.from_bytes(body, "little"), None)
        elif kind == _DROPOUT and len(body) == 2:
            self.damage.dropouts += 1
            self.damage.lost += int.from_bytes(body, "little")
        elif kind == _PARAMETER and self.changed is not None and body:
            kind_of, _, name = body[1 : 1 + body[0]].decode("utf-8", "replace").partition(" ")
            value = body[1 + body[0] :]
            if kind_of in ("float", "int32_t") and len(value) == 4:
                number = np.frombuffer(value, _TYPES[kind_of])[0]
                self.changed(self._last, name, float(number))

    def records(self) -> dict[UlogTopic, UlogRecords]:
        """Returns what stands in the last block, and forgets where."""
        found: dict[UlogTopic, UlogRecords] = {}
        content = np.frombuffer(self._block, np.uint8)
        for topic, places in self._gathered.items():
            layout = self._layouts[topic]
            begin = np.array(places, np.int64)
            places.clear()
            # Padding at the end may be left out of the file, or not.
            length = content[begin] + 256 * content[begin + 1].astype(np.int64) - (_HEAD.size - _MESSAGE.size)
            sound = length >= layout.itemsize
            if not sound.all():
                self.damage.add(self._begin + int(begin[~sound][0]), int(length[~sound].sum()))
            if sound.any():
                rows = sliding_window_view(content, layout.itemsize)[begin[sound] + _HEAD.size]
                found[topic] = rows.view(layout)[:, 0]
        return found
