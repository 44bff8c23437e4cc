"""Lines of JSON: an object a sample, as programs write them beside live sources; see `json_objects`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import is_file
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of, quoted
from tumble.logs.columns import ImuColumns, find_imus, recognise
from tumble.logs.csv import samples_of
from tumble.logs.json_objects import numbers_in, object_in, with_defined_units
from tumble.logs.magnetometer import magnetometer_in
from tumble.logs.options import ReadOptions
from tumble.logs.own_stamps import with_own_stamps
from tumble.logs.row_labels import LabelColumn, NamedImu, choose_row_imu, label_names, named_imus, of_label
from tumble.logs.text_file import open_text, text_size
from tumble.logs.track import CHUNK_SAMPLES, LoggedImu, RawSamples, Transform

_HEAD_LINES = 400
_LONGEST_LINE = 1 << 16
"""Bytes of a line, from which on it is read as several."""
_FEWEST = 2
"""Samples of a log: a file of one object is a document."""
_QUANTITIES = ("accelerometer", "gyroscope", "magnetometer")


@dataclass(frozen=True, slots=True)
class _Fields:
    """Fields of the objects at the beginning of a log."""

    names: tuple[str, ...]
    """Paths of numbers, in the order in which they first came, then names of texts that label rows."""
    marks: frozenset[str]
    """Fields of which each sample has one."""
    line_bytes: float
    skipped: int
    """Lines before the first sample."""


def recognises(path: Path, head: bytes) -> bool:
    """Returns whether most lines of a file are objects of JSON that hold samples."""
    return b"{" in head and is_file(path) and _find(path, ReadOptions()) is not None


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the prefixes of fields, and the labels of objects."""
    fields = _fields(path, options)
    return tuple(_named(path, fields, find_imus(fields.names, path, options), options))


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds the fields of one IMU; raises `LogError` where there is none such, or several and none named."""
    fields = _fields(path, options)
    imus = find_imus(fields.names, path, options)
    named = _named(path, fields, imus, options)
    name = choose_row_imu(path, named, imus, imu)
    columns = with_defined_units(imus[named[name].prefix], fields.names)

    def opened(columns: ImuColumns) -> LoggedImu:
        found = _logged(path, fields, columns)
        return of_label(replace(found, imu=name, alone=len(imus) == 1), named[name], name)

    return with_own_stamps(opened, columns, options)


def _logged(path: Path, fields: _Fields, columns: ImuColumns) -> LoggedImu:
    wanted = columns.names

    def read(transform: Transform) -> Iterator[RawSamples]:
        for table in _tables(path, fields, wanted):
            yield transform(replace(samples_of(table.columns, columns), bad_lines=table.bad))

    def head() -> RawSamples:
        return next(read(lambda samples: samples))

    def whole(names: Sequence[str]) -> Mapping[str, FloatArray]:
        tables = [table.columns for table in _tables(path, fields, names)]
        return {name: np.concatenate([np.empty(0), *(table[name] for table in tables)]) for name in names}

    size = text_size(path)
    skipped = (f"skipped {count_of('line', fields.skipped)} before the first sample",)
    return LoggedImu(
        path=path,
        imu="",
        format="json_lines",
        read=read,
        head=head,
        locate=lambda sample: f"line {_line_of(path, fields, sample)}",
        accelerometer_unit=columns.accelerometer_unit,
        gyroscope_unit=columns.gyroscope_unit,
        time_unit=columns.time_unit,
        temperature_unit=columns.temperature_unit,
        clock=f"{path.resolve()}#{columns.time or 'row'}",
        triads=columns.triads,
        magnetometer=magnetometer_in(columns, whole),
        columns=fields.names,
        expected=None if size is None else int(size / fields.line_bytes),
        notices=skipped if fields.skipped else (),
    )


def _named(
    path: Path, fields: _Fields, imus: Mapping[str, ImuColumns], options: ReadOptions
) -> dict[str, NamedImu]:
    """Returns the IMUs of a log, by the prefix of fields and by a field that names the unit of an object."""

    def gather(_columns: ImuColumns, name: str) -> LabelColumn:
        column = LabelColumn(name)
        column.add_words([_word(value.get(name)) for _, value, _ in _samples(path, fields)])
        return column

    return named_imus(imus, fields.names, options, gather)


def _word(value: object) -> object:
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _fields(path: Path, options: ReadOptions) -> _Fields:
    found = _find(path, options)
    if found is None:
        raise LogError(f"{path}: its lines are not objects of JSON that hold samples")
    return found


def _find(path: Path, options: ReadOptions) -> _Fields | None:
    """Finds the fields of the first objects; None where most lines are none, or no field is a channel."""
    with open_text(path) as file:
        head = list(islice(iter(lambda: file.readline(_LONGEST_LINE), b""), _HEAD_LINES))
    lines = [line for line in map(_decoded, head[options.skip_lines :]) if line.strip("[] \t\r\n,")]
    objects = [object_in(line) for line in lines]
    whole = [value for value in objects if value is not None]
    names = list(dict.fromkeys(name for value in whole for name in numbers_in(value) or {}))
    stated = set(options.columns.values())
    marks = frozenset(name for name in names if name in stated or _is_channel(name))
    first = next((k for k, value in enumerate(objects) if value is not None and _is_sample(value, marks)), 0)
    texts = dict.fromkeys(name for value in whole for name, each in value.items() if isinstance(each, str))
    samples = sum(_is_sample(value, marks) for value in whole)
    if samples < _FEWEST or 2 * samples < len(lines[first:]):
        return None
    labels = (name for name in label_names(tuple(texts)) if name not in names)
    return _Fields((*names, *labels), marks, sum(map(len, head)) / len(head), first)


def _is_channel(name: str) -> bool:
    column = recognise(name)
    return column is not None and column.quantity in _QUANTITIES


def _is_sample(value: dict[str, Any], marks: frozenset[str]) -> bool:
    return not marks.isdisjoint(numbers_in(value) or {})


@dataclass(frozen=True, slots=True)
class _Table:
    """Numbers of successive samples."""

    columns: Mapping[str, FloatArray]
    bad: tuple[str, ...]


def _tables(path: Path, fields: _Fields, wanted: Sequence[str]) -> Iterator[_Table]:
    """Yields some fields of samples by the chunk; what an object lacks is NaN."""
    rows: list[list[float]] = []
    bad: list[str] = []

    def table() -> _Table:
        values: FloatArray = np.array(rows, dtype=np.float64).reshape(len(rows), len(wanted))
        return _Table(dict(zip(wanted, values.T, strict=True)), tuple(bad))

    for _, value, fault in _lines(path, fields):
        if fault:
            bad.append(fault)
            continue
        numbers = numbers_in(value) or {}
        rows.append([numbers.get(name, np.nan) for name in wanted])
        if len(rows) == CHUNK_SAMPLES:
            yield table()
            rows, bad = [], []
    if rows or bad:
        yield table()


def _samples(path: Path, fields: _Fields) -> Iterator[tuple[int, dict[str, Any], str]]:
    return (each for each in _lines(path, fields) if not each[2])


def _lines(path: Path, fields: _Fields) -> Iterator[tuple[int, dict[str, Any], str]]:
    """Yields number and object of each line with a sample, or its fault; other objects are passed over."""
    begun = False
    with open_text(path) as file:
        for number, raw in enumerate(iter(lambda: file.readline(_LONGEST_LINE), b""), start=1):
            line = _decoded(raw)
            value = object_in(line)
            if value is not None:
                if _is_sample(value, fields.marks):
                    begun = True
                    yield number, value, ""
            elif begun and line.strip("[] \t\r\n,"):
                yield number, {}, f"line {number} reads {quoted(line.strip())}, which is no object of JSON"


def _line_of(path: Path, fields: _Fields, sample: int) -> int:
    return next(islice((number for number, _, _ in _samples(path, fields)), sample, None))


def _decoded(line: bytes) -> str:
    return line.decode("utf-8", errors="replace")
