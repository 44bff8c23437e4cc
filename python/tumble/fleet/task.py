"""Work of a fleet where it is done: reads inputs, runs the command on each, writes a part of the results."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tumble import _core
from tumble.calibration.document import KIND, Calibration
from tumble.cli.commands import command_line_for, run_command_line
from tumble.cli.exit_code import ExitCode
from tumble.fleet.inputs import FleetInput
from tumble.fleet.job import FleetJob, option_words
from tumble.fleet.parts import Outcome, write_parts
from tumble.fleet.places import FileStore, fetched
from tumble.foundation import clock
from tumble.foundation.bounded_json import JsonError, parse_json
from tumble.foundation.errors import TumbleError, shown
from tumble.foundation.file_reading import read_whole
from tumble.foundation.file_status import is_file, is_folder
from tumble.foundation.files import files_of_command, make_folder
from tumble.foundation.plain import finite
from tumble.foundation.words import in_utf8
from tumble.report.page import without_pages

TRIES = 3
"""Tries of an input whose place is at fault."""
_PAUSE = 0.3
"""s before another try; twice as long before each further one."""
_LONGEST_MESSAGE = 10_000
_LARGEST_RESULT = 1 << 28
"""Bytes of a file that a command wrote."""


@dataclass(frozen=True, slots=True)
class FleetTask:
    """Inputs that one worker computes one after another."""

    job: FleetJob
    inputs: tuple[FleetInput, ...]
    date: str
    """Seconds since 1970 that results state, as `SOURCE_DATE_EPOCH`."""
    software: str

    def halves(self) -> tuple[FleetTask, FleetTask]:
        """Splits it in two."""
        middle = len(self.inputs) // 2
        return replace(self, inputs=self.inputs[:middle]), replace(self, inputs=self.inputs[middle:])


@dataclass(frozen=True, slots=True)
class TaskDone:
    """Figures of a finished task; its results went to their place."""

    done: int
    failed: int
    not_well: int
    """Those whose exit code is neither 0 nor that of a failure."""
    seconds: float


class OtherVersionError(TumbleError):
    """A worker has another version of Tumble than whoever gave it the work."""


def run_task(task: FleetTask) -> TaskDone:
    """Computes a task and writes its results.

    Raises `OtherVersionError` where the versions differ, `StoreError` where results cannot be written.
    """
    if task.software != _core.__version__:
        raise OtherVersionError(
            f"this worker has tumble {_core.__version__}, and the job was given by {task.software}; "
            "install the same version on all nodes"
        )
    begun = clock.now()
    work = task.job.work
    with _dated(task.date):
        outcomes = [_tried(task.job, each, each.key(work)) for each in task.inputs]
    write_parts(FileStore(task.job.results), outcomes)
    failed = sum(bool(each.failure) for each in outcomes)
    well = sum(each.exit_code == ExitCode.DONE for each in outcomes)
    return TaskDone(len(outcomes), failed, len(outcomes) - failed - well, clock.now() - begun)


def lost_outcome(job: FleetJob, given: FleetInput, failure: str) -> Outcome:
    """Returns the row of an input whose worker was lost each time."""
    return _failure(_row(given, given.key(job.work)), failure, transient=True)


def _tried(job: FleetJob, given: FleetInput, key: bytes) -> Outcome:
    pause = _PAUSE
    for _ in range(TRIES - 1):
        outcome = computed_outcome(job, given, key)
        if not outcome.transient:
            return outcome
        clock.sleep(pause)
        pause *= 2.0
    return computed_outcome(job, given, key)


def computed_outcome(job: FleetJob, given: FleetInput, key: bytes) -> Outcome:
    """Computes one input, once; a failure is an outcome too."""
    row = _row(given, key)
    try:
        return _of_function(job, given, row) if job.is_function else _of_input(job, given, row)
    except TumbleError as error:
        return _failure(row, str(error))
    except OSError as error:  # such as a full disk, of this node alone
        return _failure(row, f"cannot be computed here: {_words_of(error)}", transient=True)
    except Exception as error:  # a mistake of ours in one of a million inputs must not end the others
        return _failure(row, f"internal error, please report it: {_words_of(error)}")


def _of_input(job: FleetJob, given: FleetInput, row: Outcome) -> Outcome:
    with TemporaryDirectory(prefix="tumble-fleet-") as folder:
        try:
            place = _simulated(job, given, Path(folder)) if job.simulate else _fetched(given, Path(folder))
        except TumbleError:
            raise
        except Exception as error:  # libraries of stores raise errors of their own
            missing = isinstance(error, FileNotFoundError)
            return _failure(row, f"cannot be read: {_words_of(error)}", transient=not missing)
        words = [*job.words(str(place)), *option_words(given.options)]
        return _of_command(words, Path(folder) / "results", row)


def _row(given: FleetInput, key: bytes) -> Outcome:
    """Returns the row of an input, with what is known before it is computed."""
    stated: dict[str, Any] = dict(given.facts)
    return Outcome(key, shown(given.place), **stated)


def _fetched(given: FleetInput, folder: Path) -> Path:
    copies = folder / "inputs"
    make_folder(copies)
    return fetched(given.place, copies)


def _simulated(job: FleetJob, given: FleetInput, folder: Path) -> Path:
    assert job.simulate is not None
    place = folder / "inputs"
    words = ["simulate", job.simulate.scenario, "-o", str(place), "--seed", given.place]
    run = _run([*words, *option_words(job.simulate.options)])
    if run.failure:
        raise TumbleError(run.failure)
    return place


@dataclass(frozen=True, slots=True)
class _Run:
    """Outcome of a command that ran in this process."""

    code: int
    output: str
    messages: str
    failure: str
    written: Mapping[Path, object]
    """Documents that it has written."""


def _run(words: Sequence[str]) -> _Run:
    output, messages = io.StringIO(), io.StringIO()
    failure, code = "", ExitCode.USER_ERROR
    with (
        contextlib.redirect_stdout(output),
        contextlib.redirect_stderr(messages),
        files_of_command() as files,
    ):
        try:
            code = run_command_line(_command_line(words[0], words), words)
        except TumbleError as error:
            failure = str(error)
        finally:
            files.release()
    return _Run(code, output.getvalue(), messages.getvalue()[:_LONGEST_MESSAGE], failure, files.documents)


_made: dict[str, Any] = {}


def _command_line(command: str, words: Sequence[str]) -> Any:  # noqa: ANN401 - typer keeps its type to itself
    """Returns the command line, which takes longer to build than many inputs take to compute."""
    if command not in _made:
        _made[command] = command_line_for(words)
    return _made[command]


def _of_command(words: Sequence[str], folder: Path, row: Outcome) -> Outcome:
    with without_pages():
        run = _run([*words, "--json", "-o", str(folder)])
    messages = _without_paths(run.messages, folder.parent)
    if run.failure:
        return replace(_failure(row, _without_paths(run.failure, folder.parent)), messages=messages)
    try:
        summary = parse_json(run.output)
    except JsonError:
        return replace(
            _failure(row, f"{words[0]}: printed no result; leave out --help and its like"), messages=messages
        )
    summary.pop("files", None)
    documents = tuple(_documents(folder))
    found = list(_results(folder, documents, run.written))
    return replace(
        row,
        exit_code=run.code,
        verdict=str(summary.get("verdict", "")),
        messages=messages,
        summary=_without_paths(json.dumps(summary, sort_keys=True, ensure_ascii=False), folder.parent),
        parameters=tuple(each for result in found for each in _parameters(result)),
        documents=documents,
        serial=row.serial or next((each.calibration.serial for each in found if each.calibration.serial), ""),
    )


def _documents(folder: Path) -> Iterator[dict[str, str]]:
    for path in sorted(folder.rglob("*")) if is_folder(folder) else ():
        if is_file(path) and path.suffix in (".yaml", ".csv", ".jsonl", ".json"):
            content = read_whole(path, _LARGEST_RESULT, "result")
            yield {
                "name": path.relative_to(folder).as_posix(),
                "sha256": hashlib.sha256(content).hexdigest(),
                "text": content.decode("utf-8", "backslashreplace"),
            }


def _results(
    folder: Path, documents: Iterable[Mapping[str, str]], written: Mapping[Path, object]
) -> Iterator[Any]:
    """Yields the calibrations among the files of a command; one that it still holds is not read again."""
    from tumble.laboratory.results import Result, read_result

    for each in documents:
        path = folder / each["name"]
        if isinstance(document := written.get(path), Calibration):
            yield Result(document, each["text"].encode(), None, each["name"])
        elif path.suffix == ".yaml" and KIND.begins(path):
            yield read_result(path)


def _parameters(result: Any) -> Iterator[dict[str, object]]:  # noqa: ANN401
    for each in result.parameters:
        yield {name: getattr(each, name) for name in ("name", "unit", "value", "u", "common")}


def _of_function(job: FleetJob, given: FleetInput, row: Outcome) -> Outcome:
    try:
        with contextlib.redirect_stdout(sys.stderr):  # standard output is that of the whole job
            found = function_of(job.procedure)(int(given.place), **job.options)
        summary = json.dumps(finite(found), sort_keys=True, ensure_ascii=False)
        summary.encode()
        verdict = str(found.get("verdict", "computed"))
    except TumbleError:
        raise
    except Exception as error:
        return _failure(row, f"{job.procedure} failed: {_words_of(error)}")
    return replace(row, summary=summary, verdict=verdict)


def function_of(name: str) -> Callable[..., Mapping[str, Any]]:
    """Imports `MODULE:FUNCTION`; raises `TumbleError` where there is none."""
    module, _, attribute = name.partition(":")
    try:
        found: Callable[..., Mapping[str, Any]] = getattr(import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise TumbleError(f"{name}: cannot be imported: {error}; check its name and PYTHONPATH") from error
    return found


def _failure(row: Outcome, failure: str, *, transient: bool = False) -> Outcome:
    return replace(row, exit_code=ExitCode.USER_ERROR, failure=shown(failure), transient=transient)


def _words_of(error: Exception) -> str:
    """Describes an error of code of others, which may have no words, or raise another when asked for them."""
    try:
        words = " ".join(str(error).split())
    except Exception:
        words = ""
    return ": ".join(filter(None, (type(error).__name__, in_utf8(words))))[:_LONGEST_MESSAGE]


def _without_paths(text: str, folder: Path) -> str:
    """Returns text in which the temporary folder is left out: each run has another."""
    return text.replace(f"{folder}/inputs/", "").replace(f"{folder}/", "").replace(str(folder), "")


@contextlib.contextmanager
def _dated(date: str) -> Iterator[None]:
    """States the date of the job as that of its results."""
    before = os.environ.get("SOURCE_DATE_EPOCH")
    os.environ["SOURCE_DATE_EPOCH"] = date
    try:
        yield
    finally:
        if before is None:
            del os.environ["SOURCE_DATE_EPOCH"]
        else:
            os.environ["SOURCE_DATE_EPOCH"] = before
