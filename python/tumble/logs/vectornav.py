"""Sentences of VectorNav in text, as `$VNIMU,...*5A`: each with a checksum, by which bad ones are left out.

Source: VN-100, VN-200 and VN-300 user manuals, registers 15, 20, 27, 54 and 30 (what is appended), checksums.
"""

from __future__ import annotations

import binascii
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from numpy.typing import NDArray

from tumble.foundation.errors import LogError
from tumble.foundation.numbers import number_of
from tumble.foundation.recording import FloatArray
from tumble.logs.columns import ImuColumns, MagneticColumns
from tumble.logs.csv import CsvBlock, CsvRows, TextTable, imu_of_table
from tumble.logs.options import ReadOptions
from tumble.logs.text import TextLayout, is_time_stamp
from tumble.logs.text_file import open_text
from tumble.logs.track import DOCUMENTED, LoggedImu, StatedUnit, choose

_TRIADS = ("ax", "ay", "az", "gx", "gy", "gz")
_MAGNETOMETER = ("mx", "my", "mz")


@dataclass(frozen=True, slots=True)
class _Message:
    """A kind of sentence that holds both triads."""

    register: str
    fields: tuple[str, ...]
    compensated: bool
    """Indicates whether the calibration of the user and the estimates of the filter are applied."""


_MESSAGES: Mapping[str, _Message] = {
    "VNIMU": _Message("54", (*_MAGNETOMETER, *_TRIADS, "temperature", "pressure"), compensated=False),
    "VNYMR": _Message("27", ("yaw", "pitch", "roll", *_MAGNETOMETER, *_TRIADS), compensated=True),
    "VNQMR": _Message("15", ("qx", "qy", "qz", "qw", *_MAGNETOMETER, *_TRIADS), compensated=True),
    "VNMAR": _Message("20", (*_MAGNETOMETER, *_TRIADS), compensated=True),
}
_READ = "VNRRG"
"""Begins an answer to a reading of a register, whose number follows."""
_HEAD_BYTES = 1 << 18
_SENTENCE = re.compile(
    rb"^[^$\r\n]*\$(VN[A-Z]{3}),(?:(\d\d),)?[^$*\r\n]*\*[0-9A-Fa-f]{2,4}\r?$", re.MULTILINE
)
_NEWLINE, _RETURN, _DOLLAR, _STAR = (ord(each) for each in "\n\r$*")
_IS_MARK = bytes(int(byte in b"\n$*,") for byte in range(256))
"""Table for `bytes.translate`, which is three times as fast as indexing."""
_AS_COMMAS = bytes.maketrans(b"$*", b",,")
_HEX = np.full(256, 255, dtype=np.uint8)
_HEX[list(b"0123456789")] = np.arange(10)
_HEX[list(b"ABCDEF")] = _HEX[list(b"abcdef")] = np.arange(10, 16)
_Positions = NDArray[np.int64]
_Mask = NDArray[np.bool_]


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the kinds of sentences that hold both triads; one alone needs no name."""
    kinds = tuple(_kinds(path))
    return kinds if len(kinds) > 1 else ("",)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Reads the sentences of one kind; what stands before them, if a number or a date, is their time.

    Raises `LogError` where there is none that holds both triads.
    """
    kinds = _kinds(path)
    name = choose(path, tuple(kinds), imu, "kind of sentence")
    table = SentenceTable(path, kinds[name])
    columns = ImuColumns(
        ("ax", "ay", "az"),
        ("gx", "gy", "gz"),
        "time" if "time" in table.layout.names else None,
        "temperature" if "temperature" in table.layout.names else None,
        StatedUnit("m/s^2", DOCUMENTED),
        StatedUnit("rad/s", DOCUMENTED),
        temperature_unit=StatedUnit("degC", DOCUMENTED),
        magnetometer=MagneticColumns(_MAGNETOMETER, StatedUnit("G", DOCUMENTED)),
    )
    table.use(columns.names)

    def whole(names: Sequence[str]) -> Mapping[str, FloatArray]:
        sentences = SentenceTable(path, kinds[name])
        sentences.use(list(names))
        return sentences.whole()

    found = imu_of_table(path, table.layout, columns, options, table=table, whole=whole)
    compensated = _message_of(name).compensated
    assert found.magnetometer is not None
    return replace(
        found,
        imu=name if len(kinds) > 1 else "",
        format="vectornav",
        alone=len(kinds) == 1,
        columns=(),
        already_corrected=compensated,
        magnetometer=replace(found.magnetometer, already_corrected=compensated),
    )


