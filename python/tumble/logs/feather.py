"""Feather files, which are files of Arrow, batch after batch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.ipc  # type: ignore[import-untyped]

from tumble.foundation.errors import LogError
from tumble.foundation.regular_files import open_regular
from tumble.logs.ahead import ahead
from tumble.logs.arrow import imu_in, imus_in
from tumble.logs.budget import memory_budget
from tumble.logs.damage import damage_said
from tumble.logs.feather_sizes import largest_unpacked
from tumble.logs.options import ReadOptions
from tumble.logs.track import CHUNK_SAMPLES, LoggedImu

_FIRST_VERSION = b"FEA1"
_REMEDY = "copy it again, or write it again"


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the column prefixes of a Feather table, and the labels of rows."""
    with _opened(path) as file:
        schema = file.schema
    return tuple(imus_in(path, schema, options, partial(_batches, path)))


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds the columns of one IMU in a Feather table.

    Raises `LogError` where the table has no such IMU, or a column of it holds no numbers.
    """
    with _opened(path) as file:
        schema = file.schema
    return imu_in(path, schema, imu, options, "feather", partial(_batches, path))


@contextmanager
def _opened(path: Path, names: list[str] | None = None) -> Iterator[pa.ipc.RecordBatchFileReader]:
    """Opens for reading batch by batch, of all columns or of these."""
    with open_regular(path) as file:
        if file.read(len(_FIRST_VERSION)) == _FIRST_VERSION:
            raise LogError(
                f"{path}: is Feather of version 1; write it again with pandas.DataFrame.to_feather"
            )
    with damage_said(path, _REMEDY):
        _refuse_large(path)
    with damage_said(path, _REMEDY), open_regular(path) as stream, pa.PythonFile(stream, "r") as file:
        # In the thread that asks: threads of Arrow go on with a damaged batch after it was refused.
        options = pa.ipc.IpcReadOptions(use_threads=False)
        reader = pa.ipc.open_file(file, options=options)
        if names is not None:
            options.included_fields = [
                number for number, name in enumerate(reader.schema.names) if name in names
            ]
            reader = pa.ipc.open_file(file, options=options)
        yield reader


def _refuse_large(path: Path) -> None:
    """Raises `LogError` where a batch unpacks to more than the file may take: each is held whole."""
    with open_regular(path) as file:
        size = file.seek(0, 2)
        most, found = max(size, memory_budget(size)), largest_unpacked(file)
    if found > most:
        raise LogError(
            f"{path}: a batch unpacks to {found >> 20} MiB, and {most >> 20} are allowed; write it again in "
            "batches of fewer rows"
        )


def _batches(path: Path, names: Sequence[str]) -> Iterator[pa.RecordBatch]:
    """Returns the rows of all batches, in pieces of a chunk; reads a batch while one is used."""
    return ahead(_rows(path, names))


def _rows(path: Path, names: Sequence[str]) -> Iterator[pa.RecordBatch]:
    roots = [name.split(".", 1)[0] for name in names]
    with _opened(path, [*roots, *names]) as file:
        for number in range(file.num_record_batches):
            batch = file.get_batch(number)
            batch.validate(full=True)
            for start in range(0, batch.num_rows, CHUNK_SAMPLES):
                yield batch.slice(start, CHUNK_SAMPLES)
