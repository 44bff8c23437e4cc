"""CSV and Parquet out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.csv  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]

from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.regular_files import open_regular
from tumble.foundation.units import Triad
from tumble.logs.track import CHUNK_SAMPLES

if TYPE_CHECKING:
    from tumble.logs.writer import Facts

_COLUMNS: Mapping[Triad, tuple[str, str, str]] = {
    "accelerometer": ("ax", "ay", "az"),
    "gyroscope": ("gx", "gy", "gz"),
}
PARQUET = {"compression": "zstd", "write_page_checksum": True}
"""Options with which Parquet is written."""


def _schema(chunk: Chunk, triads: Sequence[Triad], further: Sequence[str] = ()) -> pa.Schema:
    names = ["time", *(name for triad in triads for name in _COLUMNS[triad])]
    if chunk.temperature is not None:
        names.append("temperature")
    columns = [(name, pa.float64()) for name in names]
    return pa.schema([*columns, *((name, _further(chunk, name).type) for name in further)])


def _batch(
    chunk: Chunk, schema: pa.Schema, triads: Sequence[Triad], further: Sequence[str] = ()
) -> pa.RecordBatch:
    columns = [chunk.time, *(column for triad in triads for column in getattr(chunk, triad).T)]
    if "temperature" in schema.names:
        unknown = np.full(len(chunk), np.nan)
        columns.append(unknown if chunk.temperature is None else chunk.temperature)
    arrays = [*map(_arrow, columns), *(_further(chunk, name) for name in further)]
    return pa.record_batch(arrays, schema=schema)


def _further(chunk: Chunk, name: str) -> pa.Array:
    """Returns a column that only some logs have: numbers, whole ones, or one word for all samples."""
    values = getattr(chunk, name)
    if isinstance(values, str):
        return pa.array([values] * len(chunk), pa.string())
    if np.issubdtype(values.dtype, np.integer):
        numbers = np.ascontiguousarray(values, dtype=np.int64)
        return pa.Array.from_buffers(pa.int64(), len(numbers), [None, pa.py_buffer(numbers)])
    return _arrow(values)


def _arrow(column: FloatArray) -> pa.Array:
    """Wraps numbers as they lie in memory; `pa.array` would import pandas first, which takes a second."""
    numbers = np.ascontiguousarray(column, dtype=np.float64)
    return pa.Array.from_buffers(pa.float64(), len(numbers), [None, pa.py_buffer(numbers)])


class CsvWriter:
    """Text with a row of names; every float in as many digits as it takes to read it back exactly."""

    def __init__(self, file: BinaryIO, facts: Facts) -> None:
        self._file = file
        self._facts = facts
        self._writer: pa.csv.CSVWriter | None = None
        self._schema: pa.Schema | None = None

    def write(self, chunk: Chunk) -> None:
        """Appends rows; the first chunk decides whether there is a temperature column."""
        if self._writer is None:
            self._schema = _schema(chunk, self._facts.triads, self._facts.further)
            self._file.write(self._head(self._schema).encode())
            options = pa.csv.WriteOptions(include_header=False, quoting_style="none")
            self._writer = pa.csv.CSVWriter(self._file, self._schema, write_options=options)
        self._writer.write_batch(_batch(chunk, self._schema, self._facts.triads, self._facts.further))

    def close(self) -> None:
        """Finishes the file."""
        if self._writer is not None:
            self._writer.close()

    def _head(self, schema: pa.Schema) -> str:
        comments = "".join(f"# {key}: {value}\n" for key, value in self._facts.of_the_samples().items())
        return comments + ",".join(schema.names) + "\n"


class ParquetWriter:
    """Parquet, one row group a chunk."""

    def __init__(self, file: BinaryIO, facts: Facts) -> None:
        self._file = file
        self._facts = facts
        self._writer: pq.ParquetWriter | None = None
        self._schema: pa.Schema | None = None

    def write(self, chunk: Chunk) -> None:
        """Appends rows; the first chunk decides whether there is a temperature column."""
        if self._writer is None:
            facts = {**self._facts.of_the_samples(), **self._facts.notes}
            kept = {f"tumble.{key}": value for key, value in facts.items() if value}
            self._schema = _schema(chunk, self._facts.triads, self._facts.further).with_metadata(kept)
            self._writer = pq.ParquetWriter(self._file, self._schema, **PARQUET)
        self._writer.write_batch(_batch(chunk, self._schema, self._facts.triads, self._facts.further))

    def close(self) -> None:
        """Finishes the file."""
        if self._writer is not None:
            self._writer.close()


def join_parquet(files: Sequence[Path], joined: BinaryIO, notes: Mapping[str, str]) -> None:
    """Writes the rows of Parquet files of the same columns in sequence, bit by bit, in large row groups.

    The metadata is that of the first, and `notes`.
    """
    with open_regular(files[0]) as stream:
        schema = pq.read_schema(stream)
    kept = {f"tumble.{key}".encode(): value.encode() for key, value in notes.items()}
    noted = schema.with_metadata((schema.metadata or {}) | kept)
    with pq.ParquetWriter(joined, noted, **PARQUET) as writer:
        waiting: list[pa.RecordBatch] = []
        for path in files:
            with (
                open_regular(path) as stream,
                pq.ParquetFile(stream, page_checksum_verification=True) as file,
            ):
                for batch in file.iter_batches(CHUNK_SAMPLES, use_threads=False):
                    waiting.append(batch)
                    if sum(map(len, waiting)) >= CHUNK_SAMPLES:
                        writer.write_table(pa.Table.from_batches(waiting).select(schema.names))
                        waiting = []
        if waiting:
            writer.write_table(pa.Table.from_batches(waiting).select(schema.names))
