"""Lines in which words stand before the numbers, as sketches for Arduino print them to a serial monitor.

Examples: `12:34:56.789 -> 1, 2, ...` of the monitor of the Arduino IDE, `a/g: 1 2 ...` of i2cdevlib,
`AccX:0.1,AccY:...` for its plotter, and three lines a sample with units of the Adafruit libraries. All lines
of a kind have the same words; the first line of a sample is that whose kind comes first in the log.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import islice
from pathlib import Path

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import is_file
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of, quoted
from tumble.logs.columns import ImuColumns, find_imus, recognise
from tumble.logs.csv import samples_of
from tumble.logs.magnetometer import magnetometer_in
from tumble.logs.options import ReadOptions
from tumble.logs.row_labels import LabelColumn, NamedImu, choose_row_imu, named_imus, of_label
from tumble.logs.text import LOG, PLAIN_NAMES, names_delimiter, names_for
from tumble.logs.text_file import open_text, text_size
from tumble.logs.track import CHUNK_SAMPLES, LoggedImu, RawSamples, StatedUnit, Transform
from tumble.logs.units import find_unit

_HEAD_LINES = 400
_LONGEST_LINE = 1000
_NUMBER = re.compile(r"(?<![\w.^/])[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?(?![\w^])")
_BETWEEN = re.compile(f"({_NUMBER.pattern})")
"""Splits a line into words, of which every second one is a number."""
_CLOCK = re.compile(r"\s*(\d{1,2}):(\d\d):(\d\d(?:\.\d+)?)\s*->\s?")
"""Time of day, s, that the monitor of the Arduino IDE puts before each line."""
_LETTER = re.compile("[A-Za-z]")
_LINES_THAT_SHOW = 10
"""Lines of a head that hold at least one of each kind."""
_DAY = 86400.0
_TIME = "monitor time [s]"
_USUAL_SHARE = 0.5
"""Share of the most frequent kind of line: kinds of lines that come as often belong to a sample."""
_FEWEST_NUMBERS, _FEWEST_SAMPLES = 6, 3
_LONGEST_LABEL = 60
_KINDS_KNOWN = 256
_ROTATION = re.compile(r"(?i)(gyro )?rotation\b")


@dataclass(frozen=True, slots=True)
class _Layout:
    """The kinds of lines of a sample, in their order, and the names of their numbers."""

    kinds: tuple[str, ...]
    names: tuple[str, ...]
    has_clock: bool
    line_bytes: float
    skipped: int
    """Lines before the first sample."""
    example: str
    notices: tuple[str, ...] = ()


def recognises(path: Path, head: bytes) -> bool:
    """Returns whether most lines of a file are words and numbers of the same few kinds."""
    return is_file(path) and _has_words(head) and _find(path, ReadOptions()) is not None


def _has_words(head: bytes) -> bool:
    """Returns whether words, or a clock, stand before numbers in the last lines of a head.

    Lines of a table do not, which spares most logs the search for kinds of lines.
    """
    texts = map(_decoded, head.splitlines()[:-1][-_LINES_THAT_SHOW:])
    return any(_CLOCK.match(text) or _LETTER.search(_kind(text)) for text in texts)


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the names of the IMUs."""
    layout = _layout(path, options)
    return tuple(_named(path, layout, find_imus(layout.names, path, options), options))


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Reads one IMU; its time is that of the monitor, or of a number with such a label.

    Raises `LogError` where no label names a channel.
    """
    layout = _layout(path, options)
    imus = find_imus(layout.names, path, options)
    named = _named(path, layout, imus, options)
    name = choose_row_imu(path, named, imus, imu)
    columns = imus[named[name].prefix]
    if columns.time is None and layout.has_clock:
        columns = replace(columns, time=_TIME, time_unit=StatedUnit("s", "time of the monitor"))
    size = text_size(path)

    def whole(names: Sequence[str]) -> Mapping[str, FloatArray]:
        tables = [table.columns for table in _tables(path, layout)]
        return {each: np.concatenate([np.empty(0), *(table[each] for table in tables)]) for each in names}

    def read(transform: Transform) -> Iterator[RawSamples]:
        for samples, _ in _samples(path, layout, columns):
            yield transform(samples)

    def head() -> RawSamples:
        found = next(_samples(path, layout, columns), None)
        if found is None:
            raise LogError(f"{path}: holds no samples")
        return found[0]

    found_imu = LoggedImu(
        path=path,
        imu=name,
        format="labelled",
        read=read,
        head=head,
        locate=lambda sample: f"line {_line_of(path, layout, columns, sample)}",
        accelerometer_unit=columns.accelerometer_unit,
        gyroscope_unit=columns.gyroscope_unit,
        time_unit=columns.time_unit,
        temperature_unit=columns.temperature_unit,
        clock=f"{path.resolve()}#{columns.time or 'row'}",
        triads=columns.triads,
        magnetometer=magnetometer_in(columns, whole),
        columns=layout.names,
        alone=len(imus) == 1,
        expected=None if size is None else int(size / layout.line_bytes / len(layout.kinds)),
        notices=layout.notices,
    )
    return of_label(found_imu, named[name], name)


def _named(
    path: Path, layout: _Layout, imus: Mapping[str, ImuColumns], options: ReadOptions
) -> dict[str, NamedImu]:
    """Returns the IMUs of a log, by the prefix of labels and by a number that names the IMU of a sample."""

    def gather(_columns: ImuColumns, name: str) -> LabelColumn:
        column = LabelColumn(name)
        for table in _tables(path, layout):
            column.add_numbers(table.columns[name])
        return column

    return named_imus(imus, layout.names, options, gather)


def _layout(path: Path, options: ReadOptions) -> _Layout:
    layout = _find(path, options)
    if layout is None:
        raise LogError(f"{path}: its lines are not words and numbers of the same few kinds")
    return layout


def _find(path: Path, options: ReadOptions) -> _Layout | None:
    """Finds the kinds of lines; None where the file is no such log, or is a plain table."""
    with open_text(path) as file:
        head = list(islice(iter(lambda: file.readline(_LONGEST_LINE), b""), _HEAD_LINES))
    if len(head) == _HEAD_LINES or (head and not head[-1].endswith(b"\n")):
        head = head[:-1]
    lines = [_decoded(line) for line in head[options.skip_lines :]]
    clocked = [_CLOCK.match(line) for line in lines]
    has_clock = 2 * sum(map(bool, clocked)) > len(lines)
    texts = [line[match.end() :] if match else line for line, match in zip(lines, clocked, strict=True)]
    kinds = [_kind(text) for text in texts]
    counted = Counter(kind for kind, text in zip(kinds, texts, strict=True) if _NUMBER.search(text))
    if not counted:
        return None
    most = counted.most_common(1)[0][1]
    usual = {kind for kind, count in counted.items() if count >= max(_FEWEST_SAMPLES, _USUAL_SHARE * most)}
    order = tuple(dict.fromkeys(kind for kind in kinds if kind in usual))
    labelled = has_clock or any(_LETTER.search(kind) for kind in order)
    filled = [kind for kind in kinds if kind]
    if not order or not labelled or 2 * sum(kind in usual for kind in filled) < len(filled):
        return None
    first = next(at for at, kind in enumerate(kinds) if kind == order[0])
    if sum(kind.count("#") for kind in order) < _FEWEST_NUMBERS and len(order) > 1:
        return None
    found = _names(path, lines, texts, kinds, order, options)
    if found is None:
        return None
    names, notices = found
    skipped = sum(1 for kind in kinds[:first] if kind)
    words = (
        "time is that of the monitor, at which the lines came"
        if not _LETTER.search(order[0])
        else f"skipped the words before the numbers, as in {quoted(texts[first].strip())}"
    )
    before = (f"skipped {count_of('line', skipped)} before the first sample",) if skipped else ()
    return _Layout(
        order,
        names,
        has_clock,
        sum(map(len, head)) / max(1, len(head)),
        skipped,
        texts[first],
        (*before, words, *notices),
    )


def _names(
    path: Path,
    lines: Sequence[str],
    texts: Sequence[str],
    kinds: Sequence[str],
    order: Sequence[str],
    options: ReadOptions,
) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
    """Names the numbers of a sample by their labels, by a line of names, or else by their positions."""
    examples = [texts[kinds.index(kind)] for kind in order]
    names = [name for example in examples for name in _labels(example)]
    channels = [column for name in names if (column := recognise(name)) and column.quantity not in ("time",)]
    if len({(column.quantity, column.axis) for column in channels if column.quantity != "temperature"}) >= 3:
        return _distinct(names), ()
    by_clock = any(_CLOCK.match(text) for text in lines[:_HEAD_LINES])
    if len(order) > 1 or not (by_clock or re.match(r"[^#,;]*:", order[0])):
        return None
    count = order[0].count("#")
    header = next((text for text in texts if names_delimiter(text.strip(), options, LOG)), None)
    if header is not None:
        titles = re.split(r"[,;\t]", header.strip()) if re.search(r"[,;\t]", header) else header.split()
        titles = [title.strip() for title in titles]
        if len(titles) == count:
            return _distinct(titles), ()
    if count not in PLAIN_NAMES and not options.columns:
        return None
    rows = [
        " ".join(_NUMBER.findall(text)) for text, kind in zip(texts, kinds, strict=True) if kind == order[0]
    ]
    try:
        return names_for(path, rows, " ", count, options)
    except LogError:
        return None


def _distinct(names: Sequence[str]) -> tuple[str, ...]:
    counts: Counter[str] = Counter()
    distinct = []
    for name in names:
        counts[name] += 1
        distinct.append(name if counts[name] == 1 else f"{name}#{counts[name]}")
    return tuple(distinct)


def _labels(text: str) -> list[str]:
    """Names each number of a line: the words before it, those that begin the line, and a unit at its end."""
    words = _NUMBER.split(text)
    labels = [re.sub(r"[^\w/ ]+", " ", word).strip()[:_LONGEST_LABEL] for word in words]
    tail = words[-1].strip(" ,;\t\r\n") or next((word for word in reversed(words[1:-1]) if _unit(word)), "")
    first = labels[0].rsplit(" ", 1)[0] if " " in labels[0] else ""
    names = []
    for position, label in enumerate(labels[:-1]):
        own = words[position + 1].split()[:1]
        unit = own[0].strip(",;") if own and _unit(own[0].strip(",;")) else tail if _unit(tail) else ""
        whole = f"{first} {label}" if position and first and len(label) <= 1 else label
        if _ROTATION.search(whole) and find_unit(unit, "gyroscope"):
            whole = _ROTATION.sub("gyroscope", whole)
        for word in words[position + 1 :][:1]:
            whole = whole.removeprefix(word.strip()) if _unit(word.strip()) and position else whole
        named = f"{whole} [{unit}]"
        # The next word, and the last one of a line, may be the unit of something else.
        is_own = unit and not ((column := recognise(named)) and column.unknown)
        names.append(named if is_own else whole)
    return names


def _unit(text: str) -> bool:
    return any(
        find_unit(text, quantity)
        for quantity in ("accelerometer", "gyroscope", "temperature", "time", "magnetometer")
    )


def _kind(text: str) -> str:
    """Returns the words of a line, each number of it as #."""
    return _kind_of(*_BETWEEN.split(text)[::2])


