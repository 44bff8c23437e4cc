"""`tumble redundancy`: replays the logs of a redundant set, writes events, calibrations, store and report."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import ReadingOptionsOfSeveral
from tumble.cli.results import end_unless, show_results, write_results
from tumble.cli.shared_options import LongVoiceOptions, MakerOptions
from tumble.foundation.errors import ProcedureError
from tumble.procedures.redundancy.command_options import (
    AidingOptions,
    RedundancyLiveOptions,
    ReplayOptions,
    SetOptions,
    SettingsOptions,
)
from tumble.tools.viewers.command_options import ViewerOptions

if TYPE_CHECKING:
    from tumble.logs import SingleAxes
    from tumble.procedures.redundancy.monitor import Command
    from tumble.procedures.redundancy.result import RedundancyResult


def redundancy_command(
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[LOG|NAME=SOURCE...]",
            help="Log that holds the units, if one log holds several; with --live each unit and where it is "
            "read from.",
        ),
    ] = None,
    primary: Annotated[
        str | None,
        typer.Option(metavar="NAME|LOG:NAME", help="The primary: an IMU in LOG, or a log of its own."),
    ] = None,
    output: OutputFolder = None,
    *,
    replay: ReplayOptions,
    stated: SettingsOptions,
    known: SetOptions,
    aiding: AidingOptions,
    explain: Annotated[
        bool,
        typer.Option("--explain", help="Print every setting with meaning, unit and default; no log needed."),
    ] = False,
    live: RedundancyLiveOptions,
    maker: MakerOptions,
    voice: LongVoiceOptions,
    viewers: ViewerOptions,
    reading: ReadingOptionsOfSeveral,
) -> None:
    """Replay a redundant set: a primary IMU keeps its secondaries calibrated.

    Example: tumble redundancy flight.csv --primary imu1 --secondary imu2 --secondary imu3 -o results

    At rest the secondaries are evaluated, in motion those that deviate are calibrated against the primary,
    and when the primary fails one of them takes over. Writes events.jsonl, a calibration file for each
    secondary, the stored errors and redundancy.html. The exit code is 0 if all went well, 3 if something is
    known to be wrong and stayed so: the source, two units that disagree, a secondary that is not calibrated;
    2 if nothing could be done.

    With --live the monitor runs beside sensors until Ctrl-C or SIGTERM:
    tumble redundancy --live primary=udp://:9000 a=udp://:9001 --store store --to udp://10.0.0.2:9100
    """
    if explain:
        from tumble.procedures.redundancy.explain import show_settings

        show_settings(voice.as_json)
        return
    viewers.check()
    with maker.stated():
        if live.live:
            viewers.refuse_live()
            from tumble.procedures.redundancy.command_live import watch_sources

            replay.refuse_with_live()
            result = watch_sources(
                sources or [], primary, output, stated, known, aiding, live, voice, reading
            )
        else:
            live.refuse_without_live()
            result = _replayed(
                sources or [], primary, output, replay, stated, known, aiding, voice, viewers, reading
            )
    end_unless(result.all_well)


def _replayed(
    sources: Sequence[str],
    primary: str | None,
    output: Path | None,
    replay: ReplayOptions,
    stated: SettingsOptions,
    known: SetOptions,
    aiding: AidingOptions,
    voice: LongVoiceOptions,
    viewers: ViewerOptions,
    reading: ReadingOptionsOfSeveral,
) -> RedundancyResult:
    """Replay logs, write and show what came of it."""
    log, primary, secondary, single = _units(sources, primary, replay)
    from tumble.cli.progress import sample_progress
    from tumble.foundation.file_names import EVENTS, REDUNDANCY_PAGE
    from tumble.foundation.files import PAGE, check_output, prepare_folder
    from tumble.procedures.redundancy import summary
    from tumble.procedures.redundancy.command_files import EVENTS_KIND, output_format, stale_files
    from tumble.procedures.redundancy.command_viewers import viewer_content
    from tumble.procedures.redundancy.logs import open_units
    from tumble.procedures.redundancy.procedure import redundancy

    how, of_units, told = stated.stated(), known.stated(), aiding.stated()
    commands = [_command(text) for text in replay.command or ()]
    typed = [str(text) for name in (primary, *secondary) for text in _logs_of(name, single)]
    read = reading.read_each(typed)
    folder = prepare_folder(output or folder_for(log or primary))
    check_output(folder / EVENTS, EVENTS_KIND)
    check_output(folder / REDUNDANCY_PAGE, PAGE)
    if replay.output_log is not None:
        output_format(replay.output_log)
    units = [single.get(name, name) for name in (primary, *secondary)]
    with sample_progress("replaying", quiet=voice.quiet) as advance:
        result = redundancy(
            units[0],
            units[1:],
            log=log,
            commands=commands,
            allow_missing=replay.allow_missing,
            keep_output=replay.output_log is not None,
            read=read,
            progress=advance,
            **how,
            **of_units,
            **told,
        )
    files = write_results(result, folder)
    if replay.output_log is not None and result.output is not None:
        files["output"] = result.output.save(replay.output_log)
    files |= viewers.write(
        lambda: viewer_content(
            result, open_units(units, log, read, replay.allow_missing), how["settings"].units
        ),
        quiet=voice.quiet,
    )
    for path in stale_files(result, folder):
        print(
            f"tumble: warning: {path} is of an earlier run, this one has no calibration for it",
            file=sys.stderr,
        )
    draw = summary.long_summary if voice.verbose else summary.screen_summary
    show_results(summary, result, files, voice, well=result.all_well, draw=draw)
    return result


def _units(
    sources: Sequence[str], primary: str | None, replay: ReplayOptions
) -> tuple[str | None, str, list[str], dict[str, SingleAxes]]:
    """Give the log of all units, if there is one, the primary, the secondaries, and units of single axes."""
    if len(sources) > 1:
        raise ProcedureError(
            f"{sources[1]}: one log is read at a time; give each unit as --primary and --secondary, or --live"
        )
    log = sources[0] if sources else None
    secondary = replay.secondary or []
    single = _single_axes(replay.unit or [])
    if single:
        primary, secondary = _with_single_axes(list(single), primary, secondary)
    if log is not None and not (primary and secondary):
        primary, secondary = _units_of_session(log, primary, secondary)
    if primary is None or not secondary:
        missing = "--primary" if primary is None else "--secondary"
        raise ProcedureError(f"{missing} is missing; tumble redundancy --help shows an example")
    return log, primary, secondary, single


def _units_of_session(log: str, primary: str | None, secondary: list[str]) -> tuple[str | None, list[str]]:
    """Names the units of a recorded session that were not: its first one, or `primary`, before all others."""
    from tumble.logs.session import unit_names

    names = unit_names(log)
    if primary is None and names:
        primary = "primary" if "primary" in names else names[0]
    return primary, secondary or [name for name in names if name != primary]


def _single_axes(texts: list[str]) -> dict[str, SingleAxes]:
    """Reads units of single-axis sensors, by name; numpy is not needed before there is one."""
    if not texts:
        return {}
    from tumble.logs import SingleAxes

    return {unit.name: unit for unit in map(SingleAxes.parse, texts)}


def _with_single_axes(
    single: Sequence[str], primary: str | None, secondary: list[str]
) -> tuple[str | None, list[str]]:
    """Names the units of --unit that were not: `primary` as the primary, others as secondaries."""
    if primary is None and "primary" in single:
        primary = "primary"
    return primary, [*secondary, *(name for name in single if name not in (primary, *secondary))]


def _logs_of(unit: str, single: Mapping[str, SingleAxes]) -> Sequence[str | Path]:
    """Returns what was typed to name the logs of a unit."""
    return list(single[unit].logs.values()) if unit in single else [unit]


def _command(text: str) -> tuple[float, Command]:
    time, _, word = text.rpartition(":")
    words: dict[str, Command] = {"evaluate": "evaluate", "return": "return to primary"}
    try:
        return float(time), words[word]
    except (KeyError, ValueError):
        raise ProcedureError(
            f"--command {text}: give TIME:evaluate or TIME:return, the time in s from the start, such as "
            "120.5:evaluate"
        ) from None
