"""`tumble spin`: reads the log of a robot that turned on the spot, writes its calibration file and report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.durations import seconds_of
from tumble.cli.gravity import GravityOptions
from tumble.cli.options import Options
from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import ReadingOptions
from tumble.cli.results import end_unless, show_results, write_results
from tumble.cli.shared_options import CalibrationOption, LongVoiceOptions, MakerOptions
from tumble.foundation.errors import ProcedureError
from tumble.procedures.spin.command_live import SpinLiveOptions, run_live
from tumble.tools.viewers.command_options import ViewerOptions

if TYPE_CHECKING:
    from tumble.procedures.spin.preset import TurnPreset
    from tumble.procedures.spin.turns import TrueTurns


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnOptions(Options):
    """Motion that the robot was, or is, to make."""

    still: Annotated[
        str | None,
        typer.Option(
            metavar="SECONDS",
            help="Least length of the longest rest of a spin, such as 5s; 2 s if not given. "
            "With --live: how long to stand still, 5 s if not given.",
            show_default=False,
        ),
    ] = None
    turns: Annotated[
        float | None,
        typer.Option(
            min=0.1,
            help="Turns asked of the robot, both directions added: a spin with fewer is refused. "
            "With --live: how much to turn, 2 if not given.",
            show_default=False,
        ),
    ] = None
    turn_rate: Annotated[
        float | None,
        typer.Option(
            min=0.05,
            metavar="RAD/S",
            help="How fast it is to turn: a spin that departs from it by a tenth is said. "
            "With --live: 1 rad/s if not given.",
            show_default=False,
        ),
    ] = None
    spin_duration: Annotated[
        str | None,
        typer.Option(
            metavar="SECONDS",
            help="How long it is to turn, such as 20s, without rests between: a spin that departs from it by "
            "a tenth is said. With --live it gives the turns, or with --turns the rate.",
            show_default=False,
        ),
    ] = None

    def preset(self) -> TurnPreset:
        """Give the turn; raises `ProcedureError` where the options contradict each other."""
        from tumble.procedures.spin.preset import TurnPreset

        duration = None if self.spin_duration is None else seconds_of("--spin-duration", self.spin_duration)
        return TurnPreset(duration, self.turn_rate, self.turns)

    def still_seconds(self) -> float | None:
        """Give the rest, s, if one was typed."""
        return None if self.still is None else seconds_of("--still", self.still)


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownOptions(Options):
    """Knowledge of turns and floor, and times of the spins in a log."""

    true_turns: Annotated[
        str | None,
        typer.Option(
            metavar="N|+N,-N",
            help="Turns that each spin truly made, from dock to dock: +3 counter-clockwise, -3 clockwise, "
            "+3,-3 "
            "both, 3 in whichever direction it turned. Shows the scale of the gyroscope.",
        ),
    ] = None
    true_turns_sigma: Annotated[
        float, typer.Option(metavar="DEG", min=0.0, help="1-sigma of the true angle in one direction.")
    ] = 2.0
    level_floor: Annotated[
        bool,
        typer.Option("--level-floor", help="Assume that the floor is level, as the published method does."),
    ] = False
    as_published: Annotated[
        bool,
        typer.Option("--as-published", help="As the literature has it: the same as --level-floor."),
    ] = False
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="START:END",
            help="A spin with its rests lies between these times, s from the start of the log; repeatable.",
        ),
    ] = None

    def turned(self) -> TrueTurns | None:
        """Give the true turns, if they are known."""
        from tumble.procedures.spin.turns import TrueTurns

        return None if self.true_turns is None else TrueTurns.parse(self.true_turns, self.true_turns_sigma)

    def floor_is_level(self) -> bool:
        """Return whether the published method is asked for."""
        return self.level_floor or self.as_published


def spin_command(
    log: Annotated[
        str | None,
        typer.Argument(metavar="LOG", help="Log of the robot: LOG, or LOG:NAME for one IMU of several."),
    ] = None,
    output: OutputFolder = None,
    calibration: CalibrationOption = None,
    *,
    turn: TurnOptions,
    known: KnownOptions,
    gravity: GravityOptions,
    live: SpinLiveOptions,
    maker: MakerOptions,
    voice: LongVoiceOptions,
    viewers: ViewerOptions,
    reading: ReadingOptions,
) -> None:
    """Find the biases of a robot's IMU from a turn on the spot.

    The robot stands still for some seconds, then turns on the spot, once round or more.

    Example: tumble spin drive.bag:/imu/data -o results

    Finds rest and spin in the log by itself, also several spins with driving between. Writes a calibration
    file and a page. The exit code is 0 if both biases were found, 3 if one of them was not or a spin named
    with --at cannot be used, 2 if nothing could be done.
    """
    place = gravity.stated()
    read = reading.read()
    if (log is None) == (live.live is None):
        raise ProcedureError("give either a log or --live SOURCE")
    if live.live is not None and known.at:
        raise ProcedureError("--at is a time of a log; leave it out with --live")
    viewers.check()
    if log is not None:
        live.refuse_with_a_log()
    else:
        viewers.refuse_live()
    from tumble.calibration.document import Calibration

    still, preset, true_turns = turn.still_seconds(), turn.preset(), known.turned()
    before = Calibration.load(calibration) if calibration else None
    if log is None:
        with maker.stated():
            run_live(
                output,
                read,
                live,
                voice,
                still=still,
                preset=preset,
                level_floor=known.floor_is_level(),
                true_turns=true_turns,
                calibration=before,
                **place,
            )
        return
    from tumble.calibration.unit_files import prepare_unit_files
    from tumble.cli.progress import sample_progress
    from tumble.logs import open_recording
    from tumble.procedures.spin import summary
    from tumble.procedures.spin.procedure import SHORTEST_STILL, spin
    from tumble.procedures.spin.viewers import viewer_content

    spans = [_span(text) for text in known.at or ()]
    recording = open_recording(log, read)
    folder = output or folder_for(log)
    prepare_unit_files(folder, recording.name, "spin")
    with maker.stated(), sample_progress("reading", quiet=voice.quiet) as advance:
        result = spin(
            recording,
            still=SHORTEST_STILL if still is None else still,
            duration=preset.duration,
            rate=preset.rate,
            turns=preset.turns,
            true_turns=true_turns,
            level_floor=known.floor_is_level(),
            at=spans,
            calibration=before,
            progress=advance,
            **place,
        )
    well = result.verdict == "calibrated" and not (spans and result.refused)
    draw = summary.long_summary if voice.verbose else summary.screen_summary
    files = write_results(result, folder)
    files |= viewers.write(lambda: viewer_content(result, recording), quiet=voice.quiet)
    show_results(summary, result, files, voice, well=well, draw=draw)
    end_unless(well)


def _span(text: str) -> tuple[float, float]:
    start, _, end = text.partition(":")
    try:
        return float(start), float(end)
    except ValueError:
        raise ProcedureError(
            f"--at {text}: give START:END in s from the start of the log, such as 12.5:60"
        ) from None
