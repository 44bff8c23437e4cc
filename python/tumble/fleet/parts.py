"""Results of a fleet as Parquet parts: a row an input, each part written whole, named by its content."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.compute as pc  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]

from tumble.fleet.places import FileStore
from tumble.foundation.errors import shown
from tumble.foundation.file_names import file_stem
from tumble.foundation.files import FileKind
from tumble.foundation.parquet_pages import PageError, pages_of
from tumble.foundation.stores import StoreError, store_error
from tumble.foundation.words import in_utf8

FOLDER = "parts"
ENDING = ".parquet"
_MARK = "tumble.fleet"
_KIND = FileKind("a part of results", re.compile(rb"\APAR1"), re.compile(rb"tumble\.fleet"))
LARGEST_PART = 1 << 30
"""Bytes of a file of Parquet once it is unpacked."""
_VALUE_BYTES = 100
"""Bytes of a number or text of a part while it is summed up."""
_STATED = {"name", "unit", "sha256", "text"}
"""Members of parameters and documents that each of them has."""
UNKNOWN_DAY = "unknown"
"""Day of recordings of which no date is stated."""

_PARAMETER = pa.struct(
    [
        ("name", pa.string()),
        ("unit", pa.string()),
        ("value", pa.float64()),
        ("u", pa.float64()),
        ("common", pa.float64()),
    ]
)
_DOCUMENT = pa.struct([("name", pa.string()), ("sha256", pa.string()), ("text", pa.string())])
SCHEMA = pa.schema(
    [
        pa.field("key", pa.binary(16), nullable=False),
        pa.field("place", pa.string(), nullable=False),
        *(pa.field(name, pa.string()) for name in ("unit", "serial", "model", "lot", "operator", "station")),
        pa.field("day", pa.string()),
        pa.field("exit_code", pa.int32(), nullable=False),
        pa.field("verdict", pa.string()),
        pa.field("failure", pa.string()),
        pa.field("transient", pa.bool_(), nullable=False),
        pa.field("messages", pa.string()),
        pa.field("summary", pa.string()),
        pa.field("parameters", pa.list_(_PARAMETER)),
        pa.field("documents", pa.list_(_DOCUMENT)),
    ]
)


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of one input, a row of a part."""

    key: bytes
    place: str
    unit: str = ""
    serial: str = ""
    model: str = ""
    lot: str = ""
    operator: str = ""
    station: str = ""
    day: str = UNKNOWN_DAY
    """Date of the recording, YYYY-MM-DD, as its input states it."""
    exit_code: int = 0
    """Exit code of the command: 0, 2 where nothing could be done, 3 where not all is well."""
    verdict: str = ""
    failure: str = ""
    """Reason why there is no result."""
    messages: str = ""
    """Lines of its standard error."""
    summary: str = ""
    """JSON that the command prints."""
    parameters: tuple[dict[str, object], ...] = ()
    """Name, unit, value and combined standard uncertainty `u` of each parameter."""
    documents: tuple[dict[str, str], ...] = ()
    """Name, sha256 and text of each file that it wrote."""
    transient: bool = False
    """Indicates whether the failure is that of a place or worker, so that another run may succeed."""


def write_parts(results: FileStore, outcomes: Sequence[Outcome]) -> list[str]:
    """Writes outcomes, a part for each day; returns the names of the parts.

    The same outcomes have the same names, so that what is done twice is there once.
    """
    days = sorted({each.day for each in outcomes})
    return [_write(results, day, [each for each in outcomes if each.day == day]) for day in days]


def _write(results: FileStore, day: str, outcomes: Sequence[Outcome]) -> str:
    some = sorted(outcomes, key=lambda each: each.key)
    digest = hashlib.sha256(b"".join(each.key for each in some)).hexdigest()[:32]
    name = f"{FOLDER}/day={file_stem(day)}/{digest}{ENDING}"
    content = io.BytesIO()
    table = pa.Table.from_pylist([_encodable(asdict(each)) for each in some], SCHEMA)
    table = table.replace_schema_metadata({_MARK: "1"})
    pq.write_table(table, content, compression="zstd")
    results.write(name, content.getvalue(), _KIND)
    return name


