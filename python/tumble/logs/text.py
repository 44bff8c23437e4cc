"""Layout of a text log: delimiter, names, and the first row of numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import islice, pairwise
from pathlib import Path

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.magnetic import MAGNETIC_CHANNELS
from tumble.foundation.numbers import number_of, whole_number
from tumble.foundation.schemas import schema_in
from tumble.foundation.units import CHANNELS
from tumble.foundation.words import count_of, quoted
from tumble.logs.columns import recognise
from tumble.logs.options import ReadOptions
from tumble.logs.text_file import open_text, text_size
from tumble.logs.units import credible, find_unit, guess_accelerometer_unit, rest_norm

AFTER_LAST = "(behind the last delimiter)"
"""Name of the empty column behind rows that end in a delimiter."""
BLANKS = " "
"""Stands for a delimiter of any run of spaces and tabs."""

_HEAD_BYTES = 1 << 18
_LINES_SEARCHED = 200
_COMMENTS = (b"#", b"%", b"//")
_ROWS_SEARCHED = 1000
_DELIMITERS = (",", ";", "\t", "|", BLANKS)
PLAIN_NAMES: Mapping[int, tuple[str, ...]] = {
    6: CHANNELS,
    7: ("time", *CHANNELS),
}
"""Names of columns that have none, by their number."""
MAGNETIC_PLAIN_NAMES: Mapping[int, tuple[str, ...]] = {
    3: MAGNETIC_CHANNELS,
    4: ("time", *MAGNETIC_CHANNELS),
}
"""The same where a magnetometer alone is looked for."""
_NOT_TEXT = bytes(set(range(32)) - set(b"\t\n\r\f"))
_FEW_BYTES = 4
"""Bytes that a serial line garbles in a short log, which is text all the same."""
_ROWS_COMPARED = 25
_SIGNS = (",", ";", ":", "=")
_SIGN = re.compile("[,;:=\t]")
_CELLS = re.compile("[,;=\t]")
_CLOCK_TIME = re.compile(r"\d{2}:\d{2}:\d{2}(\.\d{1,9})?")
_TIME_STAMP = re.compile(r"\d{4}-\d{2}-\d{2}[T ]\d{2}:\d{2}")


@dataclass(frozen=True, slots=True)
class TextLayout:
    """Layout by which a reader reads a text log block by block."""

    delimiter: str
    names: tuple[str, ...]
    data_offset: int
    """Bytes before the first row of numbers."""
    lines_before: int
    """Lines before the first row of numbers."""
    first_row: tuple[str, ...]
    """Fields of the first row that is whole."""
    row_bytes: float
    """Typical length of a row."""
    decimal_point: str = "."
    preamble: dict[str, str] = field(default_factory=dict)
    """Values of lines of the form `key, value` before the columns, keys in lower case."""
    notices: tuple[str, ...] = ()
    quoted: bool = False
    """Indicates whether fields stand in quotes; a stray quote would otherwise swallow the lines up to the
    next."""

    def first_field(self, name: str) -> str:
        """Returns what a column holds in the first row; empty where that breaks off before it."""
        position = self.names.index(name)
        return self.first_row[position] if position < len(self.first_row) else ""


def split_line(line: str, delimiter: str, quotes: str = '"') -> list[str]:
    """Fields of a line, without the blanks and quotes around them."""
    parts = line.split() if delimiter == BLANKS else line.split(delimiter)
    return [part.strip().strip(quotes) for part in parts]


@dataclass(frozen=True, slots=True)
class SoughtTable:
    """Contents expected of a table, by which its line of names is found."""

    what: str
    """Name in messages."""
    columns: str
    """Names of columns that messages show."""
    is_known: Callable[[str], bool]
    """Returns whether a name is that of a column of such a table."""


def _is_channel(name: str) -> bool:
    column = recognise(name)
    return column is not None and column.quantity in ("accelerometer", "gyroscope", "magnetometer")


LOG = SoughtTable("log", "ax, ay, az, gx, gy, gz", _is_channel)


def find_layout(path: Path, options: ReadOptions, sought: SoughtTable = LOG) -> TextLayout:
    """Finds delimiter, column names and first row of numbers.

    Raises `LogError` where the file is not text, or holds neither names nor, of a log, rows of numbers.
    """
    lines = _head_lines(path)
    preamble: dict[str, str] = {}
    offset = sum(len(line) for line in lines[: options.skip_lines])
    for number, raw in enumerate(lines[options.skip_lines :][:_LINES_SEARCHED], start=options.skip_lines + 1):
        offset += len(raw)
        text = _decode(raw).strip()
        body = text.lstrip("#%/").strip()
        delimiter = names_delimiter(body, options, sought)
        if delimiter is not None:
            return _named(path, lines, number, offset, split_line(body, delimiter), preamble, sought)
        if sought is LOG and not text.startswith(("#", "%")) and numbers_delimiter(text) is not None:
            return _unnamed(path, lines, number, offset - len(raw), options, preamble)
        preamble |= _key_value(body)
    if lines[options.skip_lines :]:
        shown = _decode(lines[options.skip_lines]).strip()
        first_line = f"; line {options.skip_lines + 1} reads {quoted(shown)}"
    else:
        first_line = ""
    found_no = "neither" if sought is LOG else "no"
    or_rows = " nor rows of numbers" if sought is LOG else ""
    raise LogError(
        f"{path}: not a {sought.what}: found {found_no} column names such as {sought.columns}{or_rows}"
        f"{first_line}"
    )


def _head_lines(path: Path) -> list[bytes]:
    with open_text(path) as file:
        head = file.read(_HEAD_BYTES)
        whole = not file.read(1)
    if not _is_text(head):
        raise LogError(f"{path}: not a log: neither text nor Parquet, ROS bag or MCAP")
    if (stated := schema_in(head)) is not None:
        raise LogError(f"{path}: is a {stated.what}, not a log; give another file")
    if head.lstrip()[:1] in (b"{", b"[", b"<"):
        raise LogError(
            f"{path}: not a log but JSON or XML; expected a table, or objects of JSON, with one sample per "
            "line"
        )
    lines = head.splitlines(keepends=True)
    return lines if whole or len(lines) < 2 else lines[:-1]


def _is_text(head: bytes) -> bool:
    odd = len(head) - len(head.translate(None, _NOT_TEXT))
    return odd <= max(_FEW_BYTES, len(head) // 100)


def _decode(line: bytes) -> str:
    """Reads a line as UTF-8 or, where it is none, as Windows writes it in the west: `°/s`, `µs`."""
    try:
        return line.decode("utf-8-sig")
    except UnicodeDecodeError:
        return line.decode("cp1252", errors="replace")


def names_delimiter(text: str, options: ReadOptions, sought: SoughtTable = LOG) -> str | None:
    """Delimiter with which most fields of a line are names of columns we look for; None if none is."""
    return _names_delimiter(text, frozenset(options.columns.values()), sought)


@lru_cache(maxsize=256)  # A line that is none is looked at again and again where a device repeats it.
def _names_delimiter(text: str, stated: frozenset[str], sought: SoughtTable) -> str | None:
    wanted = {name for name in stated if whole_number(name) is None}

    def known(delimiter: str) -> int:
        return sum(name in wanted or sought.is_known(name) for name in split_line(text, delimiter))

    best = max(_DELIMITERS, key=known)
    fields = len(split_line(text, best))
    # Prose may hold a word or two that look like names; a row of names holds little else.
    needed = (fields + 1) // 2 if best == BLANKS else 1
    return best if fields > 1 and known(best) >= needed else None


def numbers_delimiter(text: str) -> str | None:
    """Delimiter that splits a line into most numbers, at least two; None if it does not."""
    counts = {delimiter: len(split_line(text, delimiter)) for delimiter in _DELIMITERS}
    numeric = [
        delimiter
        for delimiter in _DELIMITERS
        if counts[delimiter] > 1
        and all(_is_number(part, _decimal_point(text, delimiter)) for part in split_line(text, delimiter))
    ]
    return max(numeric, key=lambda delimiter: counts[delimiter]) if numeric else None


def _decimal_point(text: str, delimiter: str) -> str:
    return "," if delimiter != "," and "," in text and "." not in text else "."


def _is_number(text: str, decimal_point: str = ".") -> bool:
    return not text or number_of(text, decimal_point) is not None


def _key_value(text: str) -> dict[str, str]:
    """Returns the value of a line `key, value` by its key; nothing of any other line."""
    first = _SIGN.search(text)
    if first is None:
        return {}
    key, rest = text[: first.start()].strip().lower(), text[first.start() :].lstrip()
    sign, value = (rest[0], rest[1:]) if rest[:1] in _SIGNS else ("\t", rest)
    # A colon and a blank introduce one value, as Tumble writes it; other signs part cells of a table.
    is_one = sign == ":" and value[:1].isspace()
    value = value.strip().rstrip(",;").rstrip()
    return {key: value} if key and value and (is_one or not _CELLS.search(value)) else {}


def _named(
    path: Path,
    lines: Sequence[bytes],
    number: int,
    offset: int,
    names: list[str],
    preamble: dict[str, str],
    sought: SoughtTable,
) -> TextLayout:
    full = (line for line in lines[number : number + _ROWS_SEARCHED] if line.strip())
    whole = [_decode(line).rstrip("\r\n") for line in islice(full, _ROWS_COMPARED)]
    skipped = sum(not line.startswith(_COMMENTS) for line in lines[: number - 1])
    if whole and (units := _units(whole[0], names)):
        offset += sum(map(len, lines[number : number + 1]))
        number, whole, names = number + 1, whole[1:], _with_units(names, units)
    rows = [line.strip() for line in whole]
    if not rows:
        if (text_size(path) or 0) > sum(map(len, lines)):
            raise LogError(
                f"{path}: no line of samples ends within its first {_HEAD_BYTES >> 10} kB; give a log with a "
                "sample a line, and fewer columns"
            )
        raise LogError(f"{path}: line {number} names columns, but no samples follow")
    row = _soundest(rows, len(names))
    delimiter = _row_delimiter(row, len(names))
    _refuse_repeated(path, number, names, sought)
    if _end_in_delimiter(whole, delimiter, len(names)):
        names.append(AFTER_LAST)
    return TextLayout(
        delimiter,
        tuple(names),
        offset,
        number,
        tuple(split_line(row, delimiter)),
        _row_bytes(lines[number:]),
        _decimal_point(row, delimiter),
        preamble,
        (f"skipped {count_of('line', skipped)} before the column names",) if skipped else (),
        _are_quoted(rows),
    )


def _units(line: str, names: Sequence[str]) -> list[str]:
    """Returns the units in the line below the names, as Consensys writes them; empty if it holds none."""
    units = split_line(line, _row_delimiter(line, len(names)))
    if len(units) != len(names) or any(number_of(unit) is not None for unit in units):
        return []
    units = [unit.replace("(", "").replace(")", "") for unit in units]
    columns = [recognise(name) for name in names]
    pairs = zip(units, columns, strict=True)
    return units if any(column and find_unit(unit, column.quantity) for unit, column in pairs) else []


def _with_units(names: Sequence[str], units: Sequence[str]) -> list[str]:
    """Writes the unit behind each name that states none."""
    return [
        f"{name} [{unit}]" if unit and name and not name.endswith(("]", ")")) else name
        for name, unit in zip(names, units, strict=True)
    ]


def _end_in_delimiter(rows: Sequence[str], delimiter: str, columns: int) -> bool:
    """Returns whether a delimiter stands behind the last field of most rows, as MT Manager writes it."""
    if delimiter == BLANKS:
        return False
    ended = [row.endswith(delimiter) and len(row.split(delimiter)) == columns + 1 for row in rows]
    return 2 * sum(ended) > len(ended)


def _soundest(rows: Sequence[str], columns: int) -> str:
    """Returns the first row of numbers and dates alone, else the one with most of them."""
    whole = (row for row in rows if _sound_fields(row, columns) == columns)
    return next(whole, None) or max(rows, key=lambda row: _sound_fields(row, columns))


def _sound_fields(row: str, columns: int) -> int:
    """Counts numbers and dates in a row of that many columns; -1 if it has more or fewer."""
    delimiter = _row_delimiter(row, columns)
    return _sound_by(row, delimiter) if len(split_line(row, delimiter)) == columns else -1


def _sound_by(row: str, delimiter: str) -> int:
    """Counts numbers and dates in a row by that delimiter."""
    decimal_point = _decimal_point(row, delimiter)
    fields = split_line(row, delimiter)
    return sum(
        is_time_stamp(field) or is_clock_time(field) or _is_number(field, decimal_point) for field in fields
    )


def _row_delimiter(row: str, columns: int) -> str:
    """Rows may be split otherwise than names: of delimiters that give as many fields, by most numbers.

    Decimal commas may be as many as semicolons. Blanks come last, a time stamp may hold one.
    """
    fitting = [delimiter for delimiter in _DELIMITERS if len(split_line(row, delimiter)) == columns]
    if fitting:
        return max(fitting, key=lambda delimiter: _sound_by(row, delimiter))
    return max(_DELIMITERS, key=lambda delimiter: len(split_line(row, delimiter)))


def _refuse_repeated(path: Path, number: int, names: list[str], sought: SoughtTable) -> None:
    met: set[str] = set()
    for position, name in enumerate(names):
        if name in met:
            if recognise(name) is not None or sought.is_known(name):
                raise LogError(f"{path}: line {number} names column {name!r} twice; rename one of them")
            names[position] = f"{name}#{position + 1}"
        met.add(names[position])


def _unnamed(
    path: Path,
    lines: Sequence[bytes],
    number: int,
    offset: int,
    options: ReadOptions,
    preamble: dict[str, str],
) -> TextLayout:
    whole = [_decode(line).rstrip("\r\n") for line in lines[number - 1 :][:_ROWS_SEARCHED] if line.strip()]
    rows = [line.strip() for line in whole]
    row, delimiter = _typical_row(rows)
    fields = split_line(row, delimiter)
    names, notices = names_for(path, rows, delimiter, len(fields), options)
    before = _decode(lines[number - 2]).strip().lstrip("#%") if number > 1 else ""
    header = split_line(before, delimiter)
    titled = len(header) == len(fields) and not any(map(_is_number, header))
    if titled and not options.columns and number - 1 > options.skip_lines:
        names, notices = tuple(header), ()
    if _end_in_delimiter(whole, delimiter, len(fields)):
        names = (*names, AFTER_LAST)
    return TextLayout(
        delimiter,
        names,
        offset,
        number - 1,
        tuple(fields),
        _row_bytes(lines[number - 1 :]),
        _decimal_point(row, delimiter),
        preamble,
        notices,
        _are_quoted(rows),
    )


def _typical_row(rows: Sequence[str]) -> tuple[str, str]:
    """Returns the first row as wide as most, and their delimiter: the very first may be torn."""
    delimiters = [(row, numbers_delimiter(row)) for row in rows[:_ROWS_COMPARED]]
    numeric = [(row, delimiter) for row, delimiter in delimiters if delimiter is not None]
    shapes = [(delimiter, len(split_line(row, delimiter))) for row, delimiter in numeric]
    usual = Counter(shapes).most_common(1)[0][0]
    return numeric[shapes.index(usual)]


def names_for(
    path: Path | str, rows: Sequence[str], delimiter: str, count: int, options: ReadOptions
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names for columns that have none, and remarks: by position if the user maps them, else as usual."""
    known = PLAIN_NAMES if options.need_imu else {**PLAIN_NAMES, **MAGNETIC_PLAIN_NAMES}
    if options.columns or count not in known:
        return tuple(str(position + 1) for position in range(count)), ()
    names = known[count]
    if "time" in names and not increases([split_line(row, delimiter)[0] for row in rows]):
        wanted = MAGNETIC_CHANNELS if count in MAGNETIC_PLAIN_NAMES else CHANNELS
        example = ",".join(f"{channel}={number}" for number, channel in enumerate(wanted, start=1))
        raise LogError(
            f"{path}: {count} columns without names, and the first is not time; "
            f"say which is which, as --columns {example}"
        )
    assumed = "no column names: assumed to be "
    if count in PLAIN_NAMES and _gyroscope_stands_first(rows, delimiter):
        names = (*names[:-6], *names[-3:], *names[-6:-3])
        return names, (f"{assumed}{', '.join(names)}, as only the last three read gravity",)
    return names, (f"{assumed}{', '.join(names)}",)


