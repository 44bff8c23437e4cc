"""Parquet tables, batch after batch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow as pa  # type: ignore[import-untyped]

from tumble.foundation.errors import LogError
from tumble.foundation.parquet_pages import PageError, pages_of
from tumble.foundation.regular_files import open_regular
from tumble.logs.ahead import ahead
from tumble.logs.arrow import imu_in, imus_in
from tumble.logs.budget import memory_budget, unpacked_budget
from tumble.logs.options import ReadOptions
from tumble.logs.track import CHUNK_SAMPLES, LoggedImu, with_written_units

if TYPE_CHECKING:
    import pyarrow.parquet as pq  # type: ignore[import-untyped]

_TEXT = "BYTE_ARRAY"
"""Type of columns of text, as Parquet names it."""
FACTS = (b"tumble.serial", b"tumble.corrected", b"tumble.units")
"""Keys of the file's metadata under which Tumble keeps what it knows of a recording."""


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the column prefixes of a Parquet table, and the labels of rows."""
    with opened(path) as file:
        schema = file.schema_arrow
    return tuple(imus_in(path, schema, options, partial(_batches, path)))


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds the columns of one IMU in a Parquet table.

    Raises `LogError` where the table has no such IMU, or a column of it holds no numbers.
    """
    with opened(path) as file:
        schema, rows = file.schema_arrow, file.metadata.num_rows
    found = imu_in(path, schema, imu, options, "parquet", partial(_batches, path))
    stated = schema.metadata or {}
    facts = {key.decode(): stated[key].decode("utf-8", "backslashreplace") for key in FACTS if key in stated}
    return replace(
        with_written_units(found, facts.get("tumble.units")),
        serial=facts.get("tumble.serial", ""),
        expected=rows if found.expected is None else found.expected,
        already_corrected=True if "tumble.corrected" in facts else None,
        correction=facts.get("tumble.corrected", ""),
    )


@contextmanager
def opened(path: Path, texts: Sequence[str] = ()) -> Iterator[pq.ParquetFile]:
    """Opens for reading page by page; otherwise the compressed bytes of the whole file end up in memory.

    A text in the columns `texts` that stands for many is kept once.
    """
    import pyarrow.parquet as pq  # brings libraries of network file systems, for which sessions would wait

    in_pages = {"buffer_size": 1 << 20, "pre_buffer": False, "read_dictionary": list(texts)}
    try:
        with (
            open_regular(path) as stream,
            pq.ParquetFile(stream, page_checksum_verification=True, **in_pages) as file,
        ):
            yield file
    except (pa.ArrowInvalid, pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise LogError(f"{path}: {_problem(path)} ({str(error).splitlines()[0]})") from error


def _problem(path: Path) -> str:
    with open_regular(path) as file:
        file.seek(-4, 2)
        complete = file.read() == b"PAR1"
    if complete:
        return "damaged Parquet file; copy or write it again"
    return "Parquet file is cut short, its index at the end is missing; copy or write it again"


def _batches(path: Path, names: Sequence[str]) -> Iterator[pa.RecordBatch]:
    with opened(path) as file:
        texts = _texts(path, file.metadata, names)
    with opened(path, texts) as file:
        yield from ahead(file.iter_batches(CHUNK_SAMPLES, columns=list(names)))


def _texts(path: Path, stated: pq.FileMetaData, names: Sequence[str]) -> list[str]:
    """Returns which columns hold text.

    Raises `LogError` where the texts, or the pages that are held at a time, are packed beyond the budget.
    """
    texts: set[str] = set()
    most, most_paged = memory_budget(path.stat().st_size), unpacked_budget(path.stat().st_size)
    with open_regular(path) as file:
        for group in range(stated.num_row_groups):
            of_texts = at_a_time = 0
            for chunk in map(stated.row_group(group).column, range(stated.num_columns)):
                if chunk.path_in_schema not in names:
                    continue
                try:
                    sizes = [page.size for page in pages_of(file, chunk, stated.created_by or "")]
                except PageError as error:
                    raise LogError(f"{path}: column {chunk.path_in_schema} {error}") from error
                at_a_time += max(sizes, default=0)
                if chunk.physical_type == _TEXT:
                    texts.add(chunk.path_in_schema)
                    of_texts += sum(sizes)
            if of_texts > most:
                raise LogError(f"{path}: columns of text unpack to more than {most >> 20} MiB; write numbers")
            if at_a_time > most_paged:
                raise LogError(
                    f"{path}: pages unpack to more than {most_paged >> 20} MiB; write smaller ones"
                )
    return sorted(texts)
