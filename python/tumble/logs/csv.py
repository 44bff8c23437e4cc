"""Text tables: block after block of whole lines, each parsed by pyarrow on a core of its own."""

from __future__ import annotations

import math
import os
import re
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.csv  # type: ignore[import-untyped]

from tumble.foundation.errors import LogError
from tumble.foundation.numbers import number_of
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of
from tumble.logs.arrow_floats import as_floats
from tumble.logs.columns import ImuColumns, find_imus, unread_accelerometers
from tumble.logs.magnetometer import magnetometer_in
from tumble.logs.options import ReadOptions
from tumble.logs.own_stamps import with_own_stamps
from tumble.logs.row_labels import LabelColumn, NamedImu, choose_row_imu, named_imus, of_label
from tumble.logs.text import BLANKS, TextLayout, find_layout, is_clock_time, is_time_stamp, split_line
from tumble.logs.text_file import open_text, text_size
from tumble.logs.track import (
    CHUNK_SAMPLES,
    DATE_AND_TIME,
    TIME_OF_DAY,
    LoggedImu,
    RawSamples,
    StatedUnit,
    stack,
    with_written_units,
)

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

_SMALLEST_BLOCK, _LARGEST_BLOCK = 1 << 16, 1 << 26
_CORES = os.cpu_count() or 1
_BLOCKS_AHEAD = min(4, _CORES)
"""Blocks of one table that are parsed at a time."""
_LONGEST_SHOWN = 40
_ODD = re.compile("[^\t\x20-\x7e]")
RATE_KEYS = ("fs", "rate", "sample rate", "sample_rate", "sampling rate", "frequency", "sampling frequency")
RATE_FROM_LINE = "rate of {rate:.6g} Hz from the line '{key}' before the columns"


@cache
def _workers_of(process: int) -> ThreadPoolExecutor:
    """Returns the threads that parse the blocks of all tables a process reads; a forked one has its own.

    They stay as long as the process: a pass that is abandoned may be ended by the garbage collector within a
    thread that is just starting, and whoever joins threads there waits for ever.
    """
    from concurrent.futures import ThreadPoolExecutor  # which a table of one block does without

    return ThreadPoolExecutor(_CORES, thread_name_prefix=f"tumble-csv-{process}")


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the column prefixes of a text table, and the labels of rows."""
    layout = find_layout(path, options)
    return tuple(_named(path, layout, find_imus(layout.names, path, options), options))


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds the columns of one IMU in a text table.

    Raises `LogError` where the table has no such IMU, or no time and no rate is known.
    """
    layout = find_layout(path, options)
    imus = find_imus(layout.names, path, options)
    named = _named(path, layout, imus, options)
    name = choose_row_imu(path, named, imus, imu)
    columns = imus[named[name].prefix]
    unread = unread_accelerometers(layout.names, options.columns, imus)

    def opened(columns: ImuColumns) -> LoggedImu:
        found = imu_of_table(path, layout, columns, options)
        found = replace(found, imu=name, alone=len(imus) == 1, notices=(*found.notices, *unread))
        return of_label(found, named[name], name)

    return with_own_stamps(opened, columns, options)


def _named(
    path: Path, layout: TextLayout, imus: Mapping[str, ImuColumns], options: ReadOptions
) -> dict[str, NamedImu]:
    """Returns the IMUs of a table; a column of labels is read with those of the IMU, and as they are."""

    def gather(columns: ImuColumns, name: str) -> LabelColumn:
        read = columns.names if columns.triads else columns.magnetic_names
        table = TextTable(path, layout, [*read, name], skip_bad_lines=options.skip_bad_lines, text=name)
        return table.labels()

    return named_imus(imus, layout.names, options, gather)