def _message_of(kind: str) -> _Message:
    """Finds a kind of sentence, or of register as `VNRRG,54`."""
    register = kind.partition(",")[2]
    return _MESSAGES.get(kind) or next(each for each in _MESSAGES.values() if each.register == register)


@dataclass(frozen=True, slots=True)
class _Sentence:
    """The first sentence of a kind, and what is like it in those that follow."""

    kind: str
    """`VNIMU`, or `VNRRG,54`."""
    fields: tuple[str, ...]
    """Fields of its line, with `$` and `*` as commas."""
    begin: int
    """Number of those before the first field of the message."""


def _kinds(path: Path) -> dict[str, _Sentence]:
    """Finds the kinds of sentences in the head of a file that hold both triads."""
    with open_text(path) as file:
        head = file.read(_HEAD_BYTES)
    registers = {message.register for message in _MESSAGES.values()}
    found: dict[str, _Sentence] = {}
    for match in _SENTENCE.finditer(head):
        word, register = match[1].decode(), (match[2] or b"").decode()
        if word not in _MESSAGES and (word != _READ or register not in registers):
            continue
        kind = f"{word},{register}" if word == _READ else word
        line = match[0].rstrip(b"\r").translate(_AS_COMMAS).decode("ascii", "replace")
        begin = line.split(",").index(word) + 1 + (word == _READ)
        if kind not in found and len(line.split(",")) > begin + len(_message_of(kind).fields):
            found[kind] = _Sentence(kind, tuple(line.split(",")), begin)
    if not found:
        known = ", ".join(f"${word} (register {message.register})" for word, message in _MESSAGES.items())
        raise LogError(
            f"{path}: holds no sentences with acceleration and angular rate; let the sensor send {known}"
        )
    return found


class SentenceTable(TextTable):
    """The sentences of one kind as a table; others are passed over, damaged ones left out and counted."""

    def __init__(self, path: Path, sentence: _Sentence) -> None:
        self.layout = _layout(sentence)
        self._mark = np.frombuffer(b"$" + sentence.kind.encode() + b",", dtype=np.uint8)
        self._commas = len(sentence.fields) - 1
        super().__init__(path, self.layout, ())

    def use(self, names: list[str]) -> None:
        """Returns the columns to be read."""
        self._names = names

    def _parse(self, block: CsvBlock) -> CsvRows:
        kept, good, wrong = self._sentences(np.frombuffer(block.data, dtype=np.uint8))
        table = kept.translate(_AS_COMMAS)
        try:
            columns = self._parsed(table) if table else self._nothing()
        except pa.ArrowInvalid:
            columns = self._read_singly(table, good, wrong)
        bad: tuple[str, ...] = ()
        if wrong:
            first = 1 + self._newlines_before(block.offset)
            bad = tuple(f"line {first + number} {problem}" for number, problem in sorted(wrong.items()))
        return CsvRows(columns, bad)

    def _read_singly(self, table: bytes, good: _Positions, wrong: dict[int, str]) -> Mapping[str, FloatArray]:
        """Omits sentences with a right checksum and wrong fields, and adds them to the errors."""
        lines = table.split(b"\n")[: len(good)]
        problems = [
            self._problem(line.removesuffix(b"\r").decode("utf-8", "surrogateescape"), cut_off=False)
            for line in lines
        ]
        wrong |= {int(number): problem for number, problem in zip(good, problems, strict=True) if problem}
        rest = b"".join(line + b"\n" for line, problem in zip(lines, problems, strict=True) if not problem)
        try:
            return self._parsed(rest) if rest else self._nothing()
        except pa.ArrowInvalid as error:
            raise self._unread(1, error) from error

    def _is_left_out(self, line: bytes) -> bool:
        return not self._sentences(np.frombuffer(line, dtype=np.uint8))[0]

    def _sentences(self, data: NDArray[np.uint8]) -> tuple[bytes, _Positions, dict[int, str]]:
        """Returns the good lines of this kind, their numbers from 0, and what is wrong with others."""
        if not len(data) or data[-1] != _NEWLINE:
            data = np.append(data, np.uint8(_NEWLINE))
        marks = np.flatnonzero(np.frombuffer(data.tobytes().translate(_IS_MARK), dtype=np.bool_))
        kinds = data[marks]
        ends = marks[kinds == _NEWLINE]
        starts = np.concatenate([[0], ends[:-1] + 1])
        lasts = ends - (data[np.maximum(ends - 1, 0)] == _RETURN)
        dollars, stars = (
            _first_in(marks[kinds == byte], starts, lasts, len(data)) for byte in (_DOLLAR, _STAR)
        )
        other = (dollars < lasts) & ~self._is_marked(data, dollars, lasts)
        sound = (dollars < stars) & (stars < lasts) & ~other
        commas = marks[kinds != _NEWLINE]
        fields = np.searchsorted(commas, lasts) - np.searchsorted(commas, starts)
        right = _checked(data, dollars, stars, lasts, sound)
        good = sound & right & (fields == self._commas)
        wrong = {
            int(line): self._wrong(bytes(data[starts[line] : lasts[line]]), bool(right[line]))
            for line in np.flatnonzero(~good & ~other & (lasts > starts))
        }
        numbers = np.flatnonzero(good)
        if good.all():
            return data.tobytes(), numbers, wrong
        return data[np.repeat(good, ends + 1 - starts)].tobytes(), numbers, wrong

    def _is_marked(self, data: NDArray[np.uint8], dollars: _Positions, lasts: _Positions) -> _Mask:
        marked = dollars + len(self._mark) <= lasts
        for place, byte in enumerate(self._mark):
            marked &= data[np.minimum(dollars + place, len(data) - 1)] == byte
        return marked

    def _wrong(self, line: bytes, right: bool) -> str:
        sentence, star, stated = line.partition(b"$")[2].partition(b"*")
        if not star:
            return "is no whole sentence"
        if right:
            return f"has {line.count(b',') + 2} fields where {self._commas + 1} are usual"
        shown = ascii(stated[:8].decode("ascii", "replace"))
        computed = f"{_crc(sentence):04X}" if len(stated) == 4 else f"{_xor(sentence):02X}"
        return f"has checksum {shown} where {computed} was computed"


