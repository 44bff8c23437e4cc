"""`tumble spin`: reads the log of a robot that turned on the spot, writes its calibration file and report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.durations import seconds_of
from tumble.cli.gravity import GravityOption, HeightOption, LatitudeOption, check_gravity
from tumble.cli.json_option import JsonOption
from tumble.cli.live_options import LIVE, SenderOption
from tumble.cli.maker_options import with_maker
from tumble.cli.output import OutputFolder, folder_for, output_path
from tumble.cli.read_options import with_read_options
from tumble.cli.results import end_unless, show_results
from tumble.foundation.errors import ProcedureError
from tumble.logs.options import ReadOptions

if TYPE_CHECKING:
    from tumble.procedures.spin.turns import TrueTurns


@with_maker
@with_read_options
def spin_command(
    read_options: ReadOptions,
    log: Annotated[
        str | None,
        typer.Argument(metavar="LOG", help="Log of the robot: LOG, or LOG:NAME for one IMU of several."),
    ] = None,
    output: OutputFolder = None,
    live: Annotated[
        str | None,
        typer.Option(
            metavar="SOURCE", help="Calibrate now, from a live stream; see the documentation for sources."
        ),
    ] = None,
    still: Annotated[
        str | None,
        typer.Option(
            metavar="SECONDS",
            help="Least length of the longest rest of a spin, such as 5s; 2 s if not given. "
            "With --live: how long to stand still, 5 s if not given.",
            show_default=False,
        ),
    ] = None,
    turns: Annotated[
        float | None,
        typer.Option(
            min=0.1,
            help="Turns asked of the robot, both directions added: a spin with fewer is refused. "
            "With --live: how much to turn, 2 if not given.",
            show_default=False,
        ),
    ] = None,
    true_turns: Annotated[
        str | None,
        typer.Option(
            metavar="N|+N,-N",
            help="Turns that each spin truly made, from dock to dock: +3 counter-clockwise, -3 clockwise, "
            "+3,-3 "
            "both, 3 in whichever direction it turned. Shows the scale of the gyroscope.",
        ),
    ] = None,
    true_turns_sigma: Annotated[
        float, typer.Option(metavar="DEG", min=0.0, help="1-sigma of the true angle in one direction.")
    ] = 2.0,
    level_floor: Annotated[
        bool,
        typer.Option("--level-floor", help="Assume that the floor is level, as the published method does."),
    ] = False,
    as_published: Annotated[
        bool,
        typer.Option("--as-published", help="As the literature has it: the same as --level-floor."),
    ] = False,
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="START:END",
            help="A spin with its rests lies between these times, s from the start of the log; repeatable.",
        ),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Calibration to apply first; its matrices are kept in the new one."
        ),
    ] = None,
    latitude: LatitudeOption = None,
    height: HeightOption = None,
    gravity: GravityOption = None,
    turn_rate: Annotated[
        float | None,
        typer.Option(
            min=0.05,
            metavar="RAD/S",
            help="How fast it is to turn: a spin that departs from it by a tenth is said. "
            "With --live: 1 rad/s if not given.",
            show_default=False,
        ),
    ] = None,
    spin_duration: Annotated[
        str | None,
        typer.Option(
            metavar="SECONDS",
            help="How long it is to turn, such as 20s, without rests between: a spin that departs from it by "
            "a tenth is said. With --live it gives the turns, or with --turns the rate.",
            show_default=False,
        ),
    ] = None,
    sender: SenderOption = None,
    record: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            parser=output_path,
            help="Record all samples into this session folder, as tumble record does, in place of session in "
            "the folder of the results.",
            rich_help_panel=LIVE,
            show_default=False,
        ),
    ] = None,
    no_record: Annotated[
        bool, typer.Option("--no-record", help="Record no samples.", rich_help_panel=LIVE)
    ] = False,
    wait: Annotated[
        str | None,
        typer.Option(
            metavar="SECONDS",
            help="How long the robot may take until it stands still, such as 60s.",
            rich_help_panel=LIVE,
            show_default=False,
        ),
    ] = None,
    then_apply: Annotated[
        str | None,
        typer.Option(
            metavar="TO",
            help="Once calibrated, go on and send corrected samples to stdout, udp://HOST:PORT, "
            "mavlink:udpout:HOST:PORT or FILE.",
            rich_help_panel=LIVE,
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find the biases of a robot's IMU from a turn on the spot.

    The robot stands still for some seconds, then turns on the spot, once round or more.

    Example: tumble spin drive.bag:/imu/data -o results

    Finds rest and spin in the log by itself, also several spins with driving between. Writes a calibration
    file and a page. The exit code is 0 if both biases were found, 3 if one of them was not or a spin named
    with --at cannot be used, 2 if nothing could be done.
    """
    check_gravity(latitude, height, gravity)
    level_floor = level_floor or as_published
    _check_source(log, live, at, sender)
    seconds = None if still is None else seconds_of("--still", still)
    duration = None if spin_duration is None else seconds_of("--spin-duration", spin_duration)
    known = _true_turns(true_turns, true_turns_sigma)
    from tumble.calibration.document import Calibration
    from tumble.procedures.spin.preset import TurnPreset

    preset = TurnPreset(duration, turn_rate, turns)
    before = Calibration.load(calibration) if calibration else None
    if live is not None:
        from tumble.procedures.spin.command_live import run_live

        run_live(
            live,
            output,
            read_options,
            still=seconds,
            preset=preset,
            sender=sender,
            level_floor=level_floor,
            gravity=gravity,
            latitude=latitude,
            height=height,
            true_turns=known,
            calibration=before,
            record=record,
            keep=not no_record,
            wait=None if wait is None else seconds_of("--wait", wait),
            then_apply=then_apply,
            as_json=as_json,
        )
        return
    if record is not None or then_apply is not None or no_record or wait is not None:
        raise ProcedureError(
            "--record, --no-record, --wait and --then-apply are for a live stream; leave them out with a log"
        )
    assert log is not None
    from tumble.calibration.unit_files import prepare_unit_files
    from tumble.cli.progress import sample_progress
    from tumble.logs import open_recording
    from tumble.procedures.spin import summary
    from tumble.procedures.spin.procedure import SHORTEST_STILL, spin

    spans = [_span(text) for text in at or ()]
    recording = open_recording(log, read_options)
    folder = output or folder_for(log)
    prepare_unit_files(folder, recording.name, "spin")
    with sample_progress("reading") as advance:
        result = spin(
            recording,
            still=SHORTEST_STILL if seconds is None else seconds,
            duration=preset.duration,
            rate=preset.rate,
            turns=preset.turns,
            true_turns=known,
            level_floor=level_floor,
            at=spans,
            gravity=gravity,
            latitude=latitude,
            height=height,
            calibration=before,
            progress=advance,
        )
    show_results(summary, result, result.save(folder), as_json)
    end_unless(result.verdict == "calibrated" and not (spans and result.refused))


def _check_source(log: str | None, live: str | None, at: list[str] | None, sender: str | None) -> None:
    if (log is None) == (live is None):
        raise ProcedureError("give either a log or --live SOURCE")
    if log is not None and sender is not None:
        raise ProcedureError("--from is who sends a live stream; leave it out with a log")
    if live is not None and at:
        raise ProcedureError("--at is a time of a log; leave it out with --live")


def _span(text: str) -> tuple[float, float]:
    start, _, end = text.partition(":")
    try:
        return float(start), float(end)
    except ValueError:
        raise ProcedureError(
            f"--at {text}: give START:END in s from the start of the log, such as 12.5:60"
        ) from None


def _true_turns(text: str | None, sigma: float) -> TrueTurns | None:
    from tumble.procedures.spin.turns import TrueTurns

    return None if text is None else TrueTurns.parse(text, sigma)