def imu_of_table(
    path: Path,
    layout: TextLayout,
    columns: ImuColumns,
    options: ReadOptions,
    samples: Callable[[CsvRows], RawSamples] | None = None,
    table: TextTable | None = None,
    whole: Callable[[Sequence[str]], Mapping[str, FloatArray]] | None = None,
) -> LoggedImu:
    """Reads the only IMU of a text table from columns that are known.

    `samples` makes samples of rows where that is more than to gather columns; `table` is not the usual one,
    and `whole` reads some of its columns, all at once.
    """
    table = table or TextTable(path, layout, columns.names, skip_bad_lines=options.skip_bad_lines)
    gather = samples or (lambda rows: table_samples(rows, columns))
    rate, notices = _stated_rate(layout, columns, options)

    def columns_of(names: Sequence[str]) -> Mapping[str, FloatArray]:
        return TextTable(path, layout, names, skip_bad_lines=options.skip_bad_lines).whole()

    table_imu = LoggedImu(
        path=path,
        imu="",
        format="csv",
        read=lambda transform: table.read(lambda rows: transform(gather(rows))),
        head=lambda: gather(table.head()),
        locate=lambda sample: f"line {table.line_of(sample)}",
        accelerometer_unit=columns.accelerometer_unit,
        gyroscope_unit=columns.gyroscope_unit,
        time_unit=_time_unit(layout, columns),
        temperature_unit=columns.temperature_unit,
        clock=f"{path.resolve()}#{columns.time or 'row'}",
        rate=rate,
        serial=layout.preamble.get("serial", ""),
        triads=columns.triads,
        magnetometer=magnetometer_in(columns, whole or columns_of),
        columns=layout.names,
        expected=expected_rows(path, layout),
        already_corrected=True if "corrected" in layout.preamble else None,
        correction=layout.preamble.get("corrected", ""),
        notices=layout.notices + notices,
    )
    return with_written_units(table_imu, layout.preamble.get("units"))


def expected_rows(path: Path, layout: TextLayout) -> int | None:
    """Guesses the number of rows; None where the file is packed."""
    size = text_size(path)
    return None if size is None else int((size - layout.data_offset) / layout.row_bytes)


def _stated_rate(
    layout: TextLayout, columns: ImuColumns, options: ReadOptions
) -> tuple[float | None, tuple[str, ...]]:
    if columns.time is not None or options.rate is not None:
        return None, ()
    for key in RATE_KEYS:
        rate = number_of(layout.preamble.get(key, "").lower().removesuffix("hz"))
        if rate is not None and 0.0 < rate < math.inf:
            return rate, (RATE_FROM_LINE.format(rate=rate, key=key),)
    return None, ()


def _time_unit(layout: TextLayout, columns: ImuColumns) -> StatedUnit | None:
    if columns.time is not None and is_time_stamp(layout.first_field(columns.time)):
        return StatedUnit("ns", DATE_AND_TIME)
    if columns.time is not None and is_clock_time(layout.first_field(columns.time)):
        return StatedUnit("ns", TIME_OF_DAY)
    return columns.time_unit


def table_samples(rows: CsvRows, columns: ImuColumns) -> RawSamples:
    """Gathers the columns of one IMU, and lists missing lines."""
    return replace(samples_of(rows.columns, columns), bad_lines=rows.bad_lines)


def samples_of(batch: Mapping[str, FloatArray], columns: ImuColumns) -> RawSamples:
    """Gathers the columns of one IMU."""
    return RawSamples(
        None if columns.time is None else batch[columns.time],
        stack(batch, columns.accelerometer),
        stack(batch, columns.gyroscope),
        None if columns.temperature is None else batch[columns.temperature],
    )


@dataclass(frozen=True, slots=True)
class CsvBlock:
    """Whole lines of a file."""

    offset: int
    data: bytes


@dataclass(frozen=True, slots=True)
class CsvRows:
    """Some columns of successive lines, by name."""

    columns: Mapping[str, FloatArray]
    bad_lines: tuple[str, ...] = ()
    """Error in each line that was left out."""


