"""`tumble spin --live`: instructs the robot, shows the progress, writes the calibration file."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from tumble.cli.durations import seconds_of
from tumble.cli.errors import tell_as_event
from tumble.cli.live_options import LIVE, SenderOption
from tumble.cli.options import Options
from tumble.cli.output import output_path
from tumble.cli.results import end_unless, show_results, write_results
from tumble.cli.screen import print_json_line
from tumble.foundation.errors import ProcedureError, TumbleError
from tumble.foundation.translation import translated
from tumble.foundation.words import LISTENING, LIVE_OUTPUTS

if TYPE_CHECKING:
    from rich.console import Console

    from tumble.calibration.document import Calibration
    from tumble.cli.shared_options import VoiceOptions
    from tumble.live import Source
    from tumble.live.outputs import Output
    from tumble.logs.options import ReadOptions
    from tumble.procedures.spin.live import LiveSpin, LiveSpinOptions, SpinStep
    from tumble.procedures.spin.preset import TurnPreset
    from tumble.procedures.spin.result import SpinResult
    from tumble.procedures.spin.turns import TrueTurns

ShowSpin: TypeAlias = "Callable[[SpinStep], None]"
"""Receives every step of the procedure."""

REPLAY = "replay:"
"""Beginning of a source that is a log, and so already recorded."""
BAR_WIDTH = 18
"""Leaves room for the readings on a line of 80 columns."""
HINTS = {
    "none": "",
    "good": "good",
    "too slow": "turn faster",
    "too fast": "turn more slowly",
}
"""Hints on each pace of the turn."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpinLiveOptions(Options):
    """Options that only a live stream has a use for."""

    live: Annotated[
        str | None,
        typer.Option(
            metavar="SOURCE",
            help="Calibrate now, from a live stream; see the documentation for sources.",
            rich_help_panel=LIVE,
            show_default=False,
        ),
    ] = None
    sender: SenderOption = None
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
    ] = None
    no_record: Annotated[
        bool, typer.Option("--no-record", help="Record no samples.", rich_help_panel=LIVE)
    ] = False
    wait: Annotated[
        str | None,
        typer.Option(
            metavar="SECONDS",
            help="How long the robot may take until it stands still, such as 60s.",
            rich_help_panel=LIVE,
            show_default=False,
        ),
    ] = None
    then_apply: Annotated[
        str | None,
        typer.Option(
            metavar="TO",
            help=f"Once calibrated, go on and send corrected samples to {LIVE_OUTPUTS} or FILE.",
            rich_help_panel=LIVE,
            show_default=False,
        ),
    ] = None

    def refuse_with_a_log(self) -> None:
        """Raise `ProcedureError` where one of them was typed with a log."""
        if self.sender is not None:
            raise ProcedureError("--from is who sends a live stream; leave it out with a log")
        if self.record is not None or self.then_apply is not None or self.no_record or self.wait is not None:
            raise ProcedureError(
                "--record, --no-record, --wait and --then-apply are for a live stream; leave them out with a "
                "log"
            )


