"""`tumble thermal`: reads logs of a unit that warms and cools at rest, writes its drift over temperature."""

from __future__ import annotations

from typing import Annotated

import typer

from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import ReadingOptions
from tumble.cli.results import end_unless, show_results, write_results
from tumble.cli.shared_options import CalibrationOption, MakerOptions, VoiceOptions
from tumble.tools.viewers.command_options import ViewerOptions


def thermal_command(
    logs: Annotated[
        list[str],
        typer.Argument(
            metavar="LOG...",
            help="Logs of one unit at rest, with its temperature: LOG, or LOG:NAME for one IMU of several. "
            "Several are sessions of the same unit.",
        ),
    ],
    output: OutputFolder = None,
    calibration: CalibrationOption = None,
    calibration_temperature: Annotated[
        float | None,
        typer.Option(
            metavar="DEGC", help="Temperature that calibration was made at, where it does not say so."
        ),
    ] = None,
    fixture: Annotated[
        bool,
        typer.Option(
            "--fixture",
            help="A table or jig returned the unit to each orientation exactly; else each rest is by itself.",
        ),
    ] = False,
    *,
    maker: MakerOptions,
    voice: VoiceOptions,
    viewers: ViewerOptions,
    reading: ReadingOptions,
) -> None:
    """Find how bias and scale of a unit change with temperature.

    The unit lies untouched while it warms and cools through all temperatures it will meet, an hour or longer.

    Example: tumble thermal freezer.csv -o results

    Writes a calibration file and a page. The exit code is 0 if drift and hysteresis of all axes were found, 3
    if hysteresis is not known or too large for one curve, 2 if nothing could be done.
    """
    from tumble.calibration.unit_files import prepare_unit_files
    from tumble.cli.progress import sample_progress
    from tumble.logs import open_recording
    from tumble.procedures.thermal import summary
    from tumble.procedures.thermal.procedure import thermal
    from tumble.procedures.thermal.viewers import viewer_content

    viewers.check()
    recordings = [open_recording(log, reading.read()) for log in logs]
    folder = output or folder_for(logs[0])
    prepare_unit_files(folder, recordings[0].name, "thermal")
    with maker.stated(), sample_progress("reading", quiet=voice.quiet) as advance:
        result = thermal(
            recordings,
            fixture=fixture,
            calibration=calibration,
            calibration_temperature=calibration_temperature,
            progress=advance,
        )
    well = result.verdict == "measured"
    files = write_results(result, folder)
    files |= viewers.write(lambda: viewer_content(result, recordings), quiet=voice.quiet)
    show_results(summary, result, files, voice, well=well)
    end_unless(well)
