"""A batch from logs to files: targets are read, calibrated and written one after another.

Logs are read in threads and pages drawn in processes, some targets ahead of the one that is written, so that
memory does not grow with the batch, and what is done stays done however the run ends.
"""

from __future__ import annotations

import hashlib
import json
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from pathlib import Path
from typing import Any, Literal, TypeVar

from tumble.calibration.document import KIND
from tumble.foundation.errors import ProcedureError, TumbleError
from tumble.foundation.file_names import SUMMARY, TURNTABLE_PAGE
from tumble.foundation.files import PAGE, prepare_folder, write_text
from tumble.foundation.plain import finite
from tumble.foundation.provenance import Provenance, log_digest
from tumble.foundation.words import utf8
from tumble.logs import parse_spec
from tumble.logs.options import ReadOptions
from tumble.poses.pose_list import PoseList
from tumble.procedures.turntable.batch import CALIBRATION_ENDING, PAGE_ENDING, Batch
from tumble.procedures.turntable.procedure import (
    TurntableSession,
    UnitRead,
    refuse_if_all_failed,
    serial_of,
    with_serial,
)
from tumble.procedures.turntable.record import TargetRecord
from tumble.procedures.turntable.report.pages import drawing_processes, render_batch, render_target
from tumble.procedures.turntable.report.records import record_of
from tumble.procedures.turntable.result import GOOD, TargetResult, TurntableResult
from tumble.procedures.turntable.summary import write_summary
from tumble.procedures.turntable.targets import TargetLog

Pages = Literal["all", "failed", "none"]
Item = TypeVar("Item")
Result = TypeVar("Result")

MOST_PAGES = 50
"""Targets up to which each has a page if nothing is stated; of more, those that failed."""
FIRST = 50
"""Targets that are read before anything is written: if one of them is the true reference, nothing is."""
AHEAD = 4
"""Targets a worker is ahead of what is written."""
FEWEST_FOR_PROCESSES = 60
"""Targets below which one process is done before others have started."""