def _gyroscope_stands_first(rows: Sequence[str], delimiter: str) -> bool:
    """Returns whether the last three of six columns have the length of gravity."""
    fields = [split_line(row, delimiter)[-6:] for row in rows]
    read = [
        [number_of(field, _decimal_point(row, delimiter)) for field in split]
        for row, split in zip(rows, fields, strict=True)
    ]
    whole = np.array([row for row in read if len(row) == 6 and None not in row], dtype=np.float64)
    if len(whole) == 0:
        return False
    triads = (credible(whole[:, :3]), credible(whole[:, 3:]))
    first, last = (guess_accelerometer_unit(rest_norm(triad)) for triad in triads)
    return first is None and last is not None


def increases(texts: Sequence[str]) -> bool:
    """Returns whether numbers hardly ever decrease, as times do."""
    read = (number_of(text, ",") for text in texts)
    numbers = [number for number in read if number is not None]
    backwards = sum(earlier > later for earlier, later in pairwise(numbers))
    return backwards <= len(numbers) // 20


def _row_bytes(lines: Sequence[bytes]) -> float:
    return sum(map(len, lines)) / max(1, len(lines))


def _are_quoted(rows: Sequence[str]) -> bool:
    compared = rows[:_ROWS_COMPARED]
    return 2 * sum('"' in row for row in compared) > len(compared)


def is_time_stamp(text: str) -> bool:
    """Returns whether a field is a date and time such as `2024-05-01T12:00:00.25`."""
    return _TIME_STAMP.match(text) is not None


def is_clock_time(text: str) -> bool:
    """Returns whether a field is a time of day such as `12:00:00.25`."""
    return _CLOCK_TIME.fullmatch(text) is not None
