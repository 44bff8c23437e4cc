"""Variables of a file, arrays under names: what NumPy, MATLAB and HDF5 files have in common.

A variable becomes columns of a table: (n,) is one, (n, 3) named as a triad is three, the fields of a
structured array are one each. The words that name channels of tables name
theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import join, quoted
from tumble.logs.ahead import ahead
from tumble.logs.columns import ImuColumns, find_imus, recognise
from tumble.logs.csv import RATE_KEYS
from tumble.logs.damage import COPY_OR_SAVE, damage_said
from tumble.logs.magnetometer import magnetometer_in
from tumble.logs.options import ReadOptions
from tumble.logs.own_stamps import with_own_stamps
from tumble.logs.row_labels import LabelColumn, NamedImu, choose_named, named_imus, of_label
from tumble.logs.text import PLAIN_NAMES
from tumble.logs.track import (
    CHUNK_SAMPLES,
    LoggedImu,
    LoggedMagnetometer,
    RawSamples,
    Transform,
)
from tumble.logs.triads import gather
from tumble.logs.units_beside import with_units_beside

MOST_VARIABLES = 10_000
"""Largest number of variables in one file; more is no log."""

_MOST_COLUMNS = 64
"""Largest number of columns of one variable; the rows of a wider one are no samples."""
_AXES = 3
_SEPARATOR = "/"
"""Separator of the names of groups, structures and their contents."""


@dataclass(frozen=True, slots=True)
class Variable:
    """An array of a file that can be read piece by piece."""

    name: str
    """Name with its groups or structures: `imu0/acc`; empty where a file holds one without name."""
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    """That of a structured array, which has one axis, names its fields."""
    pieces: Callable[[int], Iterator[NDArray[Any]]]
    """Starts a fresh pass along an axis: arrays of the same shape but for that axis, in order."""
    unit: str = ""
    """Unit that the file states beside the name."""
    columns: tuple[str, ...] = ()
    """Names of the columns of a table, where the file states them."""


@dataclass(frozen=True, slots=True)
class VariablesFile:
    """Contents of a file of variables."""

    path: Path
    format: str
    variables: Sequence[Variable]
    numbers: Mapping[str, float]
    """Single numbers, by name: a rate may be among them."""
    serial: str = ""
    remedy: str = COPY_OR_SAVE
    """Remedy for a damaged file."""
    block: int = CHUNK_SAMPLES
    """Samples that are read before they are put in place: as many as the file gives without delay."""


@dataclass(frozen=True, slots=True)
class _Place:
    """Where the numbers of a column stand."""

    variable: Variable
    axis: int
    """Axis of the array along which samples follow one another."""
    keys: tuple[int | str, ...] = ()
    """Names of fields, one in another, and a number on the other axis."""

    @property
    def rows(self) -> int:
        return self.variable.shape[self.axis]

    @property
    def holds_dates(self) -> bool:
        dtype = self.variable.dtype
        for key in self.keys:
            dtype = dtype[key] if isinstance(key, str) else dtype.base
        return dtype.kind == "M"

    def of(self, piece: NDArray[Any]) -> NDArray[Any]:
        """Returns its numbers in a piece, (m,), where they stand: of any type."""
        for key in self.keys:
            along = isinstance(key, str) or self.axis == 1
            piece = piece[key] if along else piece[:, key]  # type: ignore[index]
        return _nanoseconds(piece) if piece.dtype.kind == "M" else piece


def _nanoseconds(dates: NDArray[Any]) -> FloatArray:
    counted = dates.astype("datetime64[ns]")
    return np.where(np.isnat(counted), np.nan, counted.astype(np.int64).astype(np.float64))


def is_numeric(dtype: np.dtype[Any]) -> bool:
    """Returns whether values of this type can be readings, or times."""
    return dtype.kind in "biufM"


def list_variable_imus(file: VariablesFile, options: ReadOptions) -> tuple[str, ...]:
    """Returns the names of the IMUs in a file of variables."""
    places = _places(file)
    return tuple(_named(file, places, find_imus(list(places), file.path, options), options))


def _named(
    file: VariablesFile, places: Mapping[str, _Place], imus: Mapping[str, ImuColumns], options: ReadOptions
) -> dict[str, NamedImu]:
    """Returns the IMUs of a file; those that share variables have a label in each row."""

    def gather(columns: ImuColumns, name: str) -> LabelColumn | None:
        axes = columns.accelerometer or columns.gyroscope or columns.magnetic_names
        place = places[name]
        if place.rows != places[axes[0]].rows or place.holds_dates:
            return None
        column = LabelColumn(name)
        for pieces in _side_by_side(file, {name: place}):
            column.add_numbers(pieces.column(place))
        return column

    return named_imus(imus, places, options, gather)


def open_variables(file: VariablesFile, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds the variables of one IMU.

    Raises `LogError` where there is no such IMU, or its variables differ in their number of samples.
    """
    path = file.path
    places = _places(file)
    imus = find_imus(list(places), path, options)
    named = _named(file, places, imus, options)
    name = choose_named(path, named, imu, "variable prefix")

    def opened(columns: ImuColumns) -> LoggedImu:
        columns = _with_stated_units(columns, places)
        wanted = {
            each: places[each] for each in (columns.names if columns.triads else columns.magnetic_names)
        }
        rows = _equal_rows(path, wanted)
        group = next(iter(wanted.values())).variable.name.split(_SEPARATOR)[:-1]
        rate, notices = _stated_rate(file, columns, options, group)
        found = LoggedImu(
            path=path,
            imu=name,
            format=file.format,
            read=lambda transform: _ahead(rows, _read(file, columns, wanted, transform)),
            head=lambda: next(_read(file, columns, wanted, lambda samples: samples)),
            locate=lambda sample: f"sample {sample + 1}",
            accelerometer_unit=columns.accelerometer_unit,
            gyroscope_unit=columns.gyroscope_unit,
            time_unit=columns.time_unit,
            temperature_unit=columns.temperature_unit,
            clock=f"{path.resolve()}#{columns.time or 'row'}",
            rate=rate,
            serial=file.serial,
            triads=columns.triads,
            magnetometer=_magnetometer(file, columns, places),
            columns=tuple(places),
            alone=len(imus) == 1,
            expected=rows,
            notices=notices,
        )
        return of_label(found, named[name], name)

    return with_own_stamps(opened, imus[named[name].prefix], options)