@lru_cache(maxsize=_KINDS_KNOWN)
def _kind_of(*words: str) -> str:
    """Returns the kind of a line of these words, the same ones line after line, with a number between two."""
    return re.sub(r"\s+", " ", "#".join(words)).strip()


def _decoded(line: bytes) -> str:
    return line.decode("utf-8", errors="replace").rstrip("\r\n")


def _lines(path: Path, layout: _Layout) -> Iterator[tuple[int, float, str, str, list[str]]]:
    """Returns number, time of day, s, text and kind of each line of a sample, and the numbers in it."""
    days, last = 0.0, 0.0
    with open_text(path) as file:
        for number, raw in enumerate(iter(lambda: file.readline(_LONGEST_LINE), b""), start=1):
            line, time = _decoded(raw), np.nan
            if layout.has_clock and (match := _CLOCK.match(line)):
                hours, minutes, seconds = (float(group) for group in match.groups())
                time = 3600.0 * hours + 60.0 * minutes + seconds
                if time < last - 0.5 * _DAY:
                    days += _DAY
                last, line = time, line[match.end() :]
            parts = _BETWEEN.split(line)
            kind = _kind_of(*parts[::2])
            if kind:
                yield number, time + days, line, kind, parts[1::2]


@dataclass(frozen=True, slots=True)
class _Table:
    """Numbers of successive samples."""

    columns: Mapping[str, FloatArray]
    lines: list[int]
    """Line at which each sample begins."""
    bad: tuple[str, ...]


