"""Recordings out: CSV, Parquet or MCAP, chunk after chunk, in SI units and under plain names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from tumble.foundation.errors import OutputError
from tumble.foundation.files import FileKind, replacing
from tumble.foundation.units import TRIADS
from tumble.logs.writer import Facts, Writer

if TYPE_CHECKING:
    from tumble.logs.writer_mcap import McapWriter

FORMATS = {
    "csv": FileKind(
        "a CSV log of Tumble",
        re.compile(rb"\A(?:#[^\n]*\n)*time,[ag]x,[ag]y,[ag]z"),
        re.compile(rb"\A(?:#[^\n]*\n)*# units: SI\n"),
    ),
    "parquet": FileKind("a Parquet file", re.compile(rb"\APAR1"), re.compile(rb"tumble\.units")),
    "mcap": FileKind(
        "an MCAP file",
        re.compile(rb"\A\x89MCAP0\r\n"),
        # The header names the library that wrote the file.
        re.compile(rb"\A\x89MCAP0\r\n\x01.{8}\x04\0\0\0ros2\x06\0\0\0tumble", re.DOTALL),
    ),
}
"""Formats that can be written, with beginnings and marks; the name of a format is its usual extension too."""


def format_for(path: Path, name: str | None = None) -> str:
    """Returns the format to write: the one named, else that of the extension.

    Raises `OutputError` where neither is one that can be written.
    """
    wanted = (name or path.suffix.removeprefix(".")).lower()
    if wanted not in FORMATS:
        raise OutputError(
            f"{path}: cannot write {wanted if wanted.isalnum() else 'a file without an extension'}; "
            f"give one of {', '.join(FORMATS)} as extension or with --format"
        )
    return wanted


@contextmanager
def open_writer(
    path: str | Path,
    format_name: str | None = None,
    facts: Facts | None = None,
    *,
    inputs: Iterable[Path] = (),
    durable: bool = False,
) -> Iterator[Writer]:
    """Opens a file to write one recording to; it takes its place only when the block ends without an error.

    Columns are `time` s, `ax ay az` m/s^2, `gx gy gz` rad/s and, if the first chunk has it, `temperature`
    degC.
    MCAP holds sensor_msgs/Imu on `/imu/data` and sensor_msgs/Temperature on `/imu/temperature`,
    stamped to the nanosecond. None of `inputs` may be replaced. A `durable` file survives a loss of power.

    Raises `OutputError` where the format is unknown or the file cannot be written.
    """
    path = Path(path)
    wanted = format_for(path, format_name)
    with (
        replacing(path, FORMATS[wanted], inputs=inputs, durable=durable) as file,
        closing(_writer(wanted, file, facts or Facts(), path)) as writer,
    ):
        yield writer


@contextmanager
def open_mcap_writer(
    path: str | Path, facts: Facts | None = None, *, inputs: Iterable[Path] = ()
) -> Iterator[McapWriter]:
    """Opens an MCAP file to write several IMUs to; as `open_writer` else.

    Each is a topic of its own, so that `LOG:NAME` reads it.
    """
    from tumble.logs.writer_mcap import McapWriter

    path = Path(path)
    with (
        replacing(path, FORMATS["mcap"], inputs=inputs) as file,
        closing(McapWriter(file, facts or Facts(), path)) as writer,
    ):
        yield writer


def _writer(format_name: str, file: BinaryIO, facts: Facts, path: Path) -> Writer:
    """Imports the writer of a format, and with it the library that it needs."""
    if format_name == "mcap":
        if facts.triads != TRIADS:
            raise OutputError(
                f"{path}: an MCAP message holds both triads, and there are {facts.triads[0]} readings only; "
                "give csv or parquet, as extension or with --format"
            )
        from tumble.logs.writer_mcap import McapWriter

        return McapWriter(file, facts, path)
    from tumble.logs.writer_tables import CsvWriter, ParquetWriter

    return CsvWriter(file, facts) if format_name == "csv" else ParquetWriter(file, facts)