def _encodable(value: Any) -> Any:  # noqa: ANN401 - plain data
    """Returns plain data with each text as Parquet holds it: names of files may be no UTF-8."""
    if isinstance(value, dict):
        return {name: _encodable(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_encodable(each) for each in value]
    return in_utf8(value) if isinstance(value, str) else value


def exit_codes(results: FileStore) -> dict[bytes, int]:
    """Returns the exit code of each input by its key, without failures that another run may mend."""
    found: dict[bytes, int] = {}
    for table in part_tables(results, ["key", "exit_code", "transient"]):
        columns = (table.column(name).to_pylist() for name in ("key", "exit_code", "transient"))
        found.update((key, code) for key, code, transient in zip(*columns, strict=True) if not transient)
    return found


def tables(results: FileStore, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
    """Yields one part after another, each input once: its result, where a transient failure was mended.

    Raises `StoreError` where a part cannot be read.
    """
    settled = exit_codes(results)
    known: set[bytes] = set()
    wanted = None if columns is None else list(dict.fromkeys(["key", "transient", *columns]))
    for table in part_tables(results, wanted):
        keys = table.column("key").to_pylist()
        mended = (
            key in settled and old
            for key, old in zip(keys, table.column("transient").to_pylist(), strict=True)
        )
        fresh = [key not in known and not is_mended for key, is_mended in zip(keys, mended, strict=True)]
        known.update(key for key, is_fresh in zip(keys, fresh, strict=True) if is_fresh)
        yield table if all(fresh) else table.filter(pa.array(fresh, pa.bool_()))


def part_tables(results: FileStore, columns: Sequence[str] | None) -> Iterator[pa.Table]:
    """Yields each part as it was written: what was computed twice is in two of them.

    Raises `StoreError` where a part cannot be read.
    """
    for path in results.names(FOLDER, ENDING):
        try:
            with results.opened_within(path) as file:
                table = _whole_part(file, path, columns)
        except StoreError:
            raise
        except Exception as error:  # of the store's library, or of pyarrow in a file of others
            raise store_error(path, error) from error
        yield table


def packed_file(
    file: Any,  # noqa: ANN401
    path: str,
    columns: Sequence[str] | None = None,
    value_bytes: int = 1,
) -> Any:  # noqa: ANN401 - pyarrow
    """Opens a file of Parquet of which a text that stands for many is kept once, until it is held to a bound.

    Raises `StoreError` where these columns unpack to more than `LARGEST_PART`, as the pages themselves state,
    and with so many bytes for each value that are held at a time: the end of the file may state less.
    """
    data = pq.ParquetFile(file).metadata
    size = 0
    texts: set[str] = set()
    for group in range(data.num_row_groups):
        for place in range(data.num_columns):
            chunk = data.row_group(group).column(place)
            name = chunk.path_in_schema
            if columns is not None and name.partition(".")[0] not in columns:
                continue
            if chunk.physical_type == "BYTE_ARRAY":
                texts.add(name)
            try:
                pages = pages_of(file, chunk, data.created_by or "")
                size += sum(page.size + value_bytes * page.values for page in pages)
            except PageError as error:
                raise StoreError(f"{shown(path)}: {error}; remove that file, or write it again") from error
            _refuse_large(size, path)
    return pq.ParquetFile(file, read_dictionary=sorted(texts))


def unpacked(packed: pa.Table, schema: pa.Schema, path: str) -> pa.Table:
    """Returns rows of a `packed_file` in the types of a schema; raises `StoreError` where they are large."""
    _refuse_large(sum(map(_unpacked_size, packed.columns)), path)
    return packed.cast(pa.schema([schema.field(name) for name in packed.column_names]))


def _refuse_large(size: int, path: str) -> None:
    if size > LARGEST_PART:
        raise StoreError(f"{shown(path)}: unpacks to {size >> 20} MiB, and to {LARGEST_PART >> 20} at most")


def _unpacked_size(array: Any) -> int:  # noqa: ANN401 - pyarrow
    """Returns the bytes of an array once each of its texts stands by itself."""
    if isinstance(array, pa.ChunkedArray):
        return sum(map(_unpacked_size, array.chunks))
    if isinstance(array, pa.DictionaryArray):
        lengths = pc.binary_length(array.dictionary).to_numpy(zero_copy_only=False)
        uses = np.bincount(array.indices.drop_null().to_numpy(), minlength=len(lengths))
        return int(array.nbytes + np.dot(uses.astype(float), lengths))
    if pa.types.is_nested(array.type):
        inner = array.flatten()
        return sum(map(_unpacked_size, inner if isinstance(inner, list) else [inner]))
    return int(array.nbytes)


def _whole_part(file: Any, path: str, columns: Sequence[str] | None) -> pa.Table:  # noqa: ANN401 - pyarrow
    """Reads a part; raises `StoreError` where it is none: whoever may write there may have put it there."""
    about = f"{shown(path)}: is no part of results"
    found = pq.ParquetFile(file).schema_arrow
    for field in SCHEMA:
        if found.get_all_field_indices(field.name) != [SCHEMA.get_field_index(field.name)]:
            raise StoreError(f"{about}: column {field.name} is missing or elsewhere; remove that file")
        if found.field(field.name).type != field.type:
            raise StoreError(f"{about}: column {field.name} is of another type; remove that file")
    table = unpacked(packed_file(file, path, columns, _VALUE_BYTES).read(columns), found, path)
    table.validate(full=True)  # text that is no UTF-8 would be an error wherever it is looked at
    for name, values in _needed(table):
        if values.null_count:
            raise StoreError(f"{about}: a value of {name} is missing; remove that file")
    return table


def _needed(table: pa.Table) -> Iterator[tuple[str, Any]]:
    """Yields what may not be missing: all columns, and what each parameter and document states."""
    for name in table.column_names:
        column = table.column(name).combine_chunks()
        yield name, column
        if pa.types.is_list(column.type):
            inner = column.flatten()
            yield name, inner
            for each in _STATED & {part.name for part in column.type.value_type}:
                yield f"{name}.{each}", inner.field(each)


def rows(results: FileStore, columns: Iterable[str]) -> Iterator[dict[str, object]]:
    """Yields results, a mapping for each input."""
    for table in tables(results, list(columns)):
        yield from table.to_pylist()


def whole_table(results: FileStore) -> pa.Table:
    """Returns all results in the order of their keys: the same for any engine, order and size of tasks."""
    table = pa.concat_tables([SCHEMA.empty_table(), *tables(results)])
    keys = np.array(table.column("key").to_pylist(), dtype="S16")
    return table.take(pa.array(np.argsort(keys, kind="stable")))
