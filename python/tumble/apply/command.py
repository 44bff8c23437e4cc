"""`tumble apply`: a log, a calibration, and out comes the corrected log."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from tumble.cli.output import file_named_after, output_path
from tumble.cli.read_options import with_read_options
from tumble.logs.options import ReadOptions
from tumble.words import count_of


@with_read_options
def apply_command(
    calibration: Annotated[Path, typer.Argument(metavar="CALIBRATION", help="Calibration file of the unit.")],
    log: Annotated[
        str, typer.Argument(metavar="LOG", help="Log to correct: LOG, or LOG:NAME for one IMU of several.")
    ],
    read_options: ReadOptions,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="OUT",
            parser=output_path,
            help="Corrected log to write; ./NAME-tumble, in the format of the log, if not given.",
            show_default=False,
        ),
    ] = None,
    format_name: Annotated[
        str | None,
        typer.Option("--format", metavar="csv|parquet|mcap", help="Format, if not that of OUT's name."),
    ] = None,
    force: Annotated[
        bool,
        typer.Option(
            "--force", help="Correct a log of another unit, or one that was corrected already, all the same."
        ),
    ] = False,
) -> None:
    """Correct a log with a calibration.

    Example: tumble apply results/target_1.yaml drive.bag:/imu/data -o drive.mcap

    Writes time in s, specific force in m/s^2 and angular rate in rad/s, freed of the calibrated errors.

    Logs of any length are read and written piece by piece. A log of another unit, by its serial number, or
    one that was corrected already is refused.
    """
    from tumble.apply.procedure import apply
    from tumble.calibration.document import Calibration
    from tumble.cli.progress import sample_progress
    from tumble.logs import open_recording

    found = Calibration.load(calibration)
    recording = open_recording(log, read_options)
    with sample_progress("correcting") as advance:
        applied = apply(
            found,
            recording,
            output or file_named_after(recording.name, format_name or recording.metadata.format),
            format_name=format_name,
            force=force,
            progress=advance,
        )
    for warning in applied.warnings:
        print(f"tumble: warning: {warning}", file=sys.stderr)
    print(f"{count_of('sample', applied.samples)} corrected: {applied.path}")
