"""`tumble turntable --live`: leads through the poses, and leaves the session to be calibrated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tumble.cli.durations import seconds_of
from tumble.cli.errors import print_notice
from tumble.cli.live_options import LIVE, SenderOption, UntilOption, pose_seconds
from tumble.cli.options import Options, refuse_given
from tumble.cli.read_options import read_options_for
from tumble.foundation.errors import ProcedureError
from tumble.foundation.words import join
from tumble.logs.options import ReadOptions

if TYPE_CHECKING:
    from tumble.cli.shared_options import MakerOptions, VoiceOptions
    from tumble.logs.session import SessionProcedure
    from tumble.poses.pose_list import PoseList
    from tumble.procedures.turntable.live import LiveTurntable
    from tumble.procedures.turntable.so_far import OpenSession


def _option(*names: str, metavar: str = "", text: str) -> Any:  # noqa: ANN401 - what typer makes of an option
    return typer.Option(*names, metavar=metavar or None, help=text, rich_help_panel=LIVE, show_default=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class TurntableLiveOptions(Options):
    """Options that only a live session needs."""

    live: Annotated[
        bool,
        _option(
            "--live",
            text="Calibrate now: NAME=SOURCE for each unit takes the place of recordings; see the "
            "documentation.",
        ),
    ] = False
    until: UntilOption = None
    pose_seconds: Annotated[str | None, pose_seconds("10s")] = None
    no_turns: Annotated[
        bool, _option("--no-turns", text="Ask for no turns: the gyroscopes get what poses show of them.")
    ] = False
    table: Annotated[
        str | None,
        _option(
            "--table",
            metavar="DRIVER[:ADDRESS]",
            text="Have a rate table go through poses and turns by itself; see tumble table list.",
        ),
    ] = None
    table_limits: Annotated[
        str,
        _option(
            "--table-limits",
            metavar="[AXIS.]KEY=VALUE,...",
            text="Limits of the table on top of the maker's, in deg: rate=30, acceleration=20, "
            "outer.angle=-90..90.",
        ),
    ] = ""
    armed: Annotated[
        bool, _option("--armed", text="Let the table move. Without it, its plan is printed.")
    ] = False
    sender: SenderOption = None

    def refuse_without_live(self) -> None:
        """Raises `ProcedureError` where one of them was typed with recordings."""
        typed = {
            "--until": self.until,
            "--pose-seconds": self.pose_seconds,
            "--no-turns": self.no_turns,
            "--table": self.table,
            "--table-limits": self.table_limits,
            "--armed": self.armed,
            "--from": self.sender,
        }
        refuse_given(typed, "is for units that are read live; add --live, or leave it out")


@dataclass(frozen=True, slots=True)
class RecordedSession:
    """Recording of a live session that is to be calibrated."""

    folder: Path
    is_all: bool
    """Indicates whether all poses, all turns and the goal were reached, and few samples are missing."""
    not_shown: tuple[str, ...]
    """Poses of which nothing is there."""


def record_live(
    words: Sequence[str],
    folder: Path,
    live: TurntableLiveOptions,
    *,
    reference: str | None,
    poses: PoseList | None,
    read: ReadOptions,
    exceptions: Sequence[str],
    open_reference: OpenSession,
    maker: MakerOptions,
    resume: bool,
    voice: VoiceOptions,
) -> RecordedSession | None:
    """Guides the session and records it; None where only the plan was asked for.

    Raises `TumbleError`, in one line, where that cannot be done, and `end_of` a signal that would end the
    program, `KeyboardInterrupt` for Ctrl-C; what was recorded stays.
    """
    from tumble.foundation.ending import end_of, stopped_by_signals
    from tumble.foundation.file_names import SESSION_FOLDER
    from tumble.foundation.goal import Goal
    from tumble.live import open_set
    from tumble.live.naming import parse_named_sources
    from tumble.poses.pose_list import SIX_FACES
    from tumble.procedures.turntable.command_live_screen import SCREEN
    from tumble.procedures.turntable.live import POSE_SECONDS, REFERENCE, LiveTurntable
    from tumble.procedures.turntable.session_poses import poses_of
    from tumble.procedures.turntable.table_plan import turned_table
    from tumble.tools.record.command_screen import is_whole

    typed = {name: address.text for name, address in parse_named_sources(words).items()}
    goal = Goal.parse(live.until) if live.until else None
    seconds = POSE_SECONDS if live.pose_seconds is None else seconds_of("--pose-seconds", live.pose_seconds)
    if resume and poses is None:
        poses = poses_of(folder / SESSION_FOLDER)
    table = (
        turned_table(live.table, live.table_limits, seconds, poses, not live.no_turns) if live.table else None
    )
    if table is not None:
        _say(table.lines())
        if not live.armed:
            _say(["nothing moved, as it is not --armed"])
            return None
    elif live.armed:
        raise ProcedureError("--armed lets a table move; name it with --table, or leave --armed out")
    options = read_options_for(read, exceptions, list(typed))
    units = open_set(words, options, sender=live.sender, keep_going=True)
    with table.entered() if table is not None else nullcontext(None) as driver:
        session = LiveTurntable(
            units,
            folder,
            sources=typed,
            serials={name: each.serial for name, each in options.items()},
            reference=reference or REFERENCE,
            poses=table.poses if table is not None else poses or SIX_FACES,
            pose_seconds=seconds,
            turns=not live.no_turns and (table is None or bool(table.by_hand)),
            goal=goal,
            open_reference=open_reference,
            driver=driver,
            procedure=_procedure(live, seconds, maker, resume=resume),
            resume=resume,
        )
        stopping = stopped_by_signals(session.stop)
        with stopping as heard, SCREEN.shown(voice.as_json, voice.quiet) as show:
            for step in session.steps():
                show(step)
    if session.was_stopped:
        _say_how_to_go_on(session)
        raise end_of(heard[0])
    _refuse_if_unheard(session, reference or REFERENCE, typed)
    reached = session.is_complete and session.goal_is_met
    return RecordedSession(session.session, is_whole(units.losses) and reached, session.not_shown)


def _procedure(
    live: TurntableLiveOptions, seconds: float, maker: MakerOptions, *, resume: bool
) -> SessionProcedure:
    from tumble.logs.session import SessionProcedure

    said: Mapping[str, str | None] = {"goal": live.until, "table": live.table}
    return SessionProcedure(
        name="turntable",
        operator=maker.operator,
        station=maker.station,
        options={
            "pose-seconds": seconds,
            **{name: value for name, value in said.items() if value},
            **({"resumed": True} if resume else {}),
        },
    )


def _refuse_if_unheard(session: LiveTurntable, reference: str, names: Iterable[str]) -> None:
    silent = [name for name in names if name not in session.heard]
    if reference in silent or not session.heard - {reference}:
        raise ProcedureError(
            f"there is nothing to calibrate, as no sample came of {join(silent)}; check power, cables and "
            "addresses, and go on with --resume"
        )


def _say_how_to_go_on(session: LiveTurntable) -> None:
    _say(
        [
            f"interrupted; what was recorded is in {session.session}: go on with the same command and "
            f"--resume, or calibrate what there is with tumble turntable {session.session}",
            *filter(None, [session.missed]),
        ]
    )


def _say(lines: Iterable[str]) -> None:
    for line in lines:
        print_notice(line)