def run_live(
    output: Path | None,
    read_options: ReadOptions,
    asked: SpinLiveOptions,
    voice: VoiceOptions,
    *,
    still: float | None,
    preset: TurnPreset,
    level_floor: bool,
    true_turns: TrueTurns | None,
    gravity: float | None,
    latitude: float | None,
    height: float | None,
    gravity_uncertainty: float | None,
    calibration: Calibration | None,
) -> None:
    """Calibrate from a live stream into `<name>.live.yaml`; `tumble.live` lists the sources.

    `still` is in s; it and what `preset` leaves open stand at the core's defaults. `latitude` is in deg,
    `height` in m, `gravity_uncertainty` in m/s^2; `calibration` is applied first. All samples are recorded
    into the folder of `--record`, or beside the results unless they come from a log, or not to be kept.
    Once the calibration is found, samples go on corrected, to the destination of `asked`. With `--json` every
    event is a line on standard output, and nothing else is.
    """
    from tumble.calibration.unit_files import prepare_unit_files
    from tumble.cli.output import folder_named_after
    from tumble.foundation.files import no_empty_folder
    from tumble.live import open_source
    from tumble.live.outputs import parse_output
    from tumble.live.resumable_source import ResumableSource
    from tumble.procedures.spin.live import LiveSpin, LiveSpinOptions
    from tumble.procedures.spin.settings import DEFAULT, DEFAULT_TURNS
    from tumble.tools.record.recorded_source import recorded_source
    from tumble.tools.record.session_folders import next_session_folder

    if true_turns is not None:
        raise ProcedureError(
            "--true-turns counts from rest to rest, and a live spin is done while the robot still turns; "
            "record a log and give it instead of --live"
        )
    turn = preset.completed(DEFAULT.rate, DEFAULT_TURNS)
    options = LiveSpinOptions(
        still=still or DEFAULT.still,
        turns=turn.turns or DEFAULT_TURNS,
        rate=turn.rate or DEFAULT.rate,
        duration=preset.duration,
        wait=None if asked.wait is None else seconds_of("--wait", asked.wait),
        level_floor=level_floor,
        gravity=gravity,
        latitude=latitude,
        height=height,
        gravity_uncertainty=gravity_uncertainty,
    )
    source = asked.live or ""
    stream = open_source(source, read_options, sender=asked.sender)
    folder = output or folder_named_after(stream.name)
    going_on = None if asked.then_apply is None else parse_output(asked.then_apply, as_json=voice.as_json)
    serial = read_options.serial or getattr(stream, "serial", "")
    kept = not (asked.no_record or source.startswith(REPLAY))
    session = asked.record or (next_session_folder(folder) if kept else None)
    recorded = recorded_source(ResumableSource(stream), session, typed=source, serial=serial)
    with no_empty_folder(folder), recorded as samples, samples:
        prepare_unit_files(folder, stream.name, "live")
        live = LiveSpin(
            samples,
            options,
            typed=source,
            serial=serial,
            calibration=calibration,
            reading=read_options.reading,
        )
        _run(live, source, options, voice, session)
        result = live.result()
        well = result.verdict == "calibrated"
        _tell(result, folder, samples, going_on, voice, serial=serial)
    end_unless(well)


def _tell(
    result: SpinResult,
    folder: Path,
    samples: Source,
    going_on: Output | None,
    voice: VoiceOptions,
    *,
    serial: str,
) -> None:
    """Write and show the result, and then go on with samples, corrected, where they are to go anywhere."""
    from tumble.live.outputs import STDOUT
    from tumble.procedures.spin import summary
    from tumble.tools.apply.command_live import correct

    all_found = result.accelerometer_bias.observable and result.gyroscope_bias.observable
    well = result.verdict == "calibrated"
    with _written(result, folder, meanwhile=going_on is not None and all_found) as files:
        # Where samples go to standard output, no text does.
        beside = going_on is not None and going_on.name == STDOUT and not voice.as_json
        with redirect_stdout(sys.stderr if beside else sys.stdout):
            show_results(summary, result, files, voice, well=well, live=True)
        if going_on is not None and all_found:
            # The stream the calibration was found on is the one it is for.
            correct(result.calibration, samples, going_on, serial=serial, force=True)


@contextmanager
def _written(result: SpinResult, folder: Path, *, meanwhile: bool) -> Iterator[dict[str, Path]]:
    """Have the files written: at once, or the page while the block runs."""
    from tumble.procedures.spin.command_files import page_written_meanwhile

    if not meanwhile:
        yield write_results(result, folder)
        return
    with page_written_meanwhile(result, folder) as files:
        yield files


