"""`tumble multipose --live`: leads from orientation to orientation, then calibrates what was recorded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tumble.cli.durations import seconds_of
from tumble.cli.live_options import LIVE, LiveDurationOption, SenderOption, UntilOption, pose_seconds
from tumble.cli.live_screen import failures_told
from tumble.cli.options import Options, refuse_given
from tumble.cli.results import end_unless, show_results, write_results
from tumble.foundation.errors import ProcedureError

if TYPE_CHECKING:
    from tumble.cli.shared_options import MakerOptions, VoiceOptions
    from tumble.logs.options import ReadOptions
    from tumble.logs.session import SessionProcedure
    from tumble.procedures.multipose.live import LiveMultipose


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiposeLiveOptions(Options):
    """Options that only a live session needs."""

    live: Annotated[
        bool,
        typer.Option(
            "--live",
            help="Calibrate now, led from orientation to orientation; see the documentation for sources.",
            rich_help_panel=LIVE,
        ),
    ] = False
    until: UntilOption = None
    orientations: Annotated[
        int | None,
        typer.Option(
            min=10,
            help="How many to ask for; 18 if not given and there is no --until.",
            rich_help_panel=LIVE,
            show_default=False,
        ),
    ] = None
    held: Annotated[str | None, pose_seconds("4s")] = None
    duration: LiveDurationOption = None
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Go on with the session in the folder.", rich_help_panel=LIVE),
    ] = False
    sender: SenderOption = None

    def refuse_without_live(self) -> None:
        """Raises `ProcedureError` where one of them was typed with a log."""
        typed = {
            "--until": self.until,
            "--orientations": self.orientations,
            "--pose-seconds": self.held,
            "--duration": self.duration,
            "--resume": self.resume,
            "--from": self.sender,
        }
        refuse_given(typed, "is for a unit that is read live; add --live, or leave it out")


def run_live(
    source: str,
    output: Path | None,
    read_options: ReadOptions,
    asked: MultiposeLiveOptions,
    options: Mapping[str, Any],
    maker: MakerOptions,
    voice: VoiceOptions,
    *,
    raw: bool = False,
) -> None:
    """Guides a session, records it, and calibrates it; `options` are those of `multipose`.

    Raises `TumbleError`, in one line, where nothing was calibrated; what was recorded stays.
    """
    from tumble.cli.output import folder_named_after
    from tumble.foundation.file_names import file_stem
    from tumble.foundation.files import no_empty_folder
    from tumble.live import open_source
    from tumble.procedures.multipose import summary
    from tumble.procedures.multipose.live import calibrated, session_procedure

    if raw:
        raise ProcedureError(
            "--raw is for recordings: where the zero of counts is not known, nothing can be said while they "
            "come; record them with tumble record, and give --raw with the session"
        )
    with failures_told(voice.as_json):
        name = file_stem(open_source(source, read_options).name)
        folder = output or folder_named_after(name)
        procedure = session_procedure(asked.until, maker.operator, maker.station, resume=asked.resume)
        with no_empty_folder(folder):
            session, whole = _recorded(source, name, folder, read_options, asked, options, procedure, voice)
        result = calibrated(session, options)
        well = result.verdict == "calibrated" and session.is_reached and whole
        show_results(summary, result, write_results(result, folder), voice, well=well, live=True)
    end_unless(well)


def _recorded(
    source: str,
    name: str,
    folder: Path,
    read_options: ReadOptions,
    asked: MultiposeLiveOptions,
    options: Mapping[str, Any],
    procedure: SessionProcedure,
    voice: VoiceOptions,
) -> tuple[LiveMultipose, bool]:
    """Guides the session; returns it, and whether few samples are missing."""
    from tumble.calibration.unit_files import prepare_unit_files
    from tumble.foundation.ending import stopped_by_signals
    from tumble.foundation.goal import Goal
    from tumble.foundation.units import CALIBRATED_TRIADS, TRIADS
    from tumble.live import open_set
    from tumble.procedures.multipose.command_live_screen import SCREEN
    from tumble.procedures.multipose.guide import HELD
    from tumble.procedures.multipose.live import LiveMultipose
    from tumble.procedures.multipose.procedure import multipose
    from tumble.tools.record.command_screen import is_whole

    triads = CALIBRATED_TRIADS if "magnetometer" in options else TRIADS
    goal = Goal.parse(asked.until, triads) if asked.until else None
    held = HELD if asked.held is None else seconds_of("--pose-seconds", asked.held)
    duration = None if asked.duration is None else seconds_of("--duration", asked.duration)
    units = open_set([f"{name}={source}"], read_options, sender=asked.sender, keep_going=True)
    prepare_unit_files(folder, name, "multipose")
    session = LiveMultipose(
        units,
        folder,
        sources={name: source},
        serial=read_options.serial,
        goal=goal,
        orientations=asked.orientations,
        held=held,
        duration=duration,
        calibrate=partial(multipose, **options),
        magnetometer="magnetometer" in options,
        procedure=procedure,
        resume=asked.resume,
    )
    with stopped_by_signals(session.stop), SCREEN.shown(voice.as_json, voice.quiet) as show:
        for step in session.steps():
            show(step)
    return session, is_whole(units.losses)
