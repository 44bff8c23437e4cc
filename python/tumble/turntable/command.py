"""`tumble turntable`: reads recordings, calibrates targets, writes calibration files, summary and reports."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.gravity import GravityOption, HeightOption, LatitudeOption, check_gravity
from tumble.cli.output import OutputFolder, folder_for
from tumble.cli.read_options import ExceptionsOption, read_options_for, with_read_options
from tumble.cli.screen import print_json, print_summary
from tumble.logs.options import ReadOptions

if TYPE_CHECKING:
    from tumble.turntable.poses import PoseList
    from tumble.turntable.procedure import RecordingsRead
    from tumble.turntable.result import TargetResult, TurntableResult

SOME_FAILED = 3
"""Exit code where a target failed its limits or could not be calibrated."""


class TruthOption(str, Enum):
    """What the target is held against; see docs/theory/turntable.md."""

    REFERENCE = "reference"
    ROTATE_TRUTH = "rotate-truth"
    ROTATE_MEASUREMENT = "rotate-measurement"
    IDEAL = "ideal"


class ClocksOption(str, Enum):
    """Whether reference and targets were stamped by one clock."""

    AUTO = "auto"
    SHARED = "shared"
    APART = "apart"


@with_read_options
def turntable_command(
    reference: Annotated[
        str,
        typer.Argument(
            metavar="REFERENCE", help="Recording of the reference: LOG, or LOG:NAME for one of several."
        ),
    ],
    targets: Annotated[
        list[str], typer.Argument(metavar="TARGET...", help="Recordings of the targets, in the same form.")
    ],
    read_options: ReadOptions,
    output: OutputFolder = None,
    poses: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|none", help="Pose list; the six faces if not given, `none` for unknown poses."
        ),
    ] = None,
    truth: Annotated[
        TruthOption, typer.Option(help="What is used as truth for the targets.")
    ] = TruthOption.REFERENCE,
    latitude: LatitudeOption = None,
    height: HeightOption = None,
    gravity: GravityOption = None,
    limits: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Limits that targets pass or fail.")
    ] = None,
    reference_calibration: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Calibration to apply to the reference first.")
    ] = None,
    clock: Annotated[
        ClocksOption, typer.Option(help="Whether all recordings were stamped by one clock.")
    ] = ClocksOption.AUTO,
    g_sensitivity: Annotated[
        bool, typer.Option("--g-sensitivity", help="Fit how the gyroscopes respond to specific force.")
    ] = False,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Targets calibrated at a time; all cores if not given.")
    ] = None,
    exceptions: ExceptionsOption = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON instead of a table.")
    ] = False,
) -> None:
    """Calibrate targets on a turntable against a co-mounted reference.

    Example: tumble turntable reference.csv target_1.csv target_2.csv --limits limits.yaml -o results

    Writes a calibration file and a page for each target, summary.csv and turntable.html. The exit code is 0
    if every target was calibrated within its limits, 3 if one was not, 2 if nothing could be done.
    """
    from tumble.calibration.document import Calibration
    from tumble.files import prepare_folder
    from tumble.logs import parse_spec
    from tumble.turntable.limits import Limits
    from tumble.turntable.procedure import turntable

    check_gravity(latitude, height, gravity)
    wanted_poses = _poses(poses)
    wanted_limits = Limits.load(limits) if limits else None
    applied = Calibration.load(reference_calibration) if reference_calibration else None
    sources = (reference, *targets)
    for source in sources:
        parse_spec(source)
    read = read_options_for(read_options, exceptions, sources) if exceptions else read_options
    folder = prepare_folder(output or folder_for(reference))
    with _progress() as advance:
        result = turntable(
            reference,
            targets,
            poses=wanted_poses,
            truth=truth.value,
            gravity=gravity,
            latitude=latitude,
            height=height,
            reference_calibration=applied,
            clock=clock.value,
            g_sensitivity=g_sensitivity,
            limits=wanted_limits,
            read=read,
            jobs=jobs,
            progress=advance,
        )
    files = _write(result, folder)
    for path in _stale_files(result, folder):
        print(
            f"tumble: warning: {path} is of an earlier run, this one has no calibration for it",
            file=sys.stderr,
        )
    _show(result, files, as_json)
    if any(_fails(target) for target in result.targets):
        raise typer.Exit(SOME_FAILED)


def _fails(target: TargetResult) -> bool:
    """Whether a target is not calibrated, or is held against limits and cannot be said to be within them."""
    held = target.verdict == "model not met" and bool(target.checks)
    return held or target.verdict in ("fail", "not calibrated")


def _poses(poses: str | None) -> PoseList | None:
    from tumble.turntable.poses import SIX_FACES, PoseList

    if poses is None:
        return SIX_FACES
    return None if poses == "none" else PoseList.load(poses)


@contextmanager
def _progress() -> Iterator[RecordingsRead]:
    """Show a bar on standard error while targets are worked on; nothing where it is no terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(file=sys.stderr)
    columns = (TextColumn("calibrating"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("calibrating", total=None)

        def advance(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)

        yield advance


def _write(result: TurntableResult, folder: Path) -> dict[str, str]:
    """Write everything into `folder`; give the path of each file by what it is."""
    from tumble.calibration.document import Calibration
    from tumble.file_names import SUMMARY
    from tumble.files import write_text
    from tumble.turntable.report.pages import page_names, write_reports
    from tumble.turntable.summary import SUMMARY_KIND, csv_text

    files = {}
    for target, page in zip(result.targets, page_names(result.targets), strict=True):
        path = (folder / page).with_suffix(".yaml")
        if not target.failure:
            Calibration.from_target(target, result).save(path)
            files[target.name] = str(path)
    summary = folder / SUMMARY
    write_text(summary, csv_text(result), SUMMARY_KIND)
    report, *_ = write_reports(result, folder)
    return files | {"summary": str(summary), "report": str(report)}


def _stale_files(result: TurntableResult, folder: Path) -> list[Path]:
    """Calibration files that stand in the folder for targets that could not be calibrated this time."""
    from tumble.turntable.report.pages import page_names

    names = page_names(result.targets)
    paths = [
        (folder / page).with_suffix(".yaml")
        for target, page in zip(result.targets, names, strict=True)
        if target.failure
    ]
    return [path for path in paths if path.exists()]


def _show(result: TurntableResult, files: dict[str, str], as_json: bool) -> None:
    from tumble.file_names import SUMMARY
    from tumble.turntable.summary import json_content, screen_summary

    if as_json:
        print_json(json_content(result, files))
        return
    print_summary(screen_summary(result))
    print(f"Calibration files, {SUMMARY} and a page for each target are in {Path(files['report']).parent}")
    print(f"Report: {files['report']}")