def _run(
    live: LiveSpin, source: str, options: LiveSpinOptions, voice: VoiceOptions, session: Path | None
) -> None:
    """Go through the procedure and show it."""
    try:
        with _shown(source, options, voice) as show:
            for step in live.steps():
                show(step)
    except TumbleError as error:
        if voice.as_json:
            tell_as_event(error, **({} if session is None else {"recorded": str(session)}))
        _print_prompt("" if session is None else f"What was received is in {session}.")
        raise
    except KeyboardInterrupt:
        kept = "nothing was written" if session is None else f"what was received is in {session}"
        print(f"tumble: interrupted; {kept}", file=sys.stderr)
        raise


@contextmanager
def _shown(source: str, options: LiveSpinOptions, voice: VoiceOptions) -> Iterator[ShowSpin]:
    """Give what shows each step: lines of JSON, bars on a terminal, or a line for what matters."""
    from tumble.cli.screen import message_console

    console = message_console()
    if voice.as_json:
        yield _print_json
    elif voice.quiet:
        yield lambda _: None
    elif console.is_terminal:
        with _bars(console, source, options) as show:
            yield show
    else:
        yield lambda step: _print_prompt(_prompt(step, source, options))


def _print_json(step: SpinStep) -> None:
    figures = {"event": step.kind, "time": step.time, "state": step.state, **step.progress, "pace": step.pace}
    print_json_line(figures)


def _print_prompt(text: str) -> None:
    if text:
        print(translated(text), file=sys.stderr, flush=True)


def _prompt(step: SpinStep, source: str, options: LiveSpinOptions) -> str:
    """Describes the next motion of the robot; empty where it is to go on."""
    still = f"stand still for {options.still:g} s"
    if step.kind == LISTENING:
        return f"Listening to {source}. Let the robot {still}."
    if step.kind == "turning first":
        return f"It turns before it stood still. Stop it, and let it {still}."
    if step.kind == "still broken":
        return f"It moved. Let it {still}, from the beginning."
    if step.kind == "still done":
        turns = "1 turn" if options.turns == 1.0 else f"{options.turns:.4g} turns"
        return (
            f"Now turn on the spot, either way, at about {options.rate:.3g} rad/s "
            f"({math.degrees(options.rate):.0f} deg/s), {turns}."
        )
    return "Done." if step.kind == "done" else ""


@contextmanager
def _bars(console: Console, source: str, options: LiveSpinOptions) -> Iterator[ShowSpin]:
    """Show a bar for standing and one for turning, with the rate of turn and how it pleases."""
    from rich.progress import BarColumn, Progress, TextColumn

    columns = (
        TextColumn("{task.description:12}"),
        BarColumn(BAR_WIDTH),
        TextColumn("{task.fields[reading]}"),
    )
    with Progress(*columns, console=console, auto_refresh=False) as bars:
        standing = bars.add_task("stand still", total=options.still, reading="")
        turning = bars.add_task("turn", total=None, reading="", visible=False)

        def show(step: SpinStep) -> None:
            progress = step.progress
            if text := _prompt(step, source, options):
                console.print(text, highlight=False)
            bars.update(
                standing,
                completed=progress["still"],
                total=progress["still_wanted"],
                reading=f"{progress['still']:.1f} of {progress['still_wanted']:g} s",
            )
            bars.update(
                turning,
                completed=progress["turned"],
                total=progress["turned_wanted"],
                reading=_turn_reading(step),
                visible=step.state != "still",
            )
            bars.refresh()

        yield show


def _turn_reading(step: SpinStep) -> str:
    """Angle turned, rate, and whether to turn faster or more slowly."""
    progress = step.progress
    turned = f"{math.degrees(progress['turned']):.0f}"
    wanted = f"{math.degrees(progress['turned_wanted']):.0f}"
    hint = "stands still: turn now" if progress["at_rest"] else HINTS[step.pace]
    rate = f"{progress['rate']:+.2f} rad/s"
    return ", ".join(filter(None, (f"{turned} of {wanted} deg", rate, hint)))