def _magnetometer(
    file: VariablesFile, columns: ImuColumns, places: Mapping[str, _Place]
) -> LoggedMagnetometer | None:
    """Finds the magnetometer; one with a number of readings of its own needs times of its own.

    Reading it raises `LogError` where it has none.
    """

    def whole(names: Sequence[str]) -> Mapping[str, FloatArray]:
        wanted = {each: places[each] for each in names}
        _equal_rows(file.path, wanted)
        pieces = list(_side_by_side(file, wanted))
        return {
            name: np.concatenate([np.empty(0), *(piece.column(place) for piece in pieces)], dtype=np.float64)
            for name, place in wanted.items()
        }

    return magnetometer_in(columns, whole)


def _places(file: VariablesFile) -> dict[str, _Place]:
    """Returns all columns; arrays of six or seven are those of an IMU where no name identifies them."""
    if len(file.variables) > MOST_VARIABLES:
        raise LogError(f"{file.path}: holds {len(file.variables)} variables, which is no log; check the file")
    arrays = [each for each in file.variables if 1 <= len(each.shape) <= 2 and 0 not in each.shape]
    # A single number beside arrays is a rate or a version, no sample.
    usable = [each for each in arrays if max(each.shape) > 1] or arrays
    if not usable:
        raise LogError(f"{file.path}: not a log: holds no array of numbers with one or two axes")
    common = _common_group([each.name for each in usable])
    named: dict[str, _Place] = {}
    for each in usable:
        for label, place in _columns_of(each, each.name[len(common) :]):
            if label in named:
                raise LogError(f"{file.path}: holds {quoted(label)} twice; keep one of them, or rename it")
            named[label] = place
    if any(_is_of_triad(label) for label in named):
        return named
    tables = [
        each
        for each in usable
        if len(each.shape) == 2 and min(each.shape) in PLAIN_NAMES and not (each.dtype.names or each.columns)
    ]
    return named | {
        label: place
        for each in tables
        for label, place in _plain_columns(each, f"{each.name[len(common) :]}." if len(tables) > 1 else "")
    }


def _common_group(names: Sequence[str]) -> str:
    """Returns the group that all are in, with the separator behind it; empty where there is none."""
    groups = [name.split(_SEPARATOR)[:-1] for name in names]
    shared = 0
    while all(len(group) > shared and group[shared] == groups[0][shared] for group in groups):
        shared += 1
    # The group of one IMU is kept even where there is only one, as in a file without other groups.
    return "".join(f"{group}{_SEPARATOR}" for group in groups[0][:shared])


def _is_of_triad(label: str) -> bool:
    column = recognise(label)
    return column is not None and column.quantity in ("accelerometer", "gyroscope", "magnetometer")


