"""`tumble turntable`: reads recordings, calibrates targets, writes calibration files, summary and reports."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.errors import print_notice
from tumble.cli.gravity import GravityOptions
from tumble.cli.live_screen import failures_told
from tumble.cli.output import OutputFolder, folder_for, folder_named_after
from tumble.cli.progress import batch_progress
from tumble.cli.read_options import ReadingOptionsOfSeveral, read_options_for
from tumble.cli.results import end_unless, list_files, show_results, write_results
from tumble.cli.shared_options import LongVoiceOptions, MakerOptions
from tumble.foundation.errors import LogError, ProcedureError, TumbleError
from tumble.foundation.file_status import exists
from tumble.foundation.translation import translated
from tumble.logs.options import ReadOptions
from tumble.procedures.turntable.command_live import TurntableLiveOptions, record_live
from tumble.procedures.turntable.command_options import (
    BatchOptions,
    MethodOptions,
    PagesOption,
    ReferenceOptions,
)
from tumble.tools.viewers.command_options import ViewerOptions

if TYPE_CHECKING:
    from tumble.poses.pose_list import PoseList
    from tumble.procedures.turntable.command_live import RecordedSession
    from tumble.procedures.turntable.command_run import TurntableRun
    from tumble.procedures.turntable.procedure import TurntableSession
    from tumble.procedures.turntable.production import Production
    from tumble.procedures.turntable.targets import TargetLog, TargetsFound
    from tumble.tools.viewers.content import ViewerContent


def turntable_command(
    reference: Annotated[
        str,
        typer.Argument(
            metavar="REFERENCE",
            help="Recording of the reference: LOG, or LOG:NAME for one of several; or a session of all; with "
            "--live NAME=SOURCE of any unit.",
        ),
    ],
    targets: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="TARGET...",
            help="Recordings of the targets in the same form, folders of them, or a list (CSV).",
            show_default=False,
        ),
    ] = None,
    output: OutputFolder = None,
    *,
    known: ReferenceOptions,
    method: MethodOptions,
    gravity: GravityOptions,
    wanted: BatchOptions,
    live: TurntableLiveOptions,
    maker: MakerOptions,
    voice: LongVoiceOptions,
    viewers: ViewerOptions,
    reading: ReadingOptionsOfSeveral,
) -> None:
    """Calibrate targets on a turntable against a co-mounted reference.

    Example: tumble turntable reference.csv target_1.csv target_2.csv --limits limits.yaml -o results

    Live: tumble turntable --live reference=udp://:9000 target_1=serial:/dev/ttyUSB0 -o results

    Writes a calibration file and a page for each target, batch.jsonl, summary.csv and turntable.html, which
    keep the targets of earlier runs into the folder. The exit code is 0 if every target was calibrated within
    its limits, 3 if one was not or a live session ended before all was reached, 2 if nothing could be done.
    """
    from tumble.procedures.turntable.procedure import open_session

    viewers.check()
    certified = known.certified()
    if live.live and certified is not None:
        certified.refuse_other_model(known.reference_model)
        certified.refuse_unless_it_holds_today()
    opened = partial(
        open_session,
        **gravity.stated(),
        reference_certificate=certified,
        reference_calibration=known.applied(),
        reference_grade=known.grade,
        reference_model=known.reference_model,
        target_grade=known.target_grade,
        clock=method.clock.value,
        g_sensitivity=method.g_sensitivity,
    )
    calibrating = partial(
        opened,
        truth=method.wanted_truth().value,
        rates=method.wanted_rates(),
        rate_accuracy=method.rate_accuracy,
        limits=wanted.wanted_limits(),
        operator=maker.operator,
        station=maker.station,
    )
    words, recorded = [reference, *(targets or [])], None
    read = TargetReading(reading.read(), reading.exceptions or [])
    with failures_told(live.live and voice.as_json):
        if live.live:
            viewers.refuse_live()
            folder = _folder_of_live(output)
            recorded = record_live(
                words,
                folder,
                live,
                reference=known.name,
                poses=method.live_poses(),
                read=read.shared,
                exceptions=read.exceptions,
                open_reference=partial(opened, poses=None),
                maker=maker,
                resume=wanted.resume,
                voice=voice,
            )
            if recorded is None:
                return
            # The session is in SI units and the case frame: reading options no longer hold for it.
            words, read = [str(recorded.folder)], TargetReading(ReadOptions(), [])
        else:
            live.refuse_without_live()
            folder = output or folder_for(reference)
        poses = _poses(method, words[0], recorded)
        units = _units(words[0], words[1:], known.name)
        found = _found(units, folder, poses, wanted, read)
        production, remarks = _production(units[0], folder, poses, found, wanted, read, calibrating, gravity)
        if not voice.quiet:
            _remark([*(certified.remarks if certified else []), *remarks])
        well = _run(production, found.targets, voice, viewers, read, live=live.live)
    end_unless(well and (recorded is None or recorded.is_all))


def _folder_of_live(output: Path | None) -> Path:
    from tumble.foundation.files import prepare_folder

    return prepare_folder(output or folder_named_after("live"))


def _poses(method: MethodOptions, session: str, recorded: RecordedSession | None) -> PoseList | None:
    """Give the poses of the run; of a session that was just recorded those that were shown."""
    from tumble.poses.pose_list import SIX_FACES

    if recorded is None:
        return method.wanted_poses(session)
    poses = replace(method, poses=None).wanted_poses(session)
    return poses if poses is None or poses is SIX_FACES else poses.without(recorded.not_shown)


def _found(
    units: tuple[str, list[str]],
    folder: Path,
    poses: PoseList | None,
    wanted: BatchOptions,
    read: TargetReading,
) -> TargetsFound:
    """Find the targets, and settle how each is read."""
    from tumble.procedures.turntable.targets import find_targets

    reference, targets = units
    found = find_targets(
        targets,
        reference,
        name_by=wanted.name_by,
        poses=poses.files() if poses else (),
        output=folder,
        read=lambda _: read.shared,
    )
    read.settle(reference, found.targets)
    return found


def _production(
    reference: str,
    folder: Path,
    poses: PoseList | None,
    found: TargetsFound,
    wanted: BatchOptions,
    read: TargetReading,
    calibrating: Callable[..., TurntableSession],
    gravity: GravityOptions,
) -> tuple[Production, list[str]]:
    """Reads and fits the reference; returns the calibration of targets, and the remarks before it."""
    from tumble.foundation.files import prepare_folder
    from tumble.procedures.turntable.batch import Batch
    from tumble.procedures.turntable.production import MOST_PAGES, Production, key_of_run, pages_for

    batch = Batch(prepare_folder(folder))
    session = calibrating(reference, poses=poses, read=read.of(reference))
    pages = wanted.pages or PagesOption(pages_for(len(found.targets)))
    remarks = [*found.remarks, *batch.remarks()]
    if wanted.pages is None and pages is PagesOption.FAILED:
        remarks.append(f"of more than {MOST_PAGES} targets only those that fail get a page; see --pages")
    key = key_of_run(session, poses, read.of(reference), gravity.latitude)
    jobs = wanted.jobs or os.cpu_count() or 1
    return Production(session, batch, pages.value, read.of, key, jobs, wanted.resume), remarks


def _units(reference: str, targets: list[str], name: str | None) -> tuple[str, list[str]]:
    """Splits a session into reference and targets; other typed sources stay as they are."""
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


class TargetReading:
    """Options of reading each recording of a run."""

    def __init__(self, shared: ReadOptions, exceptions: Sequence[str]) -> None:
        self.shared = shared
        self.reference = ""
        """Recording of the reference, once the recordings are settled."""
        self.exceptions = exceptions
        self._apart: dict[str, ReadOptions] = {}

    def settle(self, reference: str, targets: Sequence[TargetLog]) -> None:
        """Take the recordings that are meant; raises `LogError` where an option cannot hold for them."""
        if self.shared.serial and len(targets) > 1:
            raise LogError(
                f"--serial {self.shared.serial}: there are {len(targets)} targets; give each its own with "
                "--for NAME:serial=TEXT, or in a list with columns file,serial"
            )
        self.reference = reference
        sources = (reference, *(target.source for target in targets))
        if self.exceptions:
            self._apart = read_options_for(self.shared, self.exceptions, sources)
        if self.shared.serial:
            self._apart[reference] = replace(self.of(reference), serial="")

    def of(self, source: str) -> ReadOptions:
        """Returns the options of reading a recording."""
        return self._apart.get(source, self.shared)


def _run(
    production: Production,
    targets: Sequence[TargetLog],
    voice: LongVoiceOptions,
    viewers: ViewerOptions,
    read: TargetReading,
    *,
    live: bool,
) -> bool:
    """Calibrates and writes all targets, then summary and report, and prints all remarks.

    Returns whether every target has a calibration within its limits.
    """
    from tumble.procedures.turntable import summary
    from tumble.procedures.turntable.command_run import TurntableRun

    if viewers.are_wanted:
        production = replace(production, results={})
    run = TurntableRun(production, len(targets), everything=voice.verbose, as_json=voice.as_json)
    try:
        with batch_progress("calibrating", 0 if voice.quiet else len(targets)) as advance:
            for done, made in enumerate(production.run(targets), start=1):
                run.add(made)
                advance(done, run.screen.counts())
    except (TumbleError, KeyboardInterrupt):
        if run.screen.verdicts:
            write_results(run, production.batch.folder)
        raise
    files = write_results(run, production.batch.folder)
    files |= viewers.write(lambda: _shown(production, read), quiet=voice.quiet)
    _remark(f"{path} is of an earlier attempt, the last one has none" for path in run.moved)
    show_results(
        summary,
        run,
        files,
        voice,
        well=run.is_well,
        live=live,
        list_files=lambda files: _say_where(run, files),
        failures=run.screen.failures(),
    )
    return run.is_well


def _shown(production: Production, read: TargetReading) -> ViewerContent:
    """Gives the targets of this run, and their reference, for viewers."""
    from tumble.logs import open_recording
    from tumble.procedures.turntable.viewers import viewer_content

    reference = open_recording(read.reference, read.of(read.reference))
    targets = [
        (result, open_recording(source, read.of(source)))
        for source, result in (production.results or {}).items()
    ]
    return viewer_content(production.session.batch, reference, targets)


def _say_where(run: TurntableRun, files: Mapping[str, Path]) -> None:
    from tumble.foundation.file_names import ATTEMPTS, SUMMARY
    from tumble.procedures.turntable.batch import PAGE_ENDING

    batch = run.batch
    if run.unchanged:
        print(translated(f"{run.unchanged} were done and unchanged, and left as they are"))
    has_pages = any(exists(batch.folder / f"{last.stem}{PAGE_ENDING}") for last in batch.last.values())
    pages = "pages, " if has_pages else ""
    where = f"Calibration files, {pages}{SUMMARY} and {ATTEMPTS} are in {batch.folder}: {batch.counts()}"
    print(translated(where))
    print(translated(f"Report: {files['report']}"))
    list_files({key: files[key] for key in ("rerun", "mcap", "layout") if key in files})


def _remark(lines: Iterable[str]) -> None:
    for line in lines:
        print_notice(line)
