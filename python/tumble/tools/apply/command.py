"""`tumble apply`: a log, a calibration, and out comes the corrected log."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from tumble.cli.live_options import LIVE, SenderOption, ToOption
from tumble.cli.options import Options
from tumble.cli.output import OutputFile, file_named_after
from tumble.cli.read_options import ReadingOptions
from tumble.cli.shared_options import JsonOption, format_option
from tumble.foundation.errors import ProcedureError
from tumble.foundation.words import LIVE_OUTPUTS, count_of


@dataclass(frozen=True, slots=True, kw_only=True)
class ApplyLiveOptions(Options):
    """Options of samples that are corrected while they come."""

    live: Annotated[
        bool,
        typer.Option("--live", help="Correct samples while they come from SOURCE.", rich_help_panel=LIVE),
    ] = False
    to: ToOption = None
    sender: SenderOption = None


def apply_command(
    calibration: Annotated[Path, typer.Argument(metavar="CALIBRATION", help="Calibration file of the unit.")],
    log: Annotated[
        str,
        typer.Argument(
            metavar="LOG", help="Log to correct: LOG, or LOG:NAME for one IMU of several; with --live SOURCE."
        ),
    ],
    output: OutputFile = None,
    format_name: Annotated[
        str | None, format_option("csv|parquet|mcap", "that of its name, or of the log,")
    ] = None,
    force: Annotated[
        bool,
        typer.Option(
            "--force", help="Correct a log of another unit, or one that was corrected already, all the same."
        ),
    ] = False,
    as_json: JsonOption = False,
    *,
    live: ApplyLiveOptions,
    reading: ReadingOptions,
) -> None:
    """Correct a log with a calibration.

    Example: tumble apply results/target_1.yaml drive.bag:/imu/data -o drive.mcap

    Writes time in s, specific force in m/s^2, angular rate in rad/s and, where the log has it, magnetic field
    in uT, freed of the calibrated errors.

    Logs of any length are read and written piece by piece. A log of another unit, by its serial number, or
    one that was corrected already is refused.

    With --live, samples of a source go on at once, corrected, until Ctrl-C:
    tumble apply --live unit.yaml serial:/dev/ttyUSB0 --to udp://10.0.0.2:9000
    """
    read = reading.read()
    if live.live or live.to is not None:
        to = _live_output(live, output, format_name)
        from tumble.tools.apply.command_live import apply_source

        apply_source(calibration, log, to, read, sender=live.sender, force=force, as_json=as_json)
        return
    from tumble.calibration.document import Calibration
    from tumble.cli.progress import sample_progress
    from tumble.logs import open_recording
    from tumble.tools.apply.procedure import apply

    found = Calibration.load(calibration)
    recording = open_recording(log, read)
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


def _live_output(live: ApplyLiveOptions, output: Path | None, format_name: str | None) -> str:
    """Return where live samples go; raises `ProcedureError` where logs and live samples are mixed up."""
    if not live.live:
        raise ProcedureError("--to is where live samples go; give --live SOURCE, or -o OUT with a log")
    if live.to is None:
        raise ProcedureError(f"--live needs --to {LIVE_OUTPUTS} or FILE")
    if output is not None or format_name is not None:
        raise ProcedureError("-o and --format are for logs; with --live give --to FILE")
    return live.to
