"""`tumble fleet`: one procedure over any number of recordings, on this machine or on a cluster."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.abbreviations import AbbreviatingCommand
from tumble.cli.exit_code import ExitCode
from tumble.cli.results import end_unless
from tumble.cli.screen import print_document, print_line, print_summary
from tumble.cli.shared_options import JsonOption, QuietOption
from tumble.foundation.errors import CommandError
from tumble.logs.optional import install_command

if TYPE_CHECKING:
    from collections.abc import Collection

    from tumble.fleet.job import FleetJob, Reduction
    from tumble.fleet.places import FileStore
    from tumble.fleet.reduction import FleetSummary

fleet_app = typer.Typer(
    no_args_is_help=True,
    help="Run a procedure over any number of recordings, here or on a cluster, and sum up the units.",
)
JobFile = Annotated[
    Path, typer.Argument(metavar="JOB", help="Job file; tumble schema fleet-job explains it.")
]
LimitsFile = Annotated[
    Path | None,
    typer.Option(
        "--limits", metavar="FILE", help="Limits, for due dates and capability.", show_default=False
    ),
]
PageFile = Annotated[
    Path | None,
    typer.Option("--page", metavar="FILE", help="Write the page of the fleet.", show_default=False),
]


@fleet_app.callback()
def _fleet() -> None:
    """Run a procedure over any number of recordings, here or on a cluster, and sum up the units."""


@fleet_app.command("run", cls=AbbreviatingCommand)
def run_command(
    path: JobFile,
    engine: Annotated[
        str,
        typer.Option(
            metavar="local|ray[:ADDRESS]",
            help="Where to compute: processes of this machine, or a cluster of Ray; without ADDRESS that of "
            "RAY_ADDRESS, or one on this machine.",
        ),
    ] = "local",
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes of this machine; all cores if not given.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on: inputs that have a result are not computed again.")
    ] = False,
    results: Annotated[
        str,
        typer.Option(
            "--results",
            metavar="DIR|URL",
            help="Place of the results, instead of the job's.",
            show_default=False,
        ),
    ] = "",
    limits: LimitsFile = None,
    page: PageFile = None,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Compute all inputs of a job, and sum up their results.

    Example: tumble fleet run job.yaml --engine ray

    The exit code is 0 if all results are well, 3 if an input failed or a result is not all well, 2 if nothing
    could be done. Results of before stay.
    """
    job = _job(path, results)
    from tumble.fleet.driver import FleetRun
    from tumble.fleet.engine import engine_of
    from tumble.fleet.screen import progress

    place = _place(job.results)
    start_engine = partial(engine_of, engine, workers or os.cpu_count() or 1)
    with progress(quiet) as show:
        status = FleetRun(job, start_engine, engine, resume, show).run()
    if status.state == "cancelled":
        raise typer.Exit(ExitCode.INTERRUPTED)
    _enter(job, place)
    _show(place, limits, page, as_json=as_json, quiet=quiet, wanted=job.reduce)


@fleet_app.command("status", cls=AbbreviatingCommand)
def status_command(path: JobFile, as_json: JsonOption = False) -> None:
    """Show how far a job is, wherever it runs.

    Example: tumble fleet status job.yaml
    """
    job = _job(path)
    from tumble.fleet.ledger import read_status
    from tumble.fleet.screen import status_words
    from tumble.fleet.summary_document import STATUS, status_content

    status = read_status(_place(job.results))
    if as_json:
        print_document(STATUS, status.state, status_content(status))
    else:
        print_line(status_words(status))


@fleet_app.command("cancel", cls=AbbreviatingCommand)
def cancel_command(path: JobFile) -> None:
    """End a job after the tasks that are under way; `run --resume` goes on.

    Example: tumble fleet cancel job.yaml
    """
    job = _job(path)
    from tumble.fleet.ledger import ask_to_cancel, read_status

    place = _place(job.results)
    status = read_status(place)
    if status.state != "running":
        raise CommandError(f"{place}: the job is {status.state}, so there is nothing to cancel")
    ask_to_cancel(place)
    print_line(f"{place}: ends after the tasks that are under way; go on with tumble fleet run --resume")


@fleet_app.command("show", cls=AbbreviatingCommand)
def show_command(
    results: Annotated[str, typer.Argument(metavar="RESULTS", help="Folder or URL of the results.")],
    limits: LimitsFile = None,
    page: PageFile = None,
    as_json: JsonOption = False,
) -> None:
    """Sum up results: verdicts, failures, drift by model, due units, units that moved beyond chance.

    Example: tumble fleet show results --limits limits.yaml --page fleet.html
    """
    _installed()
    _show(_place(results), limits, page, as_json=as_json)


def _show(
    place: FileStore,
    limits: Path | None,
    page: Path | None,
    *,
    as_json: bool,
    quiet: bool = False,
    wanted: Collection[Reduction] | None = None,
) -> None:
    from tumble.calibration.limits import Limits
    from tumble.fleet.job import REDUCTIONS
    from tumble.fleet.reduction import summarize
    from tumble.fleet.summary_document import RESULT, result_content

    summary = summarize(
        place, Limits.load(limits) if limits else None, REDUCTIONS if wanted is None else wanted
    )
    files: dict[str, Path] = {}
    if page is not None:
        from tumble.fleet.report.page import FLEET_REPORT

        FLEET_REPORT.write(summary, page)
        files["report"] = page
    well = _is_well(summary)
    if as_json:
        verdict = "nothing done" if not summary.verdicts else "all well" if well else "not all well"
        print_document(RESULT, verdict, result_content(summary, str(place), files))
    elif not quiet:
        from tumble.fleet.screen import drawn

        print_summary(drawn(summary))
        for name, written in files.items():
            print_line(f"{name.capitalize()}: {written}")
    end_unless(well)


def _is_well(summary: FleetSummary) -> bool:
    return not summary.failures and not summary.not_well and bool(summary.verdicts)


def _job(path: Path, results: str = "") -> FleetJob:
    _installed()
    from tumble.fleet.job import load_job

    job = load_job(path)
    return job.model_copy(update={"results": results}) if results else job


def _place(url: str) -> FileStore:
    from tumble.fleet.places import FileStore

    return FileStore(url)


def _enter(job: FleetJob, place: FileStore) -> None:
    if job.registry:
        from tumble.fleet.registering import enter_results

        entered = enter_results(job.registry, place)
        print_line(f"tumble: {entered} results added to the registry", is_message=True)


def _installed() -> None:
    try:
        import fsspec  # noqa: F401
    except ModuleNotFoundError as error:
        raise CommandError(
            f"fleets need the Python package {error.name}, which is not installed; type: "
            f"{install_command('fleet')}"
        ) from error