def _columns_of(variable: Variable, name: str) -> Iterator[tuple[str, _Place]]:
    if variable.dtype.names is not None:
        prefix = f"{name}{_SEPARATOR}" if name else ""
        for label, keys in _fields_of(variable.dtype, prefix):
            yield label, _Place(variable, 0, keys)
        return
    if len(variable.shape) == 1:
        yield name, _Place(variable, 0)
        return
    if variable.columns:
        axis = int(variable.shape[0] == len(variable.columns) != variable.shape[1])
        group = "".join(name.rpartition(_SEPARATOR)[:2])
        for number, label in enumerate(variable.columns):
            yield f"{group}{label}", _Place(variable, axis, (number,))
        return
    is_triad = _is_of_triad(f"{name}.x") and _AXES in variable.shape
    axis = int(variable.shape[1] != _AXES) if is_triad else int(variable.shape[1] > variable.shape[0])
    others = variable.shape[1 - axis]
    if others > _MOST_COLUMNS:
        return
    if others == 1:
        yield name, _Place(variable, axis, (0,))
        return
    for number in range(others):
        yield _label(name, number, others), _Place(variable, axis, (number,))


def _fields_of(dtype: np.dtype[Any], prefix: str) -> Iterator[tuple[str, tuple[int | str, ...]]]:
    """Returns the numbers in a structured type: fields, fields of fields, and what stands in short rows."""
    for name in dtype.names or ():
        field = dtype[name]
        if field.names is not None and field.shape == ():
            for label, keys in _fields_of(field, f"{prefix}{name}{_SEPARATOR}"):
                yield label, (name, *keys)
        elif is_numeric(field) and field.shape == ():
            yield f"{prefix}{name}", (name,)
        elif is_numeric(field.base) and len(field.shape) == 1 and field.shape[0] <= _MOST_COLUMNS:
            for number in range(field.shape[0]):
                yield _label(f"{prefix}{name}", number, field.shape[0]), (name, number)


def _label(name: str, number: int, of: int) -> str:
    """Names one of several columns that a variable has."""
    is_triad = of == _AXES and _is_of_triad(f"{name}.x")
    return f"{name}.{'xyz'[number]}" if is_triad else f"{name}#{number + 1}"


def _plain_columns(variable: Variable, prefix: str) -> Iterator[tuple[str, _Place]]:
    """Names the columns of a table without names, as those of a text table."""
    axis = int(variable.shape[1] > variable.shape[0])
    for number, label in enumerate(PLAIN_NAMES[variable.shape[1 - axis]]):
        yield f"{prefix}{label}", _Place(variable, axis, (number,))


def _with_stated_units(columns: ImuColumns, places: Mapping[str, _Place]) -> ImuColumns:
    """Returns the variables with the units that the file states beside their names."""
    return with_units_beside(
        columns, lambda name: places[name].variable.unit, lambda name: places[name].holds_dates
    )


def _equal_rows(path: Path, wanted: Mapping[str, _Place]) -> int:
    (first, rows), *others = [(name, place.rows) for name, place in wanted.items()]
    for name, length in others:
        if length != rows:
            raise LogError(
                f"{path}: {first} holds {rows} samples, {name} {length}; one IMU needs as many of each: "
                "resample one, or name others with --columns"
            )
    return rows


def _stated_rate(
    file: VariablesFile, columns: ImuColumns, options: ReadOptions, above: list[str]
) -> tuple[float | None, tuple[str, ...]]:
    """Finds the rate in the group of the IMU, whose names are `above`, else in the nearest one around it.

    That of another sensor stands in a group of its own. Raises `LogError` where one group states several.
    """
    if columns.time is not None or options.rate is not None:
        return None, ()
    found: dict[int, dict[str, float]] = {}
    for name, number in file.numbers.items():
        *group, key = name.split(_SEPARATOR)
        if key.lower() in RATE_KEYS and 0.0 < number < np.inf and above[: len(group)] == group:
            found.setdefault(len(group), {})[name] = number
    if not found:
        return None, ()
    nearest = found[max(found)]
    if len(set(nearest.values())) > 1:
        stated = join([f"{number:g} Hz ({quoted(name)})" for name, number in nearest.items()])
        raise LogError(f"{file.path}: states several rates, {stated}; give that of the IMU with --rate")
    name, number = next(iter(nearest.items()))
    return number, (f"rate of {number:g} Hz from the variable {quoted(name)}",)


def _ahead(rows: int, chunks: Iterator[RawSamples]) -> Iterator[RawSamples]:
    """Reads the next chunk while one is used, where there is a next one."""
    return ahead(chunks) if rows > CHUNK_SAMPLES else chunks


