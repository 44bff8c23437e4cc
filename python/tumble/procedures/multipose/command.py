"""`tumble multipose`: reads the log of a unit held in many orientations, writes its calibration and page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from tumble.cli.gravity import GravityOptions
from tumble.cli.options import Options
from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import ReadingOptions
from tumble.cli.results import end_unless, show_results, write_results
from tumble.cli.shared_options import CalibrationOption, MakerOptions, VoiceOptions
from tumble.foundation.errors import ProcedureError
from tumble.procedures.magnetometer.command_options import EarthFieldOptions
from tumble.procedures.multipose.command_live import MultiposeLiveOptions, run_live
from tumble.tools.viewers.command_options import ViewerOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseOptions(Options):
    """Knowledge of the poses, and parameters to be found."""

    raw: Annotated[
        bool,
        typer.Option(
            "--raw", help="Readings are counts of unknown scale, which gravity and the turns then show."
        ),
    ] = False
    g_sensitivity: Annotated[
        bool,
        typer.Option("--g-sensitivity", help="Fit the gyroscope's response to specific force as well."),
    ] = False
    earth_rate: Annotated[
        bool,
        typer.Option(
            "--earth-rate",
            help="Take the upward part of the Earth's rotation off the gyroscope; needs --latitude.",
        ),
    ] = False
    faces: Annotated[
        bool,
        typer.Option("--faces", help="It lay on the six faces of a box, and was turned once round on three."),
    ] = False
    sections: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Labelled stretches, CSV label,start,end or JSON, in samples."),
    ] = None
    pose_means: Annotated[
        bool,
        typer.Option("--pose-means", help="Each row of the log is the mean of a pose, without time."),
    ] = False


def multipose_command(
    log: Annotated[
        str,
        typer.Argument(
            metavar="LOG",
            help="Log of the unit: LOG, or LOG:NAME for one IMU of several; with --live a SOURCE.",
        ),
    ],
    output: OutputFolder = None,
    calibration: CalibrationOption = None,
    magnetometer: Annotated[
        bool,
        typer.Option("--magnetometer", help="Calibrate the magnetometer of the unit at the same rests."),
    ] = False,
    *,
    poses: PoseOptions,
    gravity: GravityOptions,
    earth: EarthFieldOptions,
    live: MultiposeLiveOptions,
    maker: MakerOptions,
    voice: VoiceOptions,
    viewers: ViewerOptions,
    reading: ReadingOptions,
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
    from tumble.calibration.document import Calibration
    from tumble.calibration.unit_files import prepare_unit_files
    from tumble.cli.progress import sample_progress
    from tumble.logs import open_recording
    from tumble.procedures.multipose import summary
    from tumble.procedures.multipose.pose_means import without_time
    from tumble.procedures.multipose.procedure import as_counts, multipose
    from tumble.procedures.multipose.viewers import viewer_content

    read = without_time(reading.read()) if poses.pose_means else reading.read()
    options: dict[str, Any] = {
        **gravity.stated(),
        "g_sensitivity": poses.g_sensitivity,
        "earth_rate": poses.earth_rate,
        "calibration": Calibration.load(calibration) if calibration else None,
    }
    viewers.check()
    if magnetometer:
        options |= {"magnetometer": earth.at(gravity.latitude, gravity.height), "current": earth.current}
    else:
        earth.refuse_without("--magnetometer")
    if live.live:
        viewers.refuse_live()
        if earth.current:
            raise ProcedureError("--current is for recordings: what is read live states no current")
        if poses.faces or poses.sections or poses.pose_means:
            raise ProcedureError(
                "--faces, --sections and --pose-means are for recordings; give them with the session then"
            )
        run_live(log, output, read, live, options, maker, voice, raw=poses.raw)
        return
    live.refuse_without_live()
    if poses.raw and viewers.are_wanted:
        raise ProcedureError(
            "--raw: counts are not shown in SI units; leave out --rerun and --mcap, and type tumble view LOG "
            "with the units that were found"
        )
    folder = output or folder_for(log)
    recording = open_recording(log, as_counts(read) if poses.raw else read)
    prepare_unit_files(folder, recording.name, "multipose")
    with sample_progress("reading", quiet=voice.quiet) as advance:
        result = multipose(
            log,
            **options,
            raw=poses.raw,
            faces=poses.faces,
            sections=poses.sections,
            pose_means=poses.pose_means,
            read=read,
            operator=maker.operator,
            station=maker.station,
            progress=advance,
        )
    well = result.verdict == "calibrated"
    files = write_results(result, folder)
    files |= viewers.write(lambda: viewer_content(result, recording), quiet=voice.quiet)
    show_results(summary, result, files, voice, well=well)
    end_unless(well)
