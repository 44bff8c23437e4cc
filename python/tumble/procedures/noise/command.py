"""`tumble noise`: reads logs of a sensor that stands still, writes its noise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.json_option import JsonOption
from tumble.cli.maker_options import with_maker
from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import with_read_options
from tumble.cli.results import end_unless, show_results
from tumble.cli.start import StartOption
from tumble.logs.options import ReadOptions

if TYPE_CHECKING:
    pass


@with_maker
@with_read_options
def noise_command(
    read_options: ReadOptions,
    logs: Annotated[
        list[str],
        typer.Argument(
            metavar="LOG...",
            help="Logs of one sensor that stands still: LOG, or LOG:NAME for one IMU of several. Several "
            "count as records of the same sensor.",
        ),
    ],
    output: OutputFolder = None,
    start: StartOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find the noise of a sensor that stands still: Allan deviations and the terms they show.

    The unit lies untouched, for some hours if bias instability and random walk are wanted.

    Example: tumble noise night.bag:/imu/data -o results

    Writes a calibration file, a page, and the noise as Kalibr and OpenVINS read it, that of VINS beside it.
    The exit code is 0 if white noise, bias instability and random walk of all channels were found, 3 if the
    log is too short for one of them or something else than noise disturbed it, 2 if nothing could be done.
    """
    from tumble.cli.progress import sample_progress
    from tumble.logs import open_recording
    from tumble.procedures.noise import summary
    from tumble.procedures.noise.command_files import prepare, write_results
    from tumble.procedures.noise.procedure import noise

    recordings = [open_recording(log, read_options) for log in logs]
    folder = output or folder_for(logs[0])
    prepare(folder, recordings[0].name)
    with sample_progress("reading") as advance:
        result = noise(recordings, start=start, progress=advance)
    show_results(summary, result, write_results(result, folder), as_json)
    end_unless(result.verdict == "measured")
