"""`tumble turntable`: reads recordings, calibrates targets, writes calibration files, summary and reports."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tumble.cli.exit_code import ExitCode
from tumble.cli.gravity import GravityOption, HeightOption, LatitudeOption, check_gravity
from tumble.cli.json_option import JsonOption
from tumble.cli.live_options import SenderOption, UntilOption
from tumble.cli.live_screen import failures_told
from tumble.cli.maker_options import OperatorOption, StationOption
from tumble.cli.output import OutputFolder, folder_for, folder_named_after
from tumble.cli.progress import batch_progress
from tumble.cli.read_options import ExceptionsOption, read_options_for, with_read_options
from tumble.cli.screen import print_json, print_json_line, print_summary
from tumble.foundation.errors import LogError, ProcedureError, TumbleError
from tumble.logs.options import ReadOptions
from tumble.procedures.turntable.command_live import (
    ArmedOption,
    LiveOption,
    LiveOptions,
    NoTurnsOption,
    PoseSecondsOption,
    TableLimitsOption,
    TableOption,
    record_live,
)

if TYPE_CHECKING:
    from tumble.poses.pose_list import PoseList
    from tumble.procedures.turntable.batch import Batch
    from tumble.procedures.turntable.production import Production
    from tumble.procedures.turntable.result import TurntableResult
    from tumble.procedures.turntable.summary import ScreenSummary
    from tumble.procedures.turntable.targets import Target


SIX_FACES_WORD = "six-faces"
NO_POSES = "none"


class TruthOption(str, Enum):
    """What the target is held against; see docs/theory/turntable.md."""

    REFERENCE = "reference"
    ROTATE_TRUTH = "rotate-truth"
    ROTATE_MEASUREMENT = "rotate-measurement"
    IDEAL = "ideal"
    TABLE = "table"


class ClocksOption(str, Enum):
    """Whether reference and targets were stamped by one clock."""

    AUTO = "auto"
    SHARED = "shared"
    APART = "apart"


class PagesOption(str, Enum):
    """Which targets get a page of their own."""

    ALL = "all"
    FAILED = "failed"
    NONE = "none"


@with_read_options
def turntable_command(
    reference: Annotated[
        str,
        typer.Argument(
            metavar="REFERENCE",
            help="Recording of the reference: LOG, or LOG:NAME for one of several; or a session of all; with "
            "--live NAME=SOURCE of any unit.",
        ),
    ],
    read_options: ReadOptions,
    targets: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="TARGET...",
            help="Recordings of the targets in the same form, folders of them, or a list (CSV).",
            show_default=False,
        ),
    ] = None,
    output: OutputFolder = None,
    live: LiveOption = False,
    until: UntilOption = None,
    pose_seconds: PoseSecondsOption = None,
    no_turns: NoTurnsOption = False,
    table: TableOption = None,
    table_limits: TableLimitsOption = "",
    armed: ArmedOption = False,
    sender: SenderOption = None,
    reference_name: Annotated[
        str | None,
        typer.Option(
            "--reference",
            metavar="NAME",
            help="Of a session or of --live: the unit that is the reference; that of the name reference if "
            "not given.",
            show_default=False,
        ),
    ] = None,
    poses: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|six-faces|none",
            help="Pose list; that of the session, or the six faces, if not given; `none` for unknown poses.",
        ),
    ] = None,
    truth: Annotated[
        TruthOption, typer.Option(help="What is used as truth for the targets.")
    ] = TruthOption.REFERENCE,
    rates: Annotated[
        str | None,
        typer.Option(
            metavar="RATES",
            help="With --truth table: magnitudes of the commanded rates, deg/s, such as 10,30,60; those "
            "of the pose list if not given.",
            show_default=False,
        ),
    ] = None,
    rate_accuracy: Annotated[
        float | None,
        typer.Option(
            metavar="PPM",
            help="With --truth table: 1-sigma of what all its rates are wrong by alike; 100 if not given.",
            show_default=False,
        ),
    ] = None,
    as_published: Annotated[
        bool,
        typer.Option("--as-published", help="As in the literature: the same as --truth rotate-measurement."),
    ] = False,
    latitude: LatitudeOption = None,
    height: HeightOption = None,
    gravity: GravityOption = None,
    limits: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Limits that targets pass or fail.")
    ] = None,
    reference_calibration: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Calibration to apply to the reference first; its uncertainty goes to the targets.",
        ),
    ] = None,
    reference_grade: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Grade of the reference, whose figures go to the targets where no calibration states its "
            "uncertainty: consumer, industrial, tactical or reference.",
            show_default=False,
        ),
    ] = None,
    clock: Annotated[
        ClocksOption, typer.Option(help="Whether all recordings were stamped by one clock.")
    ] = ClocksOption.AUTO,
    g_sensitivity: Annotated[
        bool | None,
        typer.Option(
            "--g-sensitivity/--no-g-sensitivity",
            help="Fit how the gyroscopes respond to specific force; if not given, where residuals show it.",
            show_default=False,
        ),
    ] = None,
    name_by: Annotated[
        str,
        typer.Option(
            metavar="file|folder|serial|REGEX", help="What targets are named by; of REGEX what it matches."
        ),
    ] = "file",
    pages: Annotated[
        PagesOption | None,
        typer.Option(
            help="Targets with a page; all of up to 50, of more those that failed.", show_default=False
        ),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Leave out what is done in the folder and unchanged; with --live go on with its session.",
        ),
    ] = False,
    operator: OperatorOption = "",
    station: StationOption = "",
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Targets calibrated at a time; all cores if not given.")
    ] = None,
    exceptions: ExceptionsOption = None,
    as_json: JsonOption = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="Print only what failed; no progress.")
    ] = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Print every target, and whom each warning concerns.")
    ] = False,
) -> None:
    """Calibrate targets on a turntable against a co-mounted reference.

    Example: tumble turntable reference.csv target_1.csv target_2.csv --limits limits.yaml -o results

    Live: tumble turntable --live reference=udp://:9000 target_1=serial:/dev/ttyUSB0 -o results

    Writes a calibration file and a page for each target, batch.jsonl, summary.csv and turntable.html, which
    keep the targets of earlier runs into the folder. The exit code is 0 if every target was calibrated within
    its limits, 3 if one was not or a live session ended before all was reached, 2 if nothing could be done.
    """
    from tumble.calibration.document import Calibration
    from tumble.calibration.limits import Limits
    from tumble.foundation.files import prepare_folder
    from tumble.poses.pose_list import SIX_FACES
    from tumble.procedures.turntable.batch import Batch
    from tumble.procedures.turntable.procedure import open_session
    from tumble.procedures.turntable.production import MOST_PAGES, Production, key_of_run, pages_for
    from tumble.procedures.turntable.targets import find_targets

    check_gravity(latitude, height, gravity)
    if as_published:
        truth = _published(truth)
    wanted_limits = Limits.load(limits) if limits else None
    wanted_rates = None if rates is None else _numbers("--rates", rates)
    applied = Calibration.load(reference_calibration) if reference_calibration else None
    asked = LiveOptions(until, pose_seconds, not no_turns, table, table_limits, armed, sender)
    opened = partial(
        open_session,
        gravity=gravity,
        latitude=latitude,
        height=height,
        reference_calibration=applied,
        reference_grade=reference_grade,
        clock=clock.value,
        g_sensitivity=g_sensitivity,
    )
    recorded = None
    with failures_told(live and as_json):
        if live:
            folder = prepare_folder(output or folder_named_after("live"))
            recorded = record_live(
                [reference, *(targets or [])],
                folder,
                asked,
                reference=reference_name,
                poses=_poses_of_live(poses),
                read=read_options,
                exceptions=exceptions or [],
                open_reference=partial(opened, poses=None),
                operator=operator,
                station=station,
                resume=resume,
                as_json=as_json,
                quiet=quiet,
            )
            if recorded is None:
                return
            # What was recorded is in SI units and the case frame: nothing is left to be said of it.
            reference, targets, poses = str(recorded.folder), [], None
            read_options, exceptions = ReadOptions(), []
        else:
            asked.refuse_without_live()
            folder = output or folder_for(reference)
        wanted_poses = _poses(poses, reference)
        if recorded is not None and wanted_poses is not None and wanted_poses is not SIX_FACES:
            wanted_poses = wanted_poses.without(recorded.not_shown)
        reference, targets = _units(reference, targets or [], reference_name)
        read = ReadingOptions(read_options, exceptions or [])
        found = find_targets(
            targets,
            reference,
            name_by=name_by,
            poses=wanted_poses.files() if wanted_poses else (),
            output=folder,
            read=lambda _: read_options,
        )
        read.settle(reference, found.targets)
        batch = Batch(prepare_folder(folder))
        session = opened(
            reference,
            poses=wanted_poses,
            truth=truth.value,
            rates=wanted_rates,
            rate_accuracy=rate_accuracy,
            limits=wanted_limits,
            read=read.of(reference),
            operator=operator,
            station=station,
        )
        wanted = pages or PagesOption(pages_for(len(found.targets)))
        production = Production(
            session,
            batch,
            wanted.value,
            read.of,
            key_of_run(session, wanted_poses, read.of(reference), latitude),
            jobs or os.cpu_count() or 1,
            resume,
        )
        remarks = [*found.remarks, *batch.remarks()]
        if pages is None and wanted is PagesOption.FAILED:
            remarks.append(f"of more than {MOST_PAGES} targets only those that fail get a page; see --pages")
        if not quiet:
            _remark(remarks)
        screen = _run(production, found.targets, Voice(quiet, verbose, as_json, events=live))
    if screen.failed or not (recorded is None or recorded.is_all):
        raise typer.Exit(ExitCode.NOT_ALL_WELL)


def _units(reference: str, targets: list[str], name: str | None) -> tuple[str, list[str]]:
    """Tell reference and targets of a session apart; what else was typed stays as it is."""
    from tumble.logs.session import unit_names
    from tumble.procedures.turntable.live import REFERENCE

    if targets and name is None:
        return reference, targets
    names = unit_names(reference)
    if not names or targets:
        raise ProcedureError(
            f"{reference}: give REFERENCE and one or more TARGETs, or a recorded session and --reference NAME"
        )
    name = name or REFERENCE
    if name not in names:
        raise ProcedureError(
            f"{reference}: no unit {name!r}; say --reference NAME, one of {', '.join(names)}"
        )
    return f"{reference}:{name}", [f"{reference}:{other}" for other in names if other != name]


def _numbers(option: str, text: str) -> list[float]:
    """Read numbers between commas."""
    try:
        return [float(each) for each in text.split(",")]
    except ValueError:
        raise TumbleError(f"{option} {text}: give numbers between commas, such as 10,30,60") from None


def _published(truth: TruthOption) -> TruthOption:
    """Give the truth of the literature, unless another was asked for."""
    if truth not in (TruthOption.REFERENCE, TruthOption.ROTATE_MEASUREMENT):
        raise TumbleError(f"--as-published is --truth rotate-measurement, not {truth.value}; leave one out")
    return TruthOption.ROTATE_MEASUREMENT


@dataclass(frozen=True, slots=True)
class Voice:
    """How much a run says."""

    quiet: bool
    verbose: bool
    as_json: bool
    events: bool
    """Whether the result is one event of several, a line each."""


class ReadingOptions:
    """How to read each recording of a run."""

    def __init__(self, shared: ReadOptions, exceptions: Sequence[str]) -> None:
        self._shared = shared
        self._exceptions = exceptions
        self._apart: dict[str, ReadOptions] = {}

    def settle(self, reference: str, targets: Sequence[Target]) -> None:
        """Take the recordings that are meant; raises `LogError` where an option cannot hold for them."""
        if self._shared.serial and len(targets) > 1:
            raise LogError(
                f"--serial {self._shared.serial}: there are {len(targets)} targets; give each its own with "
                "--for NAME:serial=TEXT, or in a list with columns file,serial"
            )
        sources = (reference, *(target.source for target in targets))
        if self._exceptions:
            self._apart = read_options_for(self._shared, self._exceptions, sources)
        if self._shared.serial:
            self._apart[reference] = replace(self.of(reference), serial="")

    def of(self, source: str) -> ReadOptions:
        """Say how to read a recording."""
        return self._apart.get(source, self._shared)


def _poses(poses: str | None, session: str | None) -> PoseList | None:
    """Give the poses that are typed, those that a recorded session brings, or the six faces."""
    from tumble.poses.pose_list import SIX_FACES, PoseList
    from tumble.procedures.turntable.session_poses import poses_of

    if poses == NO_POSES:
        return None
    if poses is not None and poses != SIX_FACES_WORD:
        return PoseList.load(poses)
    listed = poses_of(session) if session and poses is None else None
    return listed or SIX_FACES


def _poses_of_live(poses: str | None) -> PoseList | None:
    """Give the poses that are typed for a live session; None where a table may choose them."""
    if poses == NO_POSES:
        raise ProcedureError("--poses none: a live session has to know which poses are wanted; leave it out")
    return None if poses is None else _poses(poses, None)


def _run(production: Production, targets: Sequence[Target], voice: Voice) -> ScreenSummary:
    """Calibrate and write all targets, then summary and report, and say what there is to say."""
    from tumble.procedures.turntable.production import write_views
    from tumble.procedures.turntable.summary import ScreenSummary, target_content

    shared, batch = production.session.batch, production.batch
    screen = ScreenSummary(shared, len(targets), everything=voice.verbose)
    contents: dict[str, dict[str, Any]] = {}
    unchanged = 0
    moved: list[Path] = []
    total = 0 if voice.quiet else len(targets)
    try:
        with batch_progress("calibrating", total) as advance:
            for done, made in enumerate(production.run(targets), start=1):
                screen.add(made.record)
                unchanged += not made.fresh
                moved += made.moved
                if voice.as_json:
                    contents[made.record.target] = target_content(made.record, made.calibration)
                advance(done, screen.counts())
    except (TumbleError, KeyboardInterrupt):
        if screen.verdicts:
            write_views(shared, batch)
        raise
    files = write_views(shared, batch)
    _remark(f"{path} is of an earlier attempt, the last one has none" for path in moved)
    if voice.as_json:
        _print_json(shared, batch, contents, files, voice.events)
    elif voice.quiet:
        _remark(screen.failures())
    else:
        print_summary(screen.rendered())
        _say_where(batch, files, unchanged)
    return screen


def _print_json(
    shared: TurntableResult,
    batch: Batch,
    contents: dict[str, dict[str, Any]],
    files: dict[str, Path],
    events: bool,
) -> None:
    """Print all targets of the folder; those of earlier runs without the content of their calibration."""
    from tumble.procedures.turntable.summary import json_content, target_content

    targets = (contents.get(record.target) or target_content(record, None) for record in batch.latest())
    calibrations = {
        name: batch.folder / f"{last.stem}.yaml"
        for name, last in batch.last.items()
        if last.calibration_sha256
    }
    content = json_content(shared, targets, calibrations | files)
    if events:
        print_json_line({"event": "result", **content})
    else:
        print_json(content)


def _say_where(batch: Batch, files: dict[str, Path], unchanged: int) -> None:
    from tumble.foundation.file_names import ATTEMPTS, SUMMARY
    from tumble.procedures.turntable.batch import PAGE_ENDING

    if unchanged:
        print(f"{unchanged} were done and unchanged, and left as they are")
    has_pages = any((batch.folder / f"{last.stem}{PAGE_ENDING}").exists() for last in batch.last.values())
    pages = "pages, " if has_pages else ""
    print(f"Calibration files, {pages}{SUMMARY} and {ATTEMPTS} are in {batch.folder}: {batch.counts()}")
    print(f"Report: {files['report']}")


def _remark(lines: Iterable[str]) -> None:
    for line in lines:
        print(f"tumble: {line}", file=sys.stderr)
