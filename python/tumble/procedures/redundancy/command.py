"""`tumble redundancy`: replays the logs of a redundant set, writes events, calibrations, store and report."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.durations import seconds_of
from tumble.cli.exit_code import ExitCode
from tumble.cli.json_option import JsonOption
from tumble.cli.live_options import LIVE, SenderOption, ToOption
from tumble.cli.maker_options import with_maker
from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import ExceptionsOption, read_options_for, with_read_options
from tumble.foundation.errors import ProcedureError
from tumble.logs.options import ReadOptions

if TYPE_CHECKING:
    from tumble.logs import SingleAxes
    from tumble.procedures.redundancy.factory import Factory
    from tumble.procedures.redundancy.monitor import Command
    from tumble.procedures.redundancy.result import RedundancyResult
    from tumble.procedures.redundancy.settings import RedundancySettings


class PrecisionOption(str, Enum):
    """Floats to compute with."""

    F64 = "f64"
    F32 = "f32"


@with_maker
@with_read_options
def redundancy_command(
    read_options: ReadOptions,
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
    secondary: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME|LOG:NAME", help="A secondary, in the same form; repeatable, up to 7."),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=CHANNEL:LOG,...",
            help="A unit of single-axis sensors with a log each, as imu2=ax:x.csv,ay:y.csv,gz:yaw.csv:rate, "
            "CHANNEL of ax ay az gx gy gz and LOG:COLUMN where a log holds several; repeatable. A unit that "
            "neither --primary nor --secondary names is a secondary.",
        ),
    ] = None,
    output: OutputFolder = None,
    settings: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Settings, and what is known of each unit, such as what tumble align wrote (YAML); "
            "repeatable, a later one overrides an earlier one.",
        ),
    ] = None,
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="A setting, or units.UNIT.NAME=VALUE; overrides those of --settings; repeatable.",
        ),
    ] = None,
    calibration: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The primary's own calibration.")
    ] = None,
    store: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder of stored errors; adopted errors are written there. Without it there are none "
            "at the start, and adopted errors go to the folder store of the results.",
        ),
    ] = None,
    factory: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[UNIT=]FILE",
            help="Turntable calibration of a secondary, which becomes its first error in --store; of the "
            "unit that it names, or UNIT; repeatable.",
        ),
    ] = None,
    command: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TIME:evaluate|return",
            help="A command to the monitor, s from the start of the logs: evaluate now, or return to the "
            "primary; repeatable.",
        ),
    ] = None,
    witness: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FILE|SOURCE",
            help="Table (CSV) of what something else on board says, which settles what two units cannot: "
            "time, and velocity vx, vy, vz or vn, ve, vd (level frame), climb, or body_vx, body_vy, body_vz, "
            "m/s, or yaw, rad, or heading_deg, or score_UNIT, the innovations of an estimator; with --live "
            "where such rows come from, as "
            "udp://:9200; repeatable.",
        ),
    ] = None,
    witness_sigma: Annotated[
        float | None,
        typer.Option(metavar="M/S", help="Sigma of velocities in --witness without a column sigma."),
    ] = None,
    precision: Annotated[
        PrecisionOption, typer.Option(help="Floats to compute with: f32 as on a device.")
    ] = PrecisionOption.F64,
    allow_missing: Annotated[
        bool,
        typer.Option(
            "--allow-missing", help="Replay a unit whose log cannot be read as one that sends nothing."
        ),
    ] = False,
    output_log: Annotated[
        Path | None,
        typer.Option(
            "--output-log",
            metavar="FILE",
            help="Write what the platform would have used, sample by sample: time, specific force, "
            "angular rate, source, flags; .csv or .parquet.",
        ),
    ] = None,
    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published",
            help="Begin from the settings of the literature: thresholds on the norm, an offset an axis, "
            "and each calibration replaces the last.",
        ),
    ] = False,
    exceptions: ExceptionsOption = None,
    live: Annotated[
        bool,
        typer.Option("--live", help="Watch units while they run: NAME=SOURCE...", rich_help_panel=LIVE),
    ] = False,
    to: ToOption = None,
    record: Annotated[
        Path | None,
        typer.Option(
            "--record",
            metavar="DIR",
            help="Record all samples into a session, whose replay gives the same.",
            rich_help_panel=LIVE,
        ),
    ] = None,
    duration: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="How long to watch, such as 90s or 2h.", rich_help_panel=LIVE),
    ] = None,
    dashboard: Annotated[
        bool,
        typer.Option(
            "--dashboard",
            help="Show each unit, its deviations against their thresholds, and the source.",
            rich_help_panel=LIVE,
        ),
    ] = False,
    sender: SenderOption = None,
    explain: Annotated[
        bool,
        typer.Option("--explain", help="Print every setting with meaning, unit and default; no log needed."),
    ] = False,
    as_json: JsonOption = False,
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

        show_settings(as_json)
        return
    only_live = {"--to": to, "--record": record, "--duration": duration, "--from": sender}
    if live:
        of_logs = {
            "--secondary": secondary,
            "--command": command,
            "--output-log": output_log,
            "--allow-missing": allow_missing,
            "--unit": unit,
        }
        _refuse(of_logs, "is for logs; leave it out, or leave out --live")
        from tumble.calibration.document import Calibration
        from tumble.procedures.redundancy.command_live import names_of, watch_sources

        words = sources or []
        result = watch_sources(
            words,
            primary,
            output,
            read_options_for(read_options, exceptions or (), names_of(words)),
            settings=_settings(settings or [], changes or []),
            calibration=Calibration.load(calibration) if calibration else None,
            store=store,
            factory=_factory(factory or []),
            precision=precision.value,
            as_published=as_published,
            to=to,
            record=record,
            duration=None if duration is None else seconds_of("--duration", duration),
            dashboard=dashboard,
            sender=sender,
            witness=witness or (),
            witness_sigma=witness_sigma,
            as_json=as_json,
        )
        _exit_with(result)
        return
    _refuse(only_live | {"--dashboard": dashboard}, "is for sensors that run; give --live, or leave it out")
    if sources is not None and len(sources) > 1:
        raise ProcedureError(
            f"{sources[1]}: one log is read at a time; give each unit as --primary and --secondary, or --live"
        )
    log = sources[0] if sources else None
    single = _single_axes(unit or [])
    if single:
        primary, secondary = _with_single_axes(list(single), primary, secondary or [])
    if log is not None and not (primary and secondary):
        primary, secondary = _units_of_session(log, primary, secondary or [])
    if primary is None or not secondary:
        missing = "--primary" if primary is None else "--secondary"
        raise ProcedureError(f"{missing} is missing; tumble redundancy --help shows an example")
    from tumble.calibration.document import Calibration
    from tumble.cli.progress import sample_progress
    from tumble.foundation.file_names import EVENTS, REDUNDANCY_PAGE
    from tumble.foundation.files import PAGE, check_output, prepare_folder
    from tumble.procedures.redundancy.command_files import (
        EVENTS_KIND,
        output_format,
        stale_files,
        write_results,
    )
    from tumble.procedures.redundancy.procedure import redundancy

    chosen = _settings(settings or [], changes or [])
    applied = Calibration.load(calibration) if calibration else None
    commands = [_command(text) for text in command or ()]
    typed = [str(text) for name in (primary, *secondary) for text in _logs_of(name, single)]
    read = read_options_for(read_options, exceptions or [], typed)
    folder = prepare_folder(output or folder_for(log or primary))
    check_output(folder / EVENTS, EVENTS_KIND)
    check_output(folder / REDUNDANCY_PAGE, PAGE)
    if output_log is not None:
        output_format(output_log)
    with sample_progress("replaying") as advance:
        result = redundancy(
            single.get(primary, primary),
            [single.get(name, name) for name in secondary],
            log=log,
            settings=chosen,
            calibration=applied,
            store=store,
            factory=_factory(factory or []),
            commands=commands,
            witness=witness or (),
            witness_sigma=witness_sigma,
            precision=precision.value,
            allow_missing=allow_missing,
            as_published=as_published,
            keep_output=output_log is not None,
            read=read,
            progress=advance,
        )
    files = write_results(result, folder)
    if output_log is not None and result.output is not None:
        files["output"] = result.output.save(output_log)
    for path in stale_files(result, folder):
        print(
            f"tumble: warning: {path} is of an earlier run, this one has no calibration for it",
            file=sys.stderr,
        )
    from tumble.procedures.redundancy.summary import show_results

    show_results(result, files, as_json)
    _exit_with(result)


def _exit_with(result: RedundancyResult) -> None:
    if not result.all_well:
        raise typer.Exit(ExitCode.NOT_ALL_WELL)


def _refuse(given: Mapping[str, object], why: str) -> None:
    """Raise `ProcedureError` for an option that was given and has no meaning here."""
    for option, value in given.items():
        if value:
            raise ProcedureError(f"{option} {why}")


def _units_of_session(log: str, primary: str | None, secondary: list[str]) -> tuple[str | None, list[str]]:
    """Name the units of a recorded session that were not: its first one, or `primary`, before all others."""
    from tumble.logs.session import unit_names

    names = unit_names(log)
    if primary is None and names:
        primary = "primary" if "primary" in names else names[0]
    return primary, secondary or [name for name in names if name != primary]


def _single_axes(texts: list[str]) -> dict[str, SingleAxes]:
    """Read units of single-axis sensors, by name; numpy is not needed before there is one."""
    if not texts:
        return {}
    from tumble.logs import SingleAxes

    return {unit.name: unit for unit in map(SingleAxes.parse, texts)}


def _with_single_axes(
    single: Sequence[str], primary: str | None, secondary: list[str]
) -> tuple[str | None, list[str]]:
    """Name the units of --unit that were not: `primary` as the primary, others as secondaries."""
    if primary is None and "primary" in single:
        primary = "primary"
    return primary, [*secondary, *(name for name in single if name not in (primary, *secondary))]


def _logs_of(unit: str, single: Mapping[str, SingleAxes]) -> Sequence[str | Path]:
    """Give what was typed to name the logs of a unit."""
    return list(single[unit].logs.values()) if unit in single else [unit]


def _settings(paths: list[Path], changes: list[str]) -> RedundancySettings:
    from tumble.procedures.redundancy.settings import RedundancySettings

    stated = RedundancySettings()
    for path in paths:
        stated = stated.and_then(RedundancySettings.load(path))
    return stated.changed(changes)


def _factory(texts: list[str]) -> Factory:
    """Read `UNIT=FILE`, or files alone; of both at once each file is given the name that it states."""
    from tumble.calibration.document import Calibration

    parted = [text.rpartition("=") for text in texts]
    if not any(name for name, _, _ in parted):
        return texts
    named: dict[str, Calibration] = {}
    for name, _, path in parted:
        calibration = Calibration.load(path)
        if named.setdefault(name or calibration.name, calibration) is not calibration:
            raise ProcedureError(f"--factory {path}: {name or calibration.name} has a calibration already")
    return named


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
