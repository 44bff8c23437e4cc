"""DataFlash, the log of ArduPilot, as bytes (`.bin`) or as lines of text (`.log`), block by block.

Every message is laid out by a FMT message before it. pymavlink defines the letters of a layout; its
reader would note where each message of the file stands, so that these are walked here.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from pymavlink.DFReader import FORMAT_TO_STRUCT  # type: ignore[import-untyped]

from tumble.foundation.errors import LogError
from tumble.foundation.numbers import number_of
from tumble.foundation.regular_files import open_regular
from tumble.foundation.words import quoted
from tumble.logs.walk import Damage, walk

DataflashRecords: TypeAlias = "np.ndarray[tuple[int], np.dtype[np.void]]"
"""Messages of one name, by their columns."""

MARK = b"\xa3\x95"
FMT = 0x80
PARAMETER = "PARM"
_HEADER = 3
_FORMAT = np.dtype([("type", "u1"), ("length", "u1"), ("name", "S4"), ("letters", "S16"), ("columns", "S64")])
_ARRAY = "a"
_ARRAYS = {"ISBD": {"x", "y", "z"}}
"""Columns that are arrays, by the name of the message; in all others columns are single values."""
_EMPTY = (0x00, 0xFF)
"""Bytes that fill the last page of a log."""


@dataclass(slots=True)
class _Layout:
    """Layout of the messages of one name."""

    name: str
    letters: str
    columns: tuple[str, ...]

    def binary(self) -> np.dtype[np.void]:
        """Returns the fields; no fields where letters and columns do not fit."""
        named = all(self.columns) and len(set(self.columns)) == len(self.columns) == len(self.letters)
        if not named or not set(self.letters) <= FORMAT_TO_STRUCT.keys():
            return np.dtype([])
        arrays = {name for name, letter in zip(self.columns, self.letters, strict=True) if letter == _ARRAY}
        if arrays != _ARRAYS.get(self.name, set()):
            return np.dtype([])
        return np.dtype(
            [(name, _type(letter)) for name, letter in zip(self.columns, self.letters, strict=True)]
        )

    def factors(self) -> dict[str, float]:
        """Returns what a column is to be multiplied by, where that is not one."""
        pairs = zip(self.columns, self.letters, strict=True)
        return {name: factor for name, letter in pairs if (factor := FORMAT_TO_STRUCT[letter][1])}


def _type(letter: str) -> object:
    if letter == _ARRAY:
        return "<i2", (32,)
    text = FORMAT_TO_STRUCT[letter][0]
    return f"S{text[:-1]}" if text.endswith("s") else f"<{text}"


def _text(content: bytes) -> str:
    return content.rstrip(b"\0").decode("ascii", "replace")


@dataclass(slots=True)
class BinaryLog:
    """A `.bin` file."""

    path: Path

    def blocks(self, wanted: Collection[str], damage: Damage) -> Iterator[dict[str, DataflashRecords]]:
        """Returns the messages of these names, those of about a megabyte of file at a time."""
        yield from _blocks(self.path, _BinaryWalk(wanted, damage, _Layouts(self.path)))


@dataclass(slots=True)
class _Layouts:
    """Layouts by the name of the message."""

    path: Path
    _known: dict[str, _Layout] = field(default_factory=dict)

    def define(self, layout: _Layout) -> None:
        """Takes the layout of a name; raises `LogError` where it had another, as messages before have."""
        if self._known.setdefault(layout.name, layout) != layout:
            raise LogError(
                f"{self.path}: defines the message {quoted(layout.name)} a second time, with other columns, "
                "as two logs in one file do; split it where the second begins"
            )

    def __getitem__(self, name: str) -> _Layout:
        return self._known[name]


def _blocks(path: Path, found: _BinaryWalk | _TextWalk) -> Iterator[dict[str, DataflashRecords]]:
    with open_regular(path) as file:
        for _ in walk(file, 0, path.stat().st_size, found.messages, found.damage):
            if records := found.records():
                yield records


@dataclass(slots=True)
class _BinaryWalk:
    wanted: Collection[str]
    damage: Damage
    layouts: _Layouts
    _lengths: list[int] = field(default_factory=lambda: [0] * 256)
    _gathered: dict[str, list[bytes]] = field(default_factory=dict)
    """Messages by their name."""
    _bound: dict[int, list[bytes]] = field(default_factory=dict)
    """Where messages of a type are gathered, from its definition to the next of that type."""

    def __post_init__(self) -> None:
        self._lengths[FMT] = _HEADER + _FORMAT.itemsize

    def messages(self, data: bytes, position: int, whole: bool) -> int:
        """Splits off complete messages; returns their number of bytes."""
        at, length, lengths, gathered = 0, len(data), self._lengths, self._bound
        while at + _HEADER <= length:
            kind = data[at + 2]
            size = lengths[kind]
            if data[at] != MARK[0] or data[at + 1] != MARK[1] or not size:
                end = self._next_mark(data, at, whole)
                if not _is_filler(data[at:end]):
                    self.damage.add(position + at, end - at)
                at = end
                continue
            end = at + size
            if end > length:
                break
            parts = gathered.get(kind)
            if parts is not None:
                parts.append(data[at + _HEADER : end])
            elif kind == FMT:
                self._define(data[at + _HEADER : end])
            at = end
        return at

    def _next_mark(self, data: bytes, at: int, whole: bool) -> int:
        found = data.find(MARK, at + 1)
        if found >= 0:
            return found
        return len(data) if whole else max(at + 1, len(data) - 1)

    def _define(self, body: bytes) -> None:
        described = np.frombuffer(body, _FORMAT)[0]
        kind, name = int(described["type"]), _text(described["name"])
        if kind == FMT:
            return
        layout = _Layout(name, _text(described["letters"]), tuple(_text(described["columns"]).split(",")))
        self._lengths[kind] = int(described["length"]) if described["length"] >= _HEADER else 0
        self._bound.pop(kind, None)
        fields = layout.binary()
        if name in self.wanted and fields.names and fields.itemsize + _HEADER == described["length"]:
            self.layouts.define(layout)
            self._bound[kind] = self._gathered.setdefault(name, [])

    def records(self) -> dict[str, DataflashRecords]:
        """Returns what was gathered, and forgets it."""
        found: dict[str, DataflashRecords] = {}
        for name, parts in self._gathered.items():
            if parts:
                layout = self.layouts[name]
                found[name] = _scaled(np.frombuffer(b"".join(parts), layout.binary()), layout.factors())
                parts.clear()
        return found


def _is_filler(piece: bytes) -> bool:
    return any(piece.count(byte) == len(piece) for byte in _EMPTY)


def _scaled(records: DataflashRecords, factors: dict[str, float]) -> DataflashRecords:
    if not factors:
        return records
    names = records.dtype.names or ()
    kinds = [(name, "<f8" if name in factors else records.dtype[name]) for name in names]
    scaled = np.empty(len(records), np.dtype(kinds))
    for name in names:
        scaled[name] = records[name] / round(1.0 / factors[name]) if name in factors else records[name]
    return scaled


@dataclass(slots=True)
class TextLog:
    """A `.log` file: the same messages as lines, which Mission Planner and sdlog write."""

    path: Path

    def blocks(self, wanted: Collection[str], damage: Damage) -> Iterator[dict[str, DataflashRecords]]:
        """Returns the messages of these names, those of about a megabyte of file at a time."""
        yield from _blocks(self.path, _TextWalk(wanted, damage, _Layouts(self.path)))


@dataclass(slots=True)
class _TextWalk:
    wanted: Collection[str]
    damage: Damage
    layouts: _Layouts
    _gathered: dict[str, list[bytes]] = field(default_factory=dict)

    def messages(self, data: bytes, position: int, whole: bool) -> int:
        """Splits off complete lines; returns their number of bytes."""
        used = len(data) if whole else data.rfind(b"\n") + 1
        for line in data[:used].split(b"\n"):
            name, _, rest = line.partition(b",")
            parts = self._gathered.get(name.decode("ascii", "replace"))
            if parts is not None:
                parts.append(rest)
            elif name == b"FMT":
                self._define(rest)
        return used

    def _define(self, rest: bytes) -> None:
        fields = [_text(each.strip()) for each in rest.split(b",")]
        if len(fields) > 4 and (name := fields[2]) in self.wanted:
            self.layouts.define(_Layout(name, fields[3], tuple(fields[4:])))
            self._gathered.setdefault(name, [])

    def records(self) -> dict[str, DataflashRecords]:
        """Returns what was gathered, and forgets it."""
        found: dict[str, DataflashRecords] = {}
        for name, lines in self._gathered.items():
            layout = self.layouts[name]
            if lines and layout.binary().names:
                found[name] = records = _table(lines, layout)
                self.damage.lines += len(lines) - len(records)
            lines.clear()
        return {name: records for name, records in found.items() if len(records)}


def _table(lines: list[bytes], layout: _Layout) -> DataflashRecords:
    """Reads those lines that have all columns, and numbers where these are numbers."""
    split = (line.split(b",") for line in lines)
    rows = [row for row in split if len(row) == len(layout.columns)]
    fields = layout.binary()
    columns = {
        name: _column([row[at].strip() for row in rows], fields[name].kind == "S")
        for at, name in enumerate(layout.columns)
    }
    sound = np.logical_and.reduce([values == values for values in columns.values()])
    records = np.empty(
        int(np.count_nonzero(sound)), np.dtype([(name, values.dtype) for name, values in columns.items()])
    )
    for name, values in columns.items():
        records[name] = values[sound]
    return records


def _column(texts: list[bytes], is_text: bool) -> np.ndarray[tuple[int], np.dtype[Any]]:
    """Returns numbers, NaN for what is none."""
    if is_text:
        return np.array(texts, "S64")
    try:
        if b"_" not in b"".join(texts):  # which NumPy reads as Python does: 1_0 as ten
            return np.array(texts, dtype="S").astype(np.float64)
    except ValueError:
        pass
    return np.array([_number(text) for text in texts])


def _number(text: bytes) -> float:
    found = number_of(text.decode("latin-1"))
    return float("nan") if found is None else found