@dataclass(frozen=True, slots=True)
class Production:
    """Inputs and options that all targets of a run share."""

    session: TurntableSession
    batch: Batch
    pages: Pages
    options: Callable[[str], ReadOptions | None]
    """Options for reading a log."""
    key: str
    """Key of the inputs that all targets of the run share."""
    jobs: int
    resume: bool
    serials: dict[str, str] = field(default_factory=dict)
    """Targets of this run by serial."""
    results: dict[str, TargetResult] | None = None
    """Results of this run by what names the recording; None where they are not kept."""

    def run(self, targets: Sequence[TargetLog]) -> Iterator[Made]:
        """Calibrates and writes one target after the other, in their order.

        Raises `TumbleError` where nothing can be done, or one of the first targets must be the reference, and
        nothing is written then; `OutputError` where a file cannot be written.
        """
        workers = min(self.jobs, len(targets) // FEWEST_FOR_PROCESSES + 1)
        with ThreadPoolExecutor(self.jobs) as readers, _printers(workers) as printers:
            read = ahead(readers, self._read, targets, AHEAD * self.jobs)
            calibrated = self._after_the_first_of_use(map(self._calibrate, self._none_swapped(read)))
            for printed in ahead(printers, print_target, map(self._order, calibrated), AHEAD * workers):
                yield keep(self.batch, printed)

    def _read(self, target: TargetLog) -> ReadTarget:
        read = self.options(target.source)
        try:
            key = self._key(target, read)
        except (OSError, TumbleError):
            key = ""
        if self.resume and key and self.batch.is_done(target.name, key, page=self.pages == "all"):
            return ReadTarget(target, key, None)
        return ReadTarget(target, key, self.session.acquire(target.source, read))

    def _key(self, target: TargetLog, read: ReadOptions | None) -> str:
        imu = parse_spec(target.source).imu
        return digest_of(
            [self.key, log_digest(parse_spec(target.source).path), imu, target.name, target.serial, read]
        )

    def _none_swapped(self, read: Iterator[ReadTarget]) -> Iterator[ReadTarget]:
        first = list(islice(read, FIRST))
        for found in first:
            if found.unit is not None and (why := self.session.why_swapped(found.unit)):
                raise ProcedureError(why)
        yield from first
        for found in read:
            why = self.session.why_swapped(found.unit) if found.unit is not None else ""
            yield replace(found, unit=ProcedureError(why)) if why else found

    def _calibrate(self, found: ReadTarget) -> Calibrated:
        target, unit = found.target, found.unit
        if unit is None:
            return Calibrated(found, None)
        made = self.session.provenance
        provenance = Provenance(made.date, target.operator or made.operator, target.station or made.station)
        known = unit if isinstance(unit, TumbleError) else self._identified(target, unit)
        return Calibrated(found, self.session.calibrate(target.name, known, provenance))

    def _identified(self, target: TargetLog, unit: UnitRead) -> UnitRead:
        """Returns a unit its serial; an error where that of another target is the same.

        Raises `ProcedureError` where the folder holds another unit of that name.
        """
        serial = target.serial or serial_of(unit)
        refuse_namesake(self.batch, target.name, serial)
        bearer = self.batch.bearer(serial) or self.serials.setdefault(serial, target.name)
        if serial and bearer != target.name:
            return ProcedureError(
                f"states serial {serial}, which is that of {bearer} in this batch; correct one of them, or "
                "name targets by --name-by serial",
                about=target.name,
            )
        return with_serial(unit, serial)

    def _after_the_first_of_use(self, results: Iterator[Calibrated]) -> Iterator[Calibrated]:
        """Holds back failures until a target is calibrated or has obsolete results here."""
        failed: list[Calibrated] = []
        for each in results:
            if each.result is None or not each.result.failure or each.result.name in self.batch.last:
                yield from chain(failed, [each])
                break
            failed.append(each)
        else:
            refuse_if_all_failed([each.result for each in failed if each.result])
        yield from results

    def _order(self, each: Calibrated) -> PrintOrder | PrintedPages:
        target, result = each.read.target, each.result
        if result is None:
            return PrintedPages(self.batch.record(target.name), fresh=False)
        if self.results is not None:
            self.results[target.source] = result
        wanted = self.pages == "all" or (self.pages == "failed" and result.verdict not in GOOD)
        return PrintOrder(self.session.batch, result, each.read.key, wanted, target.columns)


@dataclass(frozen=True, slots=True)
class ReadTarget:
    """A target with what was read of it: None if it is done already, the error if it could not be read."""

    target: TargetLog
    key: str
    unit: UnitRead | None


@dataclass(frozen=True, slots=True)
class Calibrated:
    """A target with its result; None if it is done already."""

    read: ReadTarget
    result: TargetResult | None


@dataclass(frozen=True, slots=True)
class PrintOrder:
    """Inputs for printing the files of a target."""

    batch: TurntableResult
    """Results that it shares with all targets."""
    target: TargetResult
    key: str
    page: bool
    columns: dict[str, str]


@dataclass(frozen=True, slots=True)
class PrintedPages:
    """The files of a target as text, empty where it has none, and its record."""

    record: TargetRecord
    fresh: bool
    calibration: str = ""
    content: dict[str, Any] | None = None
    """Content of the calibration."""
    page: str = ""


@dataclass(frozen=True, slots=True)
class Made:
    """A target of a run as it stands in the batch now."""

    record: TargetRecord
    calibration: dict[str, Any] | None
    """Content of its calibration file, where this run made one."""
    fresh: bool
    """False where it was done and unchanged."""
    moved: tuple[Path, ...]
    """New places of files of an earlier attempt that this one did not replace."""


def refuse_namesake(batch: Batch, name: str, serial: str) -> None:
    """Raises `ProcedureError` where the folder holds another unit of that name."""
    if other := batch.namesake(name, serial):
        raise ProcedureError(
            f"{batch.folder} holds results of serial {other} under the name {name}, and this "
            f"log states {serial}; choose another folder, or name targets by --name-by serial"
        )


def keep(batch: Batch, printed: PrintedPages) -> Made:
    """Writes the files of a target into the folder of the batch, and then its record."""
    record = printed.record
    if not printed.fresh:
        return Made(record, None, False, ())
    stem = batch.stem(record.target)
    record = replace(record, stem=stem, attempt=batch.attempt(record.target))
    moved = batch.set_aside(
        record.target, stem, calibration=bool(printed.calibration), page=bool(printed.page)
    )
    if printed.calibration:
        write_text(batch.folder / f"{stem}{CALIBRATION_ENDING}", printed.calibration, KIND)
    if printed.page:
        write_text(batch.folder / f"{stem}{PAGE_ENDING}", printed.page, PAGE)
    batch.add(record)
    return Made(record, printed.content, True, tuple(moved))


def pages_for(targets: int) -> Pages:
    """Returns the targets with a page, of so many, if nothing is stated."""
    return "all" if targets <= MOST_PAGES else "failed"


def save(result: TurntableResult, folder: Path | str) -> dict[str, Path]:
    """Writes a result as the command does: into the batch of `folder`; returns each path by what it is.

    Raises `ProcedureError` where the folder holds another unit of the same name, `OutputError` where a file
    cannot be written.
    """
    batch = Batch(prepare_folder(folder))
    for target in result.targets:
        refuse_namesake(batch, target.name, target.serial)
    shared, pages = replace(result, targets=()), pages_for(len(result.targets))
    for target in result.targets:
        wanted = pages == "all" or target.verdict not in GOOD
        keep(batch, print_target(PrintOrder(shared, target, "", wanted, {})))
    saved = [target.name for target in result.targets if not target.failure]
    calibrations = {name: batch.folder / f"{batch.stem(name)}{CALIBRATION_ENDING}" for name in saved}
    return calibrations | write_views(shared, batch)


def write_views(shared: TurntableResult, batch: Batch) -> dict[str, Path]:
    """Writes summary and report of all targets in the folder; returns the path of each file by what it is."""
    batch.drop_lost_lines()
    summary, report = batch.folder / SUMMARY, batch.folder / TURNTABLE_PAGE
    write_summary(summary, batch.latest)
    write_text(report, render_batch(shared, batch.latest()), PAGE, renews=True)
    return {"batch": batch.path, "summary": summary, "report": report}


def key_of_run(
    session: TurntableSession, poses: PoseList | None, read: ReadOptions | None, latitude: float | None
) -> str:
    """Returns one digest of all that every result of a run follows from, besides the target's own log."""
    batch, certificate = session.batch, session.batch.reference.certificate
    listed = [[pose.name, pose.up, pose.file] for pose in poses] if poses else None
    return digest_of(
        [
            batch.software,
            batch.truth,
            batch.gravity,
            latitude,
            batch.options,
            batch.limits,
            batch.reference.log.sha256,
            batch.reference.calibration_hash,
            certificate.content() if certificate is not None else None,
            listed,
            read,
        ]
    )


def digest_of(content: object) -> str:
    """SHA-256 of plain data, in hexadecimal."""
    return hashlib.sha256(json.dumps(finite(content), sort_keys=True).encode()).hexdigest()


def ahead(
    pool: Executor, function: Callable[[Item], Result], items: Iterable[Item], most: int
) -> Iterator[Result]:
    """Applies a function in a pool, in order, at most so many items ahead of the one that is asked for."""
    waiting: deque[Future[Result]] = deque()
    source = iter(items)
    try:
        while True:
            waiting.extend(pool.submit(function, item) for item in islice(source, most - len(waiting)))
            if not waiting:
                return
            yield waiting.popleft().result()
    finally:
        for each in waiting:
            each.cancel()


class _Here(Executor):
    """Does at once, in this process, what it is asked for."""

    def submit(self, function: Callable[..., Result], /, *arguments: Any, **named: Any) -> Future[Result]:  # noqa: ANN401
        done: Future[Result] = Future()
        done.set_result(function(*arguments, **named))
        return done


def _printers(workers: int) -> Executor:
    return _Here() if workers == 1 else drawing_processes(workers)


def print_target(order: PrintOrder | PrintedPages) -> PrintedPages:
    """Prints the files of a target, and what is to be recorded of it, unless that is done already."""
    if isinstance(order, PrintedPages):
        return order
    batch, target = order.batch, order.target
    calibration = None if target.failure else batch.calibration_of(target)
    text = calibration.text() if calibration else ""
    page = render_target(batch, target) if order.page else ""
    record = record_of(
        batch,
        target,
        "",
        key=order.key,
        calibration_sha256=hashlib.sha256(utf8(text)).hexdigest() if text else "",
        page=order.page,
        columns=order.columns,
    )
    return PrintedPages(record, True, text, calibration.content() if calibration else None, page)
