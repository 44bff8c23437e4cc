"""`tumble record`: several live sources at once, into one session folder."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.durations import seconds_of
from tumble.cli.exit_code import ExitCode
from tumble.cli.live_options import AlwaysLiveSenderOption
from tumble.cli.output import OutputFolder
from tumble.cli.read_options import ReadingOptionsOfSeveral
from tumble.cli.shared_options import JsonOption
from tumble.foundation.ending import stopped_by_signals
from tumble.foundation.errors import ProcedureError
from tumble.foundation.words import count_of, join

if TYPE_CHECKING:
    from tumble.logs.session import Session


def record_command(
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAME=SOURCE...", help="Units and where each is read from.", show_default=False
        ),
    ] = None,
    output: OutputFolder = None,
    duration: Annotated[
        str | None,
        typer.Option(
            metavar="TIME", help="How long to record, such as 90s, 10min or 2h.", show_default=False
        ),
    ] = None,
    count: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Record so many samples of each unit.", show_default=False),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Add to the session that is there.")] = False,
    finish: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Join what a recording left that was killed; nothing is recorded.",
            show_default=False,
        ),
    ] = None,
    list_at: Annotated[
        str | None,
        typer.Option(
            "--list",
            metavar="ADDRESS",
            help="List the topics that are sent at ros2://, ros2+zenoh:// or foxglove://HOST:PORT, and their "
            "rates; nothing is recorded.",
            show_default=False,
        ),
    ] = None,
    sender: AlwaysLiveSenderOption = None,
    as_json: JsonOption = False,
    *,
    reading: ReadingOptionsOfSeveral,
) -> None:
    """Record several live sources at once, on one clock.

    Example: tumble record a=serial:/dev/ttyUSB0 b=udp://:9000 -o session --duration 10min

    Writes session.yaml and a Parquet file for each unit; what has come is on disk within 2 s, and stays
    readable whatever happens. Ctrl-C or SIGTERM ends it. A source that is lost is opened again every second.
    The exit code is 0 if every unit was recorded, 3 if one never sent a sample or lacks more than
    2 % of them, 2 if nothing could be done.
    """
    if list_at is not None:
        from tumble.tools.record.command_listing import show_topics

        if sources:
            raise ProcedureError("--list records nothing; leave out the sources")
        show_topics(list_at, as_json=as_json)
        return
    if finish is not None:
        _finish(finish, bool(sources))
        return
    from tumble.live import open_set
    from tumble.live.naming import parse_named_sources
    from tumble.tools.record.command_screen import is_whole, shown
    from tumble.tools.record.procedure import Recorder

    seconds = None if duration is None else seconds_of("--duration", duration)
    typed = {name: address.text for name, address in parse_named_sources(sources or []).items()}
    if output is None:
        raise ProcedureError("give the folder to record into, as -o session")
    options = reading.read_each(list(typed))
    units = open_set(sources or [], options, sender=sender, keep_going=True)
    recorder = Recorder(
        units,
        output,
        typed=typed,
        serials={name: each.serial for name, each in options.items()},
        resume=resume,
    )
    with recorder, stopped_by_signals(recorder.stop), shown(as_json) as show:
        for step in recorder.steps(seconds, count):
            show(step)
    if not as_json:
        _print_summary(recorder.session, output)
    whole = is_whole(units.losses)
    if empty := [unit.name for unit in recorder.session.units if not unit.samples]:
        print(f"tumble: warning: {join(empty)} never sent a sample", file=sys.stderr)
    if empty or not whole:
        raise typer.Exit(ExitCode.NOT_ALL_WELL)


def _finish(folder: Path, with_sources: bool) -> None:
    if with_sources:
        raise ProcedureError("--finish records nothing; leave out the sources, or give --resume to go on")
    from tumble.tools.record.writer import finish_session

    _print_summary(finish_session(folder), folder)


def _print_summary(session: Session, folder: Path) -> None:
    for unit in session.units:
        print(f"{unit.name}: {count_of('sample', unit.samples or 0)}: {folder / unit.name}.parquet")
        for remark in unit.remarks:
            print(f"  {remark}")