class TextTable:
    """Some columns of a text table, read in blocks so that its length does not matter.

    A line that cannot be read ends the pass with a `LogError` that names it, or is left out where
    `skip_bad_lines` is set; None is for those who cannot leave any out.
    """

    def __init__(
        self,
        path: Path,
        layout: TextLayout,
        names: Sequence[str],
        *,
        skip_bad_lines: bool | None = None,
        text: str | None = None,
    ) -> None:
        """Reads the columns `names`, one of which may hold text: see `labels`."""
        self._path = path
        self._layout = layout
        self._names = list(names)
        self._skip_bad_lines = skip_bad_lines
        self._text = text
        self._words: list[str] = []
        self._places: dict[str, int] = {}
        self._block_bytes = int(min(max(layout.row_bytes * CHUNK_SAMPLES, _SMALLEST_BLOCK), _LARGEST_BLOCK))
        self._head: CsvRows | None = None
        """First block until the end of a pass: a log is opened and looked at before, and may be one block."""

    def read(self, use: Callable[[CsvRows], RawSamples]) -> Iterator[RawSamples]:
        """Passes over the file; blocks are parsed and used in parallel, and given back in order."""
        waiting: deque[Future[RawSamples]] = deque()
        blocks = self._blocks()
        try:
            if (head := self._head) and next(blocks, None):
                yield use(head)
            for block in blocks:
                parsed = _workers_of(os.getpid()).submit(lambda block: use(self._parse(block)), block)
                waiting.append(parsed)
                if len(waiting) > _BLOCKS_AHEAD:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
            self._head = None
        finally:
            for block_read in waiting:
                block_read.cancel()

    def whole(self) -> Mapping[str, FloatArray]:
        """Parses all of it at once, for a table that is short."""
        blocks = [self._parse(block).columns for block in self._blocks()]
        return {
            name: np.concatenate([np.empty(0), *(block[name] for block in blocks)]) for name in self._names
        }

    def labels(self) -> LabelColumn:
        """Returns the words in the column of text, up to where it is no column of labels."""
        assert self._text is not None, "asked only of a table with one"
        found = LabelColumn(self._text)
        for block in self._blocks():
            codes = self._parse(block).columns[self._text]
            found.add(self._words, np.nan_to_num(codes, nan=-1.0).astype(np.intp))
            if not found.is_open:
                break
        return found

    def head(self) -> CsvRows:
        """Parses the first block."""
        self._head = self._head or next(map(self._parse, self._blocks()), None)
        if self._head is None:
            raise LogError(f"{self._path}: holds no samples")
        return self._head

    def line_of(self, sample: int) -> int:
        """Line, from 1, of a sample, from 0: blank lines hold no sample."""
        with open_text(self._path, self._layout.data_offset) as file:
            numbered = enumerate(file, start=self._layout.lines_before + 1)
            rows = (line for line, text in numbered if text.strip(b"\r\n") and not self._is_left_out(text))
            return next(line for row, line in enumerate(rows) if row == sample)

    def _is_left_out(self, line: bytes) -> bool:
        return bool(self._skip_bad_lines and self._problem(_decoded(line.rstrip(b"\r\n")), cut_off=False))

    def _blocks(self) -> Iterator[CsvBlock]:
        offset = self._layout.data_offset
        with open_text(self._path, offset) as file:
            rest: list[bytes] = []
            while piece := file.read(self._block_bytes):
                cut = piece.rfind(b"\n") + 1
                if cut == 0:
                    rest.append(piece)
                    if sum(map(len, rest)) > _LARGEST_BLOCK:
                        raise LogError(
                            f"{self._path}: not a log: a line is longer than {_LARGEST_BLOCK >> 20} MiB"
                        )
                    continue
                data = b"".join((*rest, piece[:cut]))
                rest = [piece[cut:]]
                if data.strip():
                    yield CsvBlock(offset, data)
                offset += len(data)
            if (last := b"".join(rest)).strip():
                yield CsvBlock(offset, last)

    def _parse(self, block: CsvBlock) -> CsvRows:
        try:
            return CsvRows(self._parsed(block.data))
        except pa.ArrowInvalid as error:
            first = self._layout.lines_before + 1 + self._newlines_before(block.offset)
            bad = self._bad_lines(block.data, first)
            if not bad:
                raise self._unread(first, error) from error
            if not self._skip_bad_lines:
                number, problem = next(iter(bad.items()))
                raise LogError(f"{self._path}: line {number} {problem}; {self._remedy()}") from error
        lines = enumerate(block.data.split(b"\n"), start=first)
        kept = b"\n".join(line for number, line in lines if number not in bad)
        problems = tuple(f"line {number} {problem}" for number, problem in bad.items())
        try:
            return CsvRows(self._parsed(kept) if kept.strip() else self._nothing(), problems)
        except pa.ArrowInvalid as error:
            raise self._unread(first, error) from error

    def _nothing(self) -> Mapping[str, FloatArray]:
        return {name: np.empty(0) for name in self._names}

    def _unread(self, line: int, error: Exception) -> LogError:
        return LogError(f"{self._path}: cannot be read after line {line}: {str(error).splitlines()[0]}")

    def _remedy(self) -> str:
        repair = "repair or delete that line"
        return (
            repair
            if self._skip_bad_lines is None
            else f"{repair}, or leave such lines out with --skip-bad-lines"
        )

    def _parsed(self, data: bytes) -> Mapping[str, FloatArray]:
        layout = self._layout
        if layout.delimiter == BLANKS:
            data = _single_blanks(data)
        options: dict[str, Any] = {
            "read_options": pa.csv.ReadOptions(
                column_names=list(layout.names), use_threads=False, block_size=len(data) + 1
            ),
            "parse_options": pa.csv.ParseOptions(
                delimiter=layout.delimiter, quote_char='"' if layout.quoted else False
            ),
            "convert_options": pa.csv.ConvertOptions(
                include_columns=self._names,
                column_types={name: self._type(name) for name in self._names},
                decimal_point=layout.decimal_point,
                strings_can_be_null=True,
            ),
        }
        table = pa.csv.read_csv(pa.BufferReader(data), **options)
        return {
            name: self._coded(table.column(name)) if name == self._text else as_floats(table.column(name))
            for name in self._names
        }

    def _coded(self, column: pa.ChunkedArray) -> FloatArray:
        """Returns the place of each word among all that the table holds; NaN where there is none."""
        column = column.combine_chunks().dictionary_encode()
        column = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
        words = column.dictionary.to_pylist()
        for word in words:
            if word not in self._places:
                self._places[word] = len(self._words)
                self._words.append(word)
        codes = np.array([*(self._places[word] for word in words), -1.0])
        return codes[np.nan_to_num(as_floats(column.indices), nan=-1.0).astype(np.intp)]

    def _type(self, name: str) -> pa.DataType:
        if name == self._text:
            return pa.string()
        field = self._layout.first_field(name)
        if is_clock_time(field):
            return pa.time64("ns")
        if not is_time_stamp(field):
            return pa.float64()
        return pa.timestamp("ns", tz="UTC" if re.search(r"(Z|[+-]\d\d:?\d\d)$", field) else None)

    def _bad_lines(self, data: bytes, first: int) -> dict[int, str]:
        """Finds the lines that cannot be read: what is wrong with each, by its number, `first` on."""
        lines = data.split(b"\n")
        last = first + len(lines) - 1
        problems = {
            number: self._problem(_decoded(line.rstrip(b"\r")), cut_off=number == last)
            for number, line in enumerate(lines, start=first)
        }
        return {number: problem for number, problem in problems.items() if problem}

    def _problem(self, line: str, *, cut_off: bool) -> str:
        quotes = '"' if self._layout.quoted else ""
        fields = split_line(line, self._layout.delimiter, quotes) if line else []
        wanted = len(self._layout.names)
        if fields and len(fields) != wanted:
            if cut_off:
                return f"breaks off after {len(fields)} of {wanted} fields: the file is cut short"
            return f"has {count_of('field', len(fields))} where {wanted} columns are named{_odd_byte(line)}"
        for name in self._names if fields else ():
            if name == self._text:
                continue
            position = self._layout.names.index(name)
            text = fields[position]
            if not self._reads(position, text):
                return f"holds {_shown(text)} in column {name}, which is not a number{_odd_byte(line)}"
        if self._layout.quoted and line.count('"') % 2:
            return "holds a quote that is not closed"
        return f"is torn{_odd_byte(line)}" if "\r" in line else ""

    def _reads(self, position: int, text: str) -> bool:
        if self._type(self._layout.names[position]) == pa.float64():
            return _reads_as_number(text, self._layout.decimal_point)
        if pa.types.is_time(self._type(self._layout.names[position])):
            return not text or is_clock_time(text)
        try:
            pa.scalar(text).cast(self._type(self._layout.names[position]))
        except pa.ArrowInvalid:
            return not text
        return True

    def _newlines_before(self, offset: int) -> int:
        count = 0
        position = self._layout.data_offset
        with open_text(self._path, position) as file:
            # It ends sooner where somebody cuts the file while it is read.
            while piece := file.read(min(1 << 20, offset - position)):
                count += piece.count(b"\n")
                position += len(piece)
        return count


def _single_blanks(data: bytes) -> bytes:
    """Leaves one blank between fields and none around a line; replacing is ten times as fast as a pattern."""
    data = data.replace(b"\t", b" ").replace(b"\r\n", b"\n")
    while b"  " in data:
        data = data.replace(b"  ", b" ")
    return data.replace(b" \n", b"\n").replace(b"\n ", b"\n").strip(b" ")


def _decoded(line: bytes) -> str:
    """Keeps bytes that are no text apart, so that they can be named."""
    return line.decode("utf-8", errors="surrogateescape")


def _odd_byte(line: str) -> str:
    """Names the first byte that no text log holds, and where it stands; empty if there is none."""
    found = _ODD.search(line)
    if found is None:
        return ""
    place = len(line[: found.start()].encode("utf-8", errors="surrogateescape")) + 1
    return f", byte {place} is 0x{line[found.start()].encode('utf-8', errors='surrogateescape')[0]:02x}"


def _shown(text: str) -> str:
    short = text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}..."
    return ascii(short)


def _reads_as_number(text: str, decimal_point: str) -> bool:
    return (
        not text or number_of(text, decimal_point) is not None or text in pa.csv.ConvertOptions().null_values
    )
