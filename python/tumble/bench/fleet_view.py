"""Fleets as their screen needs them: jobs of a folder, how far they are, and what their results show."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

from tumble.bench.authority import Shared, as_bench, query
from tumble.foundation import clock
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_status import is_file
from tumble.foundation.regular_files import open_regular
from tumble.foundation.schemas import FLEET_JOB, schema_in
from tumble.logs.optional import install_command

if TYPE_CHECKING:
    from tumble.fleet.job import FleetJob
    from tumble.fleet.ledger import JobStatus
    from tumble.fleet.places import FileStore
    from tumble.fleet.reduction import FleetSummary
    from tumble.fleet.report.page import FleetTable

JobState: TypeAlias = Literal["not begun", "running", "silent", "done", "cancelled", "failed", "unreadable"]
"""A `silent` job is stated to run, and wrote nothing for a while; an `unreadable` one is no job."""
JOB_FILES = ("*.yaml", "*.yml")
_HEAD = 1 << 16
"""Bytes at the beginning of a file among which its schema and keys stand."""
_KEYS = (re.compile(rb"^procedure\s*:", re.MULTILINE), re.compile(rb"^results\s*:", re.MULTILINE))
"""Keys of every job, which need not state its schema."""


@dataclass(frozen=True, slots=True)
class SeenJob:
    """One job, as far as it is now."""

    name: str
    """Name of its file."""
    state: JobState
    procedure: str = ""
    results: str = ""
    """Place of its results, without credentials."""
    status: JobStatus | None = None
    """None before it was begun."""
    trouble: str = ""
    """Reason why it cannot be read, or why it failed."""

    @property
    def share(self) -> float:
        """Share of the inputs that have a result, 0 to 1."""
        return self.status.done / self.status.inputs if self.status and self.status.inputs else 0.0


class FleetView(Shared):
    """Jobs of a folder; relative places in them are those of a command that is typed in that folder.

    Raises `TumbleError` in one line where a library is missing.
    """

    @as_bench
    def __init__(self, folder: Path) -> None:
        try:
            import fsspec  # noqa: F401
        except ModuleNotFoundError as error:
            raise TumbleError(
                f"fleets need the Python package {error.name}, which is not installed; type: "
                f"{install_command('fleet')}"
            ) from error
        self._folder = folder

    @query
    def jobs(self) -> list[SeenJob]:
        """Looks how far each job is; those that were begun last come first, then those that were not."""
        found = [self._seen(path) for path in sorted(self._files())]
        return sorted(found, key=lambda each: -(each.status.written if each.status else 0.0))

    @query
    def summary(self, name: str, limits: Path | None) -> FleetSummary:
        """Sums up the results of a job; raises `TumbleError` where they, or the limits, cannot be read."""
        from tumble.calibration.limits import Limits
        from tumble.fleet.reduction import summarize

        job = self._job(name)
        return summarize(self._store(job), Limits.load(limits) if limits else None, job.reduce)

    @staticmethod
    def tables(summary: FleetSummary) -> tuple[FleetTable, ...]:
        """Returns what a person looks for, as the page of the fleet has it."""
        from tumble.fleet.report.page import fleet_tables

        return fleet_tables(summary)

    @staticmethod
    def page(summary: FleetSummary) -> str:
        """Returns the page of a fleet."""
        from tumble.fleet.report.page import FLEET_REPORT

        return FLEET_REPORT.render(summary)

    def cancel(self, name: str) -> None:
        """Ends a running job after the tasks that are under way; raises `TumbleError` where none runs."""
        from tumble.fleet.ledger import ask_to_cancel, read_status

        place = self._store(self._job(name))
        status = read_status(place)
        if status.state != "running":
            raise TumbleError(f"{place}: the job is {status.state}, so there is nothing to cancel")
        ask_to_cancel(place)

    def _files(self) -> Iterator[Path]:
        for pattern in JOB_FILES:
            for path in self._folder.glob(pattern):
                if is_file(path) and _is_job(path):
                    yield path

    def _seen(self, path: Path) -> SeenJob:
        from tumble.fleet.ledger import STATUS_FILE, read_status

        try:
            job = self._job(path.name)
            store = self._store(job)
            about = (job.procedure, str(store))
            if store.read(STATUS_FILE) is None:
                return SeenJob(path.name, "not begun", *about)
            status = read_status(store)
        except TumbleError as error:
            return SeenJob(path.name, "unreadable", trouble=str(error))
        return SeenJob(path.name, _state(status), *about, status, status.reason)

    def _job(self, name: str) -> FleetJob:
        from tumble.fleet.job import load_job

        path = next((each for each in self._files() if each.name == name), None)
        if path is None:
            raise TumbleError(f"{name}: no such job in {self._folder}; choose one that is listed")
        return load_job(path)

    def _store(self, job: FleetJob) -> FileStore:
        from tumble.fleet.places import FileStore

        is_url = "://" in job.results
        return FileStore(job.results if is_url else str(self._folder / job.results))


def _is_job(path: Path) -> bool:
    try:
        with open_regular(path) as file:
            head = file.read(_HEAD)
    except OSError:
        return False
    stated = schema_in(head)
    return stated is FLEET_JOB or (stated is None and all(key.search(head) for key in _KEYS))


def _state(status: JobStatus) -> JobState:
    from tumble.fleet.ledger import SILENT_AFTER

    known: dict[str, JobState] = {"running": "running", "done": "done", "cancelled": "cancelled"}
    is_silent = status.silence(clock.utc()) > SILENT_AFTER
    return "silent" if is_silent else known.get(status.state, "failed")
