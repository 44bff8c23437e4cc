"""Columns of Arrow tables by the names of their leaves: what Parquet and Feather files have in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pyarrow as pa  # type: ignore[import-untyped]

from tumble.errors import LogError
from tumble.logs.columns import ImuColumns
from tumble.logs.csv import as_floats
from tumble.logs.track import StatedUnit
from tumble.recording import FloatArray


def leaf_names(schema: pa.Schema) -> list[str]:
    """Names of all columns; fields of a structure as `linear_acceleration.x`."""
    table = schema.empty_table()
    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    names: list[str] = table.column_names
    return names


def leaves(path: Path, batch: pa.RecordBatch, names: Sequence[str]) -> Mapping[str, FloatArray]:
    """Give the numbers in these columns; raises `LogError` where one holds something else."""
    table = pa.Table.from_batches([batch])
    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    return {name: _numbers(path, name, table.column(name)) for name in names}


def _numbers(path: Path, name: str, column: pa.ChunkedArray) -> FloatArray:
    try:
        return as_floats(column)
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
        raise LogError(f"{path}: column {name} holds {column.type}, not numbers") from error


def arrow_time_unit(schema: pa.Schema, columns: ImuColumns) -> StatedUnit | None:
    """Give the unit of time: that of dates, which are read as ns, else what the column's name says."""
    if columns.time in schema.names and pa.types.is_timestamp(schema.field(columns.time).type):
        return StatedUnit("ns", "column type")
    return columns.time_unit