def _samples(path: Path, layout: _Layout, columns: ImuColumns) -> Iterator[tuple[RawSamples, list[int]]]:
    """Returns samples by the chunk, each with the line at which it begins."""
    for table in _tables(path, layout):
        yield replace(samples_of(table.columns, columns), bad_lines=table.bad), table.lines


def _tables(path: Path, layout: _Layout) -> Iterator[_Table]:
    """Returns the numbers of whole samples by the chunk."""
    rows: list[list[float]] = []
    numbers: list[int] = []
    bad: list[str] = []
    began, stamp = 0, np.nan
    part: list[float] = []

    def chunk() -> _Table:
        table: FloatArray = np.array(rows, dtype=np.float64).reshape(len(rows), len(layout.names) + 1)
        named = dict(zip((*layout.names, _TIME), table.T, strict=True))
        return _Table(named, list(numbers), tuple(bad))

    expected = 0
    for number, time, text, kind, found in _lines(path, layout):
        if kind != layout.kinds[expected]:
            if began and (part or kind not in layout.kinds) and numbers:
                bad.append(f"line {number} reads {quoted(text.strip())}, unlike the lines of other samples")
            expected, part = 0, []
            if kind != layout.kinds[0]:
                continue
        if expected == 0:
            began, stamp, part = number, time, []
        part = [*part, *map(float, found)]
        expected = (expected + 1) % len(layout.kinds)
        if expected == 0:
            rows.append([*part, stamp])
            numbers.append(began)
            part = []
        if len(rows) == CHUNK_SAMPLES:
            yield chunk()
            rows, numbers, bad = [], [], []
    if rows:
        yield chunk()


def _line_of(path: Path, layout: _Layout, columns: ImuColumns, sample: int) -> int:
    for _, numbers in _samples(path, layout, columns):
        if sample < len(numbers):
            return numbers[sample]
        sample -= len(numbers)
    raise AssertionError(f"{path}: no sample {sample}")
