"""`tumble convert`: a log in, the same samples in another format out."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from tumble.cli.json_option import JsonOption
from tumble.cli.output import output_path
from tumble.cli.read_options import with_read_options
from tumble.logs.options import ReadOptions


@with_read_options
def convert_command(
    log: Annotated[
        str, typer.Argument(metavar="LOG", help="Log: all its IMUs, or LOG:NAME for one of them.")
    ],
    read_options: ReadOptions,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="OUT",
            parser=output_path,
            help="File to write; for EuRoC a folder.",
            show_default=False,
        ),
    ],
    to: Annotated[
        str | None,
        typer.Option("--to", metavar="csv|parquet|mcap|euroc", help="Format, if not that of OUT's name."),
    ] = None,
    imus: Annotated[
        list[str] | None, typer.Option("--imu", metavar="NAME", help="One IMU of several; repeatable.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Write a log in another format, in SI units.

    Example: tumble convert drive.bag -o drive.parquet

    Writes s, m/s^2, rad/s and degC. The time is that of the sensor where the log has it; how that of
    recording runs beside it (skew, jitter) is said. Several IMUs become topics of one MCAP file or folders of
    one EuRoC folder; of CSV and Parquet each is a file, OUT-NAME.

    What the format has no place for is said. Logs of any length are written piece by piece.
    """
    from tumble.cli.progress import sample_progress
    from tumble.cli.screen import print_json
    from tumble.tools.convert.procedure import convert

    with sample_progress("converting") as advance:
        done = convert(log, output, to=to, imus=imus or (), read=read_options, progress=advance)
    if as_json:
        print_json(done.content())
        return
    for line in done.lines():
        print(line)
    for each in done.imus:
        for remark in each.remarks:
            print(f"tumble: {each.imu + ': ' if each.imu else ''}{remark}", file=sys.stderr)