def _read(
    file: VariablesFile, columns: ImuColumns, wanted: Mapping[str, _Place], transform: Transform
) -> Iterator[RawSamples]:
    filled, left = None, next(iter(wanted.values())).rows
    for pieces in _side_by_side(file, wanted):
        filled = filled or _Filled(columns, min(CHUNK_SAMPLES, left))
        filled.add(pieces, wanted)
        if filled.is_full:
            left -= len(filled.samples)
            yield transform(filled.samples)
            filled = None


@dataclass(frozen=True, slots=True)
class _Pieces:
    """The same samples of several variables."""

    of_variable: Mapping[int, NDArray[Any]]
    """Pieces by the identity of the variable."""
    rows: int

    def column(self, place: _Place) -> NDArray[Any]:
        """Returns the numbers of one column, (m,), of any type."""
        return place.of(self.of_variable[id(place.variable)])

    def triad(self, places: Sequence[_Place]) -> NDArray[Any] | None:
        """Returns the rows of three columns that are all of an array, (m, 3); None for others."""
        first = places[0]
        piece = self.of_variable[id(first.variable)]
        keys = [place.keys for place in places if place.variable is first.variable]
        is_whole = piece.shape == (len(piece), _AXES) and piece.flags.c_contiguous
        return piece if is_whole and keys == [(0,), (1,), (2,)] else None


class _Filled:
    """Samples of a chunk, put in place block by block, while each is in the cache of the processor."""

    def __init__(self, columns: ImuColumns, length: int) -> None:
        self._columns = columns
        self._rows = 0
        self.samples = RawSamples(
            None if columns.time is None else np.empty(length),
            _empty_triad(columns.accelerometer, length),
            _empty_triad(columns.gyroscope, length),
            None if columns.temperature is None else np.empty(length),
        )

    @property
    def is_full(self) -> bool:
        return self._rows == len(self.samples)

    def add(self, pieces: _Pieces, places: Mapping[str, _Place]) -> None:
        """Puts the next rows in place, as numbers of double precision."""
        columns, samples = self._columns, self.samples
        rows = slice(self._rows, self._rows + pieces.rows)
        for name, target in ((columns.time, samples.time), (columns.temperature, samples.temperature)):
            if name is not None and target is not None:
                target[rows] = pieces.column(places[name])
        for names, triad in (
            (columns.accelerometer, samples.accelerometer),
            (columns.gyroscope, samples.gyroscope),
        ):
            if names is None:
                continue
            together = [places[name] for name in names]
            if (piece := pieces.triad(together)) is not None:
                triad[rows] = piece
                continue
            gather(triad, rows.start, [pieces.column(place) for place in together])
        self._rows = rows.stop


def _empty_triad(names: Sequence[str] | None, length: int) -> FloatArray:
    return np.full((length, _AXES), np.nan) if names is None else np.empty((length, _AXES))


def _side_by_side(file: VariablesFile, wanted: Mapping[str, _Place]) -> Iterator[_Pieces]:
    """Passes over the variables, each of which is read once, in pieces as long as it likes."""
    sources = list({id(place.variable): place for place in wanted.values()}.values())
    with damage_said(file.path, file.remedy):
        for pieces in zip(*(_even(file, place) for place in sources), strict=True):
            yield _Pieces(
                {id(place.variable): piece for place, piece in zip(sources, pieces, strict=True)},
                pieces[0].shape[sources[0].axis],
            )


def _even(file: VariablesFile, place: _Place) -> Iterator[NDArray[Any]]:
    """Cuts the pieces of a variable to blocks, the last of which may be shorter.

    Raises `LogError` where it ends before the end of its shape.
    """
    axis, rows, block = place.axis, place.rows, file.block
    waiting: list[NDArray[Any]] = []
    have = given = 0
    for piece in chain(place.variable.pieces(axis), [None]):
        if piece is not None:
            waiting.append(piece)
            have += piece.shape[axis]
        elif have == 0:
            break
        if piece is not None and have < block:
            continue
        joined = waiting[0] if len(waiting) == 1 else np.concatenate(waiting, axis=axis)
        whole = have if piece is None else have - have % block
        for start in range(0, whole, block):
            stop = min(start + block, whole)
            yield joined[start:stop] if axis == 0 else joined[:, start:stop]
            given += stop - start
        rest = joined[whole:] if axis == 0 else joined[:, whole:]
        waiting, have = ([rest] if rest.shape[axis] else []), have - whole
    if given != rows:
        raise LogError(
            f"{file.path}: {place.variable.name or 'the array'} ends after {given} of {rows} samples; "
            f"{file.remedy}"
        )
