"""`tumble align`: reads units that moved together, writes how they sit beside each other."""

from __future__ import annotations

from typing import Annotated

import typer

from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import ReadingOptionsOfSeveral
from tumble.cli.results import end_unless, show_results, write_results
from tumble.cli.shared_options import MakerOptions, VoiceOptions
from tumble.tools.viewers.command_options import ViewerOptions


def align_command(
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
    *,
    maker: MakerOptions,
    voice: VoiceOptions,
    viewers: ViewerOptions,
    reading: ReadingOptionsOfSeveral,
) -> None:
    """Find rotation, time offset and lever arm between units that moved together.

    All units are fastened to one body, which is turned about every axis for half a minute or longer.

    Example: tumble align flight.parquet --primary imu1 --secondary imu2 --secondary imu3 -o results

    Writes align.yaml, the settings of the units for tumble redundancy, and a page. The exit code is 0 if
    everything was found, 3 if the motion left a rotation or a lever arm open, 2 if nothing could be done.
    """
    from tumble.cli.progress import sample_progress
    from tumble.procedures.align import summary
    from tumble.procedures.align.command_files import prepare
    from tumble.procedures.align.procedure import align, open_aligned
    from tumble.procedures.align.viewers import viewer_content

    viewers.check()
    folder = output or folder_for(log or primary)
    prepare(folder)
    read = reading.read_each((primary, *secondary))
    with maker.stated(), sample_progress("reading", quiet=voice.quiet) as advance:
        result = align(primary, secondary, log, search=search, read=read, progress=advance)
    well = result.verdict == "aligned"
    files = write_results(result, folder)
    files |= viewers.write(
        lambda: viewer_content(result, open_aligned(primary, secondary, log, read)), quiet=voice.quiet
    )
    show_results(summary, result, files, voice, well=well)
    end_unless(well)
