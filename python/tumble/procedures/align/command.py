"""`tumble align`: reads units that moved together, writes how they sit beside each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.json_option import JsonOption
from tumble.cli.maker_options import with_maker
from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import ExceptionsOption, read_options_for, with_read_options
from tumble.cli.results import end_unless, show_results
from tumble.logs.options import ReadOptions

if TYPE_CHECKING:
    pass


@with_maker
@with_read_options
def align_command(
    read_options: ReadOptions,
    primary: Annotated[
        str,
        typer.Option(metavar="NAME", help="Unit to which the others are aligned: NAME in LOG, or LOG:NAME."),
    ],
    secondary: Annotated[
        list[str], typer.Option(metavar="NAME", help="Unit to be aligned, likewise; repeatable.")
    ],
    log: Annotated[
        str | None, typer.Argument(metavar="LOG", help="Log that holds all units, if one does.")
    ] = None,
    output: OutputFolder = None,
    search: Annotated[
        float,
        typer.Option(metavar="SECONDS", min=0.0, help="Largest offset between the clocks of two units."),
    ] = 5.0,
    exceptions: ExceptionsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find rotation, time offset and lever arm between units that moved together.

    All units are fastened to one body, which is turned about every axis for half a minute or longer.

    Example: tumble align flight.parquet --primary imu1 --secondary imu2 --secondary imu3 -o results

    Writes align.yaml, the settings of the units for tumble redundancy, and a page. The exit code is 0 if
    everything was found, 3 if the motion left a rotation or a lever arm open, 2 if nothing could be done.
    """
    from tumble.cli.progress import sample_progress
    from tumble.procedures.align import summary
    from tumble.procedures.align.command_files import prepare, write_results
    from tumble.procedures.align.procedure import align

    folder = output or folder_for(log or primary)
    prepare(folder)
    sources = (primary, *secondary)
    read = read_options_for(read_options, exceptions or (), sources)
    with sample_progress("reading") as advance:
        result = align(primary, secondary, log, search=search, read=read, progress=advance)
    files = write_results(result, folder)
    show_results(summary, result, files, as_json)
    end_unless(result.verdict == "aligned")
