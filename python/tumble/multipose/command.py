"""`tumble multipose`: reads the log of a unit held in many orientations, writes its calibration and page."""

from __future__ import annotations

from typing import Annotated

import typer

from tumble.cli.gravity import GravityOption, HeightOption, LatitudeOption, check_gravity
from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import with_read_options
from tumble.logs.options import ReadOptions

SOME_FAILED = 3
"""Exit code where not all was found that was asked for."""


@with_read_options
def multipose_command(
    read_options: ReadOptions,
    log: Annotated[
        str, typer.Argument(metavar="LOG", help="Log of the unit: LOG, or LOG:NAME for one IMU of several.")
    ],
    output: OutputFolder = None,
    raw: Annotated[
        bool,
        typer.Option(
            "--raw", help="Readings are counts of unknown scale, which gravity and the turns then show."
        ),
    ] = False,
    g_sensitivity: Annotated[
        bool,
        typer.Option("--g-sensitivity", help="Fit the gyroscope's response to specific force as well."),
    ] = False,
    earth_rate: Annotated[
        bool,
        typer.Option(
            "--earth-rate",
            help="Take the upward part of the Earth's rotation off the gyroscope; needs --latitude.",
        ),
    ] = False,
    latitude: LatitudeOption = None,
    height: HeightOption = None,
    gravity: GravityOption = None,
    operator: Annotated[
        str, typer.Option(metavar="NAME", help="Who calibrated; stands in the calibration file.")
    ] = "",
    station: Annotated[str, typer.Option(metavar="NAME", help="Where; stands in the calibration file.")] = "",
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON instead of a table.")
    ] = False,
) -> None:
    """Calibrate an IMU that was held still in many orientations, without equipment.

    The unit is held or laid down still for 3 s or longer in 15 to 20 orientations, all different, and turned
    by hand in between, in one log.

    Example: tumble multipose session.csv -o results

    Finds the rests in the log by itself. Writes a calibration file and a page. The exit code is 0 if both
    sensors were calibrated, 3 if only the accelerometer was or the model does not fit, 2 if nothing could be
    done.
    """
    check_gravity(latitude, height, gravity)
    from tumble.cli.progress import sample_progress
    from tumble.logs import open_recording
    from tumble.multipose.command_results import prepare, show_results, write_results
    from tumble.multipose.procedure import as_counts, multipose

    folder = output or folder_for(log)
    prepare(folder, open_recording(log, as_counts(read_options) if raw else read_options).name)
    with sample_progress("reading") as advance:
        result = multipose(
            log,
            gravity=gravity,
            latitude=latitude,
            height=height,
            g_sensitivity=g_sensitivity,
            earth_rate=earth_rate,
            raw=raw,
            read=read_options,
            operator=operator,
            station=station,
            progress=advance,
        )
    files = write_results(result, folder)
    show_results(result, files, as_json)
    if result.verdict != "calibrated":
        raise typer.Exit(SOME_FAILED)
