"""`tumble noise`: reads logs of a sensor that stands still, writes its noise."""

from __future__ import annotations

from typing import Annotated

import typer

from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import ReadingOptions
from tumble.cli.results import end_unless, show_results, write_results
from tumble.cli.shared_options import CalibrationOption, MakerOptions, VoiceOptions
from tumble.tools.viewers.command_options import ViewerOptions


def noise_command(
    logs: Annotated[
        list[str],
        typer.Argument(
            metavar="LOG...",
            help="Logs of one sensor that stands still: LOG, or LOG:NAME for one IMU of several. Several "
            "count as records of the same sensor.",
        ),
    ],
    output: OutputFolder = None,
    calibration: CalibrationOption = None,
    *,
    maker: MakerOptions,
    voice: VoiceOptions,
    viewers: ViewerOptions,
    reading: ReadingOptions,
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
    from tumble.procedures.noise.command_files import prepare
    from tumble.procedures.noise.procedure import noise
    from tumble.procedures.noise.viewers import viewer_content

    viewers.check()
    recordings = [open_recording(log, reading.read()) for log in logs]
    folder = output or folder_for(logs[0])
    prepare(folder, recordings[0].name)
    with maker.stated(), sample_progress("reading", quiet=voice.quiet) as advance:
        result = noise(recordings, calibration=calibration, progress=advance)
    well = result.verdict == "measured"
    files = write_results(result, folder)
    files |= viewers.write(lambda: viewer_content(result, recordings), quiet=voice.quiet)
    show_results(summary, result, files, voice, well=well)
    end_unless(well)
