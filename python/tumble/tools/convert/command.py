"""`tumble convert`: a log in, the same samples in another format out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from tumble.cli.output import OutputFile, folder_named_after
from tumble.cli.read_options import ReadingOptions
from tumble.cli.screen import print_document, print_line
from tumble.cli.shared_options import JsonOption, format_option
from tumble.foundation.errors import CommandError
from tumble.foundation.log_formats import stem_of
from tumble.logs.spec import parse_spec

CONVERSION: Final = "tumble-conversion/1"


def convert_command(
    log: Annotated[
        str, typer.Argument(metavar="LOG", help="Log: all its IMUs, or LOG:NAME for one of them.")
    ],
    output: OutputFile = None,
    format_name: Annotated[str | None, format_option("csv|parquet|mcap|euroc", "that of its name")] = None,
    imus: Annotated[
        list[str] | None, typer.Option("--imu", metavar="NAME", help="One IMU of several; repeatable.")
    ] = None,
    as_json: JsonOption = False,
    *,
    reading: ReadingOptions,
) -> None:
    """Write a log in another format, in SI units.

    Example: tumble convert drive.bag -o drive.parquet

    Writes s, m/s^2, rad/s and degC. The time is that of the sensor where the log has it; how that of
    recording runs beside it (skew, jitter) is reported. Several IMUs become topics of one MCAP file or
    folders of one EuRoC folder; in CSV and Parquet each is a file, OUT-NAME.

    The file is named by -o, or ./NAME-tumble with the ending of --format; EuRoC is a folder.

    A remark lists the losses of the format. Logs of any length are written piece by piece.
    """
    from tumble.cli.progress import sample_progress
    from tumble.tools.convert.procedure import convert

    with sample_progress("converting") as advance:
        done = convert(
            log,
            output or _output(log, format_name),
            to=format_name,
            imus=imus or (),
            read=reading.read(),
            progress=advance,
        )
    if as_json:
        print_document(CONVERSION, "written", done.content())
        return
    for line in done.lines():
        print_line(line)
    for each in done.imus:
        for remark in each.remarks:
            print_line(f"tumble: {each.imu + ': ' if each.imu else ''}{remark}", is_message=True)


def _output(log: str, format_name: str | None) -> Path:
    """Name the file after the log; raises `CommandError` if its format is not given."""
    if format_name is None:
        raise CommandError("give -o FILE, whose ending says the format, or --format")
    folder = folder_named_after(stem_of(parse_spec(log).path))
    return folder if format_name == "euroc" else folder.with_name(f"{folder.name}.{format_name}")
