"""`tumble magnetometer`: reads the log of a unit that was turned by hand, writes its calibration and page."""

from __future__ import annotations

from typing import Annotated

import typer

from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import ReadingOptions
from tumble.cli.results import end_unless, show_results, write_results
from tumble.cli.shared_options import CalibrationOption, MakerOptions, VoiceOptions
from tumble.procedures.magnetometer.command_options import EarthFieldOptions
from tumble.tools.viewers.command_options import ViewerOptions


def magnetometer_command(
    log: Annotated[
        str,
        typer.Argument(
            metavar="LOG", help="Log with a magnetometer: LOG, or LOG:NAME for one unit of several."
        ),
    ],
    output: OutputFolder = None,
    calibration: CalibrationOption = None,
    latitude: Annotated[
        float | None,
        typer.Option(help="Latitude in degrees, to work out the Earth's field.", show_default=False),
    ] = None,
    height: Annotated[
        float | None, typer.Option(help="Height above the ellipsoid in m.", show_default=False)
    ] = None,
    turned: Annotated[
        bool,
        typer.Option("--turned", help="Use all samples, and no rests; the mounting then remains unknown."),
    ] = False,
    *,
    earth: EarthFieldOptions,
    maker: MakerOptions,
    voice: VoiceOptions,
    viewers: ViewerOptions,
    reading: ReadingOptions,
) -> None:
    """Calibrate a magnetometer by the Earth's field: hard iron, soft iron, mounting.

    The unit is turned by hand through all orientations, away from iron. Held still for 3 s or longer in 15
    to 20 of them, beside an accelerometer, its mounting is found as well.

    Example: tumble magnetometer session.csv --latitude 48.1 --longitude 11.6 -o results

    Writes a calibration file and a page. The exit code is 0 if it was calibrated with its mounting, 3 if
    without, or the model does not fit, 2 if nothing could be done.
    """
    from tumble.calibration.unit_files import prepare_unit_files
    from tumble.logs import open_recording
    from tumble.procedures.magnetometer import summary
    from tumble.procedures.magnetometer.procedure import magnetometer
    from tumble.procedures.magnetometer.viewers import viewer_content

    viewers.check()
    recording = open_recording(log, reading.read(), need_imu=False)
    folder = output or folder_for(log)
    prepare_unit_files(folder, recording.name, "magnetometer")
    with maker.stated():
        result = magnetometer(
            recording,
            field=earth.field,
            field_uncertainty=earth.field_uncertainty,
            latitude=latitude,
            longitude=earth.longitude,
            height=height,
            day=earth.stated_day,
            current=earth.current,
            turned=turned,
            calibration=calibration,
        )
    well = result.verdict == "calibrated"
    files = write_results(result, folder)
    files |= viewers.write(lambda: viewer_content(result, recording), quiet=voice.quiet)
    show_results(summary, result, files, voice, well=well)
    end_unless(well)
