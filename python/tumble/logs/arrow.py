"""Columns of Arrow tables by the names of their leaves: what Parquet and Feather files have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]

from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.logs.arrow_floats import as_floats
from tumble.logs.columns import ImuColumns, find_imus
from tumble.logs.csv import samples_of
from tumble.logs.magnetometer import magnetometer_in
from tumble.logs.options import ReadOptions
from tumble.logs.own_stamps import with_own_stamps
from tumble.logs.row_labels import LabelColumn, NamedImu, choose_named, named_imus, of_label
from tumble.logs.track import LoggedImu, RawSamples, Transform
from tumble.logs.units_beside import KEYS, with_units_beside

Batches: TypeAlias = Callable[[Sequence[str]], Iterator[pa.RecordBatch]]


def imus_in(path: Path, schema: pa.Schema, options: ReadOptions, batches: Batches) -> dict[str, NamedImu]:
    """Finds the IMUs, by the prefix of columns and the label of rows; raises `LogError` without any."""
    return _named(schema, _by_prefix(path, schema, options), options, batches)


def _by_prefix(path: Path, schema: pa.Schema, options: ReadOptions) -> dict[str, ImuColumns]:
    fields = _leaf_fields(schema)

    def text(name: str) -> str:
        stated = fields[name].metadata or {}
        found = next((stated[key.encode()] for key in KEYS if key.encode() in stated), b"")
        return found.decode("utf-8", "replace")

    def holds_dates(name: str) -> bool:
        return bool(pa.types.is_timestamp(fields[name].type))

    imus = find_imus(list(fields), path, options)
    return {name: with_units_beside(columns, text, holds_dates) for name, columns in imus.items()}


def _named(
    schema: pa.Schema, imus: Mapping[str, ImuColumns], options: ReadOptions, batches: Batches
) -> dict[str, NamedImu]:
    def gather(_columns: ImuColumns, name: str) -> LabelColumn:
        column = LabelColumn(name)
        for batch in batches([name]):
            _add_labels(column, _flat(pa.Table.from_batches([batch])).column(name))
            if not column.is_open:
                break
        return column

    return named_imus(imus, _leaf_fields(schema), options, gather)


def _add_labels(column: LabelColumn, values: pa.ChunkedArray) -> None:
    for chunk in values.chunks:
        coded = chunk if pa.types.is_dictionary(chunk.type) else chunk.dictionary_encode()
        places = np.nan_to_num(as_floats(coded.indices), nan=-1.0).astype(np.intp)
        column.add(coded.dictionary.to_pylist(), places)


def imu_in(
    path: Path,
    schema: pa.Schema,
    imu: str | None,
    options: ReadOptions,
    format_: str,
    batches: Batches,
) -> LoggedImu:
    """Finds one IMU of a table, which `batches` starts a fresh pass over, with those columns at least.

    Raises `LogError` where the table has no such IMU, or a column of it holds no numbers.
    """
    imus = _by_prefix(path, schema, options)
    named = _named(schema, imus, options, batches)
    name = choose_named(path, named, imu, "column prefix")
    columns = imus[named[name].prefix]

    def opened(columns: ImuColumns) -> LoggedImu:
        def read(transform: Transform) -> Iterator[RawSamples]:
            for batch in batches(columns.names):
                yield transform(samples_of(_leaves(path, batch, columns.names), columns))

        def head() -> RawSamples:
            found = next(read(lambda samples: samples), None)
            if found is None:
                raise LogError(f"{path}: names columns, but holds no samples")
            return found

        def whole(names: Sequence[str]) -> Mapping[str, FloatArray]:
            leaves = [_leaves(path, batch, names) for batch in batches(names)]
            return {name: np.concatenate([np.empty(0), *(each[name] for each in leaves)]) for name in names}

        found_imu = LoggedImu(
            path=path,
            imu=name,
            format=format_,
            read=read,
            head=head,
            locate=lambda sample: f"row {sample + 1}",
            accelerometer_unit=columns.accelerometer_unit,
            gyroscope_unit=columns.gyroscope_unit,
            time_unit=columns.time_unit,
            temperature_unit=columns.temperature_unit,
            clock=f"{path.resolve()}#{columns.time or 'row'}",
            triads=columns.triads,
            magnetometer=magnetometer_in(columns, whole),
            columns=tuple(_leaf_fields(schema)),
            alone=len(imus) == 1,
        )
        return of_label(found_imu, named[name], name)

    return with_own_stamps(opened, columns, options)


def _leaf_fields(schema: pa.Schema) -> dict[str, pa.Field]:
    """All columns by name; fields of a structure as `linear_acceleration.x`."""
    return {field.name: field for field in _flat(schema.empty_table()).schema}


def _leaves(path: Path, batch: pa.RecordBatch, names: Sequence[str]) -> Mapping[str, FloatArray]:
    """Returns the numbers in these columns; raises `LogError` where one holds something else."""
    table = _flat(pa.Table.from_batches([batch]))
    return {name: _numbers(path, name, table.column(name)) for name in names}


def _flat(table: pa.Table) -> pa.Table:
    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    return table


def _numbers(path: Path, name: str, column: pa.ChunkedArray) -> FloatArray:
    try:
        return as_floats(column)
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
        raise LogError(f"{path}: column {name} holds {column.type}, not numbers") from error
