"""State of a job beside its results: what it computes, how far it is, whether it is to end."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from tumble import _core
from tumble.fleet.job import FleetJob
from tumble.fleet.places import FileStore
from tumble.foundation.bounded_json import parse_json
from tumble.foundation.days import moment_of
from tumble.foundation.documents import made_of
from tumble.foundation.errors import TumbleError
from tumble.foundation.files import FileKind
from tumble.foundation.numbers import whole_number
from tumble.foundation.provenance import date_now
from tumble.foundation.secrets import without_secrets

JOB_FILE = "job.json"
STATUS_FILE = "status.json"
CANCEL_FILE = "cancel"
_SOFTWARE = "tumble fleet"
KIND = FileKind(
    "a file of tumble fleet", re.compile(rb'\A(?:tumble fleet\s*\Z|\{\s*"written by": "tumble fleet")')
)
SILENT_AFTER = 60.0
"""s without a word after which a job may have been killed."""


class JobChangedError(TumbleError):
    """Results of another job stand where those of this one are to go."""


@dataclass(frozen=True, slots=True)
class JobStatus:
    """Progress of a job."""

    state: str
    """`running`, `done`, `cancelled` or `failed`."""
    inputs: int
    done: int
    """Inputs that have a row, those of earlier runs among them."""
    failed: int
    """Inputs that have no result, those of earlier runs among them unless another run may mend them."""
    not_well: int
    """Results that are not all well."""
    retried: int
    """Tasks that were lost with their worker and given again."""
    rate: float
    """Inputs a second in this run."""
    seconds: float
    """Duration of this run."""
    engine: str
    reason: str = ""
    written: float = 0.0
    """Time at which this was written, s since 1970."""

    @property
    def seconds_left(self) -> float | None:
        """Time that the rest takes at this rate, s; None before it is known."""
        return (self.inputs - self.done) / self.rate if self.rate > 0.0 else None

    def silence(self, now: float) -> float:
        """Returns how long ago a running job wrote this, s; one that was killed writes nothing any more."""
        return now - self.written if self.state == "running" else 0.0

    def content(self) -> dict[str, Any]:
        """Returns it as it stands in the file."""
        return asdict(self)


def refuse_other_job(results: FileStore, job: FleetJob, *, resume: bool) -> str | None:
    """Returns the date that results of before state, s since 1970; None where there are none.

    Raises `JobChangedError` where results of another job or version stand there, or of this one without
    `resume`.
    """
    content = results.read(JOB_FILE)
    if content is None:
        return None
    known = _parsed(results, content)
    if known.get("work") != without_secrets(job.work):
        raise JobChangedError(
            f"{results}: holds results of a job with another procedure or other options; give another "
            "folder, or the options of before"
        )
    if known.get("software") != _core.__version__:
        raise JobChangedError(
            f"{results}: holds results of tumble {known.get('software')}, and this is {_core.__version__}; "
            "give another folder, or install that version"
        )
    if not resume:
        raise JobChangedError(
            f"{results}: holds results of this job; go on with --resume, or give another folder"
        )
    date = str(known.get("date", ""))
    if whole_number(date) is None:
        raise _damaged(results)
    return date


def begin(results: FileStore, job: FleetJob) -> str:
    """Registers the job at its results; returns the date that its results state, s since 1970."""
    date = _seconds(date_now())
    stated = {
        "written by": _SOFTWARE,
        "work": without_secrets(job.work),
        "software": _core.__version__,
        "date": date,
    }
    results.write(JOB_FILE, (json.dumps(stated, indent=1) + "\n").encode(), KIND)
    return date


def write_status(results: FileStore, status: JobStatus) -> None:
    """Writes how far the job is."""
    content = {"written by": _SOFTWARE, **status.content()}
    results.write(STATUS_FILE, (json.dumps(content, indent=1) + "\n").encode(), KIND)


def read_status(results: FileStore) -> JobStatus:
    """Reads how far a job is; raises `TumbleError` where none was begun there."""
    content = results.read(STATUS_FILE)
    if content is None:
        raise TumbleError(
            f"{results}: no job was begun there; check the job file, or begin with tumble fleet run"
        )
    try:
        return made_of(JobStatus, _parsed(results, content))
    except ValueError:
        raise TumbleError(
            f"{results}: {STATUS_FILE} is of another version of Tumble; go on with that"
        ) from None


def ask_to_cancel(results: FileStore) -> None:
    """Has whoever runs the job end it after the tasks that are under way."""
    results.write(CANCEL_FILE, _SOFTWARE.encode(), KIND)


def is_cancelled(results: FileStore) -> bool:
    """Returns whether that was asked for; a file of others of that name asks for nothing."""
    return (results.read(CANCEL_FILE) or b"").strip() == _SOFTWARE.encode()


def forget_cancelling(results: FileStore) -> None:
    """Lets the job go on."""
    if is_cancelled(results):
        results.remove(CANCEL_FILE, KIND)


def _parsed(results: FileStore, content: bytes) -> Mapping[str, Any]:
    try:
        found = parse_json(content)
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise _damaged(results)
    return found


def _damaged(results: FileStore) -> TumbleError:
    return TumbleError(f"{results}: {JOB_FILE} or {STATUS_FILE} is damaged; give another folder")


def _seconds(date: str) -> str:
    moment = moment_of(date)
    assert moment is not None, "a run has a date"
    return str(int(moment.timestamp()))
