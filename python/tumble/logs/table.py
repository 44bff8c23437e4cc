"""Tables in memory: data frames of pandas and polars, data sets of xarray, tables of pyarrow, mappings.

They are known by what they can do, give names of columns and a column by its name; no library is imported.
Units stand in the names of columns, or in the attributes `units` of a data frame or of a variable of xarray.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tumble.foundation import arrays
from tumble.foundation.errors import ArrayError, LogError
from tumble.foundation.recording import FloatArray, Table, named_columns
from tumble.logs.columns import ImuColumns, find_imus
from tumble.logs.csv import samples_of
from tumble.logs.magnetometer import magnetometer_in
from tumble.logs.options import ReadOptions
from tumble.logs.own_stamps import with_own_stamps
from tumble.logs.row_labels import LabelColumn, NamedImu, choose_named, named_imus, of_label
from tumble.logs.track import CHUNK_SAMPLES, COLUMN_TYPE, LoggedImu, RawSamples, StatedUnit, Transform

NAME = "table"
"""Default name of a table."""


def open_logged_imu(table: Table, name: str, options: ReadOptions) -> LoggedImu:
    """Finds the columns of one IMU, by the names that columns of files have.

    Raises `LogError` where there is no such IMU, `ArrayError` where a column of it holds no numbers.
    """
    columns = _columns(table, name)
    place = Path(name)
    imus = find_imus(list(columns), place, options)
    named = _named(columns, imus, options)
    labelled = any(each.labels for each in named.values())
    typed = "ReadOptions(topic={!r})"
    imu = (
        choose_named(place, named, options.topic, "IMU", typed)
        if labelled
        else _wanted(name, imus, options.topic)
    )

    def opened(chosen: ImuColumns) -> LoggedImu:
        dated = chosen.time is not None and arrays.are_dates(columns[chosen.time])
        names = chosen.names if chosen.triads else chosen.magnetic_names
        numbers = {each: _numbers(name, each, columns[each], each == chosen.time) for each in names}
        _refuse_uneven(name, numbers)
        rows = len(next(iter(numbers.values())))
        if rows == 0:
            raise LogError(f"{name}: names columns, but holds no samples")
        found = LoggedImu(
            path=place,
            imu=imu,
            format="table",
            read=lambda transform: _read(numbers, chosen, rows, transform),
            head=lambda: next(_read(numbers, chosen, rows, lambda samples: samples)),
            locate=lambda sample: f"row {sample + 1}",
            accelerometer_unit=chosen.accelerometer_unit,
            gyroscope_unit=chosen.gyroscope_unit,
            time_unit=StatedUnit("s", COLUMN_TYPE) if dated else chosen.time_unit,
            temperature_unit=chosen.temperature_unit,
            clock=f"table {id(table)}#{chosen.time or 'row'}",
            triads=chosen.triads,
            magnetometer=magnetometer_in(chosen, lambda names: _whole(name, columns, chosen, names)),
            columns=tuple(columns),
            alone=len(imus) == 1,
            expected=rows,
        )
        return of_label(found, named[imu], imu)

    return with_own_stamps(opened, imus[named[imu].prefix], options)


def _named(
    columns: Mapping[str, Any], imus: Mapping[str, ImuColumns], options: ReadOptions
) -> dict[str, NamedImu]:
    """Returns the IMUs of a table, by the prefix of columns and the label of rows."""

    def gather(_imu: ImuColumns, name: str) -> LabelColumn:
        column, values = LabelColumn(name), np.asarray(columns[name])
        if values.ndim == 1 and values.dtype.kind in "biuf":
            column.add_numbers(values)
        elif values.ndim == 1:
            column.add_words(list(map(str, values.tolist())))
        return column

    return named_imus(imus, columns, options, gather)


def _columns(table: Table, name: str) -> dict[str, Any]:
    """Returns the columns by name, and the index of a data frame where it may hold the time."""
    if hasattr(table, "data_vars"):
        return _variables(table)
    named = named_columns(table)
    if named is None:
        raise ArrayError(
            f"{name}: {type(table).__name__} is neither a path nor a table with named columns; wrap arrays "
            "with Recording.from_arrays"
        )
    units = getattr(table, "attrs", {}).get("units", {})
    columns = {_with_unit(text, units.get(text)): table[key] for key, text in named.items()}
    index = getattr(table, "index", None)
    if not (hasattr(index, "name") and hasattr(index, "dtype")):
        return columns
    assert index is not None
    # That of a frame that nobody gave one counts rows.
    counts_rows = index.name is None and getattr(index.dtype, "kind", "") not in "fmM"
    time = str(index.name or "time")
    return columns if counts_rows else {_with_unit(time, units.get(time)): index} | columns


def _variables(dataset: Any) -> dict[str, Any]:  # noqa: ANN401 - xarray is not imported
    """Returns the columns of a data set: a variable over time each, or one for each axis of a triad."""
    columns = {}
    for name in (*dataset.coords, *dataset.data_vars):
        variable = dataset[name]
        unit = variable.attrs.get("units")
        others = [dimension for dimension in variable.dims if dimension != variable.dims[0]]
        if len(others) == 1 and variable.shape[1] == arrays.AXES:
            for axis, letter in enumerate("xyz"):
                columns[_with_unit(f"{name}_{letter}", unit)] = variable.values[:, axis]
        elif not others and variable.dims and len(variable) and not _is_text(variable):
            columns[_with_unit(str(name), unit)] = variable.values
    return columns


def _is_text(variable: Any) -> bool:  # noqa: ANN401 - xarray is not imported
    return variable.dtype.kind in "US" or any(isinstance(value, str) for value in variable.values[:1])


def _with_unit(name: str, unit: object) -> str:
    """Returns the name of a column with the unit that stands beside it."""
    return f"{name} [{unit}]" if isinstance(unit, str) and unit else name


def _wanted(name: str, imus: Mapping[str, ImuColumns], wanted: str | None) -> str:
    if wanted is None and (len(imus) == 1 or "" in imus):
        return next(iter(imus)) if len(imus) == 1 else ""
    if wanted is not None and wanted in imus:
        return wanted
    found = ", ".join(map(repr, filter(None, imus))) or "only one IMU, without a name"
    said = f"holds {len(imus)} IMUs" if wanted is None else f"holds no IMU {wanted!r}"
    raise LogError(f"{name}: {said}; name one with ReadOptions(topic=...) (found: {found})")


def _numbers(name: str, column: str, values: Any, is_time: bool) -> FloatArray:  # noqa: ANN401 - any column
    try:
        return arrays.times(values, column) if is_time else arrays.column(values, column)
    except ArrayError as error:
        raise ArrayError(error.why, about=name) from None


def _whole(
    name: str, columns: Mapping[str, Any], chosen: ImuColumns, names: Sequence[str]
) -> Mapping[str, FloatArray]:
    """Returns some columns, a row of each for every reading."""
    own = chosen.magnetometer.time if chosen.magnetometer else None
    numbers = {each: _numbers(name, each, columns[each], each in (chosen.time, own)) for each in names}
    _refuse_uneven(name, numbers)
    return numbers


def _refuse_uneven(name: str, numbers: Mapping[str, FloatArray]) -> None:
    try:
        arrays.refuse_other_lengths(list(numbers.items()))
    except ArrayError as error:
        raise ArrayError(error.why, about=name) from None


def _read(
    numbers: Mapping[str, FloatArray], columns: ImuColumns, rows: int, transform: Transform
) -> Iterator[RawSamples]:
    for start in range(0, rows, CHUNK_SAMPLES):
        # Copies, since a transform may change what it is given, and the caller's columns are no one else's.
        piece = {each: np.array(values[start : start + CHUNK_SAMPLES]) for each, values in numbers.items()}
        yield transform(samples_of(piece, columns))