def _layout(sentence: _Sentence) -> TextLayout:
    names = [f"field {number + 1}" for number in range(len(sentence.fields))]
    fields = _message_of(sentence.kind).fields
    names[sentence.begin : sentence.begin + len(fields)] = fields
    before = sentence.fields[0].strip()
    if sentence.fields[1:2] and (number_of(before) is not None or is_time_stamp(before)):
        names[0] = "time"
    length = float(sum(map(len, sentence.fields)) + len(sentence.fields))
    return TextLayout(",", tuple(names), 0, 0, tuple(field.strip() for field in sentence.fields), length)


def _first_in(places: _Positions, starts: _Positions, lasts: _Positions, end: int) -> _Positions:
    """Returns the first of some places in each line, or its end."""
    places = np.append(places, end)
    first: _Positions = np.minimum(places[np.searchsorted(places, starts)], lasts)
    return first


def _checked(
    data: NDArray[np.uint8], dollars: _Positions, stars: _Positions, lasts: _Positions, sound: _Mask
) -> _Mask:
    """Returns for each line whether its checksum is right: eight bits in two digits, or sixteen in four."""
    digits = lasts - stars - 1
    computed = np.zeros(len(stars), dtype=np.uint8)
    if sound.any():
        spans = np.column_stack([dollars[sound] + 1, stars[sound]]).ravel()
        computed[sound] = np.bitwise_xor.reduceat(data, spans)[::2]
    high, low = (_HEX[data[np.minimum(stars + place, len(data) - 1)]] for place in (1, 2))
    right: _Mask = sound & (digits == 2) & (high < 16) & (low < 16) & (computed == (high << 4 | low))
    for line in np.flatnonzero(sound & (digits == 4)):
        stated = bytes(data[stars[line] + 1 : lasts[line]])
        right[line] = stated.upper() == b"%04X" % _crc(bytes(data[dollars[line] + 1 : stars[line]]))
    return right


def _xor(sentence: bytes) -> int:
    return int(np.bitwise_xor.reduce(np.frombuffer(sentence, dtype=np.uint8)))


def _crc(sentence: bytes) -> int:
    """CRC-16 of CCITT, beginning with zero."""
    return binascii.crc_hqx(sentence, 0)
