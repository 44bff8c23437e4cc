"""`tumble multipose`: reads the log of a unit held in many orientations, writes its calibration and page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from tumble.cli.gravity import GravityOption, HeightOption, LatitudeOption, check_gravity
from tumble.cli.json_option import JsonOption
from tumble.cli.live_options import LIVE, SenderOption, UntilOption, pose_seconds
from tumble.cli.maker_options import OperatorOption, StationOption
from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import with_read_options
from tumble.cli.results import end_unless, show_results
from tumble.cli.start import StartOption
from tumble.foundation.errors import ProcedureError
from tumble.logs.options import ReadOptions
from tumble.procedures.multipose.command_live import LiveOptions, run_live


@with_read_options
def multipose_command(
    read_options: ReadOptions,
    log: Annotated[
        str,
        typer.Argument(
            metavar="LOG",
            help="Log of the unit: LOG, or LOG:NAME for one IMU of several; with --live a SOURCE.",
        ),
    ],
    output: OutputFolder = None,
    start: StartOption = None,
    live: Annotated[
        bool,
        typer.Option(
            "--live",
            help="Calibrate now, led from orientation to orientation; see the documentation for sources.",
            rich_help_panel=LIVE,
        ),
    ] = False,
    until: UntilOption = None,
    orientations: Annotated[
        int | None,
        typer.Option(
            min=10,
            help="How many to ask for; 18 if not given and there is no --until.",
            rich_help_panel=LIVE,
            show_default=False,
        ),
    ] = None,
    held: Annotated[str | None, pose_seconds("4s")] = None,
    duration: Annotated[
        str | None,
        typer.Option(
            metavar="TIME",
            help="End after this time at the latest, such as 10min.",
            rich_help_panel=LIVE,
            show_default=False,
        ),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Go on with the session in the folder.", rich_help_panel=LIVE),
    ] = False,
    sender: SenderOption = None,
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
    faces: Annotated[
        bool,
        typer.Option("--faces", help="It lay on the six faces of a box, and was turned once round on three."),
    ] = False,
    sections: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Labelled stretches, CSV label,start,end or JSON, in samples."),
    ] = None,
    latitude: LatitudeOption = None,
    height: HeightOption = None,
    gravity: GravityOption = None,
    operator: OperatorOption = "",
    station: StationOption = "",
    as_json: JsonOption = False,
) -> None:
    """Calibrate an IMU that was held still in many orientations, without equipment.

    The unit is held or laid down still for 3 s or longer in 15 to 20 orientations, all different, and turned
    by hand in between, in one log.

    Example: tumble multipose session.csv -o results

    Live: tumble multipose --live serial:/dev/ttyUSB0?baud=921600 --until "bias 0.003" -o results

    Finds the rests in the log by itself. Writes a calibration file and a page. The exit code is 0 if both
    sensors were calibrated, 3 if only the accelerometer was, the model does not fit or a goal was not
    reached, 2 if nothing could be done.
    """
    check_gravity(latitude, height, gravity)
    from tumble.calibration.document import Calibration
    from tumble.calibration.unit_files import prepare_unit_files
    from tumble.cli.progress import sample_progress
    from tumble.logs import open_recording
    from tumble.procedures.multipose import summary
    from tumble.procedures.multipose.procedure import as_counts, multipose

    asked = LiveOptions(until, orientations, held, duration, resume, sender)
    if live:
        if faces or sections:
            raise ProcedureError("--faces and --sections are for recordings; give them with the session then")
        options: dict[str, Any] = {
            "gravity": gravity,
            "latitude": latitude,
            "height": height,
            "g_sensitivity": g_sensitivity,
            "earth_rate": earth_rate,
            "start": Calibration.load(start) if start else None,
        }
        run_live(log, output, read_options, asked, options, operator, station, raw=raw, as_json=as_json)
        return
    asked.refuse_without_live()
    folder = output or folder_for(log)
    name = open_recording(log, as_counts(read_options) if raw else read_options).name
    prepare_unit_files(folder, name, "multipose")
    with sample_progress("reading") as advance:
        result = multipose(
            log,
            gravity=gravity,
            latitude=latitude,
            height=height,
            g_sensitivity=g_sensitivity,
            earth_rate=earth_rate,
            raw=raw,
            start=start,
            faces=faces,
            sections=sections,
            read=read_options,
            operator=operator,
            station=station,
            progress=advance,
        )
    show_results(summary, result, result.save(folder), as_json)
    end_unless(result.verdict == "calibrated")
