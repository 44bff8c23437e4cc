"""Recordings out: CSV, Parquet or MCAP, chunk after chunk, in SI units and under plain names."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from tumble.errors import OutputError
from tumble.files import replacing
from tumble.logs.writer import Facts, Writer

if TYPE_CHECKING:
    from tumble.logs.writer_mcap import McapWriter


AnyWriter = TypeVar("AnyWriter", bound=Writer)

FORMATS = ("csv", "parquet", "mcap")
"""What can be written; the name of a format is also the usual extension."""


def format_for(path: Path, name: str | None = None) -> str:
    """Give the format to write: the one named, else that of the extension.

    Raises `OutputError` where neither is one that can be written.
    """
    wanted = (name or path.suffix.removeprefix(".")).lower()
    if wanted not in FORMATS:
        raise OutputError(
            f"{path}: cannot write {wanted or 'a file without an extension'}; "
            f"give one of {', '.join(FORMATS)} as extension or with --format"
        )
    return wanted


@contextmanager
def open_writer(
    path: str | Path, format_name: str | None = None, facts: Facts | None = None
) -> Iterator[Writer]:
    """Open a file to write one recording to; it takes its place only when the block ends without an error.

    Columns are `time` s, `ax ay az` m/s^2, `gx gy gz` rad/s and, if the first chunk has it, `temperature`
    degC.
    MCAP holds sensor_msgs/Imu on `/imu/data` and sensor_msgs/Temperature on `/imu/temperature`,
    stamped to the nanosecond.

    Raises `OutputError` where the format is unknown or the file cannot be written.
    """
    path = Path(path)
    with _opened(path, _writer(format_for(path, format_name)), facts or Facts()) as writer:
        yield writer


@contextmanager
def open_mcap_writer(path: str | Path, facts: Facts | None = None) -> Iterator[McapWriter]:
    """Open an MCAP file to write several IMUs to; as `open_writer` else.

    Each is a topic of its own, so that `LOG:NAME` reads it.
    """
    from tumble.logs.writer_mcap import McapWriter

    with _opened(Path(path), McapWriter, facts or Facts()) as writer:
        yield writer


def _writer(format_name: str) -> Callable[[Path, Facts], Writer]:
    """Import the writer of a format, and with it the library that it needs."""
    if format_name == "mcap":
        from tumble.logs.writer_mcap import McapWriter

        return McapWriter
    from tumble.logs.writer_tables import CsvWriter, ParquetWriter

    return CsvWriter if format_name == "csv" else ParquetWriter


@contextmanager
def _opened(path: Path, make: Callable[[Path, Facts], AnyWriter], facts: Facts) -> Iterator[AnyWriter]:
    with replacing(path) as temporary:
        writer = make(temporary, facts)
        try:
            yield writer
        finally:
            writer.close()
