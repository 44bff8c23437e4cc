"""`tumble noise`: reads logs of a sensor that stands still, writes its noise."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.exit_code import ExitCode
from tumble.cli.maker_options import with_maker
from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import with_read_options
from tumble.cli.screen import print_json, print_summary
from tumble.cli.start import StartOption
from tumble.logs.options import ReadOptions

if TYPE_CHECKING:
    from tumble.noise.result import NoiseResult


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
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON instead of a table.")
    ] = False,
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
    from tumble.noise.command_files import prepare, write_results
    from tumble.noise.procedure import noise

    recordings = [open_recording(log, read_options) for log in logs]
    folder = output or folder_for(logs[0])
    prepare(folder, recordings[0].name)
    with sample_progress("reading") as advance:
        result = noise(recordings, start=start, progress=advance)
    _show(result, write_results(result, folder), as_json)
    if result.verdict != "measured":
        raise typer.Exit(ExitCode.NOT_ALL_WELL)


def _show(result: NoiseResult, files: dict[str, Path], as_json: bool) -> None:
    from tumble.noise.summary import json_content, screen_summary

    if as_json:
        print_json(json_content(result, files))
        return
    print_summary(screen_summary(result))
    print(f"Calibration: {files['calibration']}")
    print(f"Kalibr, OpenVINS, VINS: {files['kalibr']}")
    print(f"Report: {files['report']}")
