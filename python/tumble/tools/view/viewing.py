"""Recordings that are shown together: opened as typed, then read, marked and inspected in the background."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

from tumble.calibration.document import Calibration
from tumble.calibration.start import calibration_of
from tumble.foundation.errors import LogError, TumbleError
from tumble.foundation.file_names import SESSION_FILE
from tumble.foundation.file_status import is_file, is_folder
from tumble.foundation.log_time import LogTime
from tumble.foundation.provenance import log_digest
from tumble.foundation.recording import Recording
from tumble.foundation.serials import are_of_two
from tumble.logs import ReadOptions, list_imus, open_recording, parse_spec
from tumble.tools.apply.procedure import warnings_on
from tumble.tools.inspect.procedure import inspect
from tumble.tools.view.marks import SegmentMark, acquired_of, in_order, marks_of
from tumble.tools.view.result_file import ResultFile, is_result, results_in
from tumble.tools.view.samples import KeptSamples

if TYPE_CHECKING:
    from tumble.tools.inspect.result import Inspection

Stage: TypeAlias = Literal["waiting", "reading", "marking", "inspecting", "done", "failed"]
MOST_UNITS = 16
"""Units that are shown together."""


@dataclass(slots=True)
class ViewedUnit:
    """A unit that is shown."""

    source: str
    """LOG or LOG:NAME, by which commands open it."""
    samples: KeptSamples
    result: ResultFile | None = None
    stage: Stage = "waiting"
    share: float | None = None
    """Share of the samples that was read; None where that is not known."""
    problem: str = ""
    """Reason why it could not be read to its end."""
    marks: tuple[SegmentMark, ...] = ()
    inspection: Inspection | None = None
    remarks: list[str] = field(default_factory=list)
    """Remarks on the unit beside those of the inspection."""

    @property
    def name(self) -> str:
        """Short name."""
        return self.samples.name


class Viewing:
    """Units that are shown on one axis of time."""

    def __init__(self, title: str, units: Sequence[ViewedUnit], read: ReadOptions | None = None) -> None:
        self.title = title
        self.units = tuple(units)
        self.read_options = read or ReadOptions()
        self.version = 0
        """Grows with everything that is found."""
        self.remarks: list[str] = []
        self._users = 0
        self._is_closed = False
        self._lock = threading.Lock()

    @contextmanager
    def in_use(self) -> Iterator[None]:
        """Keeps the samples while the block runs, whoever closes it meanwhile."""
        self.enter()
        try:
            yield
        finally:
            self.leave()

    def enter(self) -> None:
        """Keeps the samples until `leave`."""
        with self._lock:
            self._users += 1

    def leave(self) -> None:
        """Ends one use."""
        with self._lock:
            self._users -= 1
            self._free_unused()

    @property
    def duration(self) -> float:
        """Time shown of the last sample so far, s."""
        return max((unit.samples.duration for unit in self.units), default=0.0)

    @property
    def is_done(self) -> bool:
        """Returns whether nothing more is to be found."""
        return all(unit.stage in ("done", "failed") for unit in self.units)

    @property
    def date(self) -> str:
        """Date at which the first unit began; empty where its stamps are no dates."""
        starts = [LogTime(unit.samples.start).date for unit in self.units if len(unit.samples)]
        return starts[0] if starts else ""

    def gather(self) -> None:
        """Reads, marks and inspects all units; problems of a unit are kept with it."""
        with self.in_use():
            if not self._is_closed:
                self._gather()

    def _gather(self) -> None:
        for unit in self.units:
            self._within(unit, self._read)
        self._align()
        for step in (self._mark, self._inspect, self._compare):
            for unit in self.units:
                self._within(unit, step)
        for unit in self.units:
            self._enter(unit, "failed" if unit.problem else "done")

    def _within(self, unit: ViewedUnit, step: object) -> None:
        if unit.problem:
            return
        try:
            assert callable(step)
            step(unit)
        except TumbleError as error:
            unit.problem = str(error)
            self._enter(unit, "failed")

    def _enter(self, unit: ViewedUnit, stage: Stage) -> None:
        unit.stage = stage
        self.version += 1

    def _read(self, unit: ViewedUnit) -> None:
        self._enter(unit, "reading")

        def progress(done: int, expected: int | None) -> None:
            unit.share = done / expected if expected else None

        unit.samples.read(progress)
        if not len(unit.samples):
            raise LogError("holds no samples", about=unit.source)

    def _align(self) -> None:
        """Puts units with one clock on one axis; others begin at zero each."""
        clocks: dict[str, list[KeptSamples]] = {}
        for unit in self.units:
            if len(unit.samples):
                clocks.setdefault(unit.samples.recording.metadata.clock, []).append(unit.samples)
        for clock, samples in clocks.items():
            first = min(each.start for each in samples)
            for each in samples if clock else ():
                each.offset = each.start - first
        if len(clocks) > 1 or (len(self.units) > 1 and "" in clocks):
            self.remarks.append("the units have no common clock: each begins at its own first sample")

    def _mark(self, unit: ViewedUnit) -> None:
        self._enter(unit, "marking")
        unit.marks = marks_of(unit.samples, acquired_of(unit.samples))
        if unit.result is not None:
            self._mark_used(unit, unit.result)

    def _mark_used(self, unit: ViewedUnit, result: ResultFile) -> None:
        """Marks the rests as the result has them: by their times, or by their numbers."""
        if result.rests:
            unit.marks = in_order(_used_marks(unit.samples, result))
            return
        numbers = result.numbers
        if not numbers:
            return
        if _rests_in(unit.marks) != max(numbers):
            by_hand = marks_of(unit.samples, acquired_of(unit.samples, by_hand=True))
            if _rests_in(by_hand) != max(numbers):
                unit.remarks.append(
                    f"the result numbers {max(numbers)} rests, the recording shows {_rests_in(unit.marks)}: "
                    "which were used is not marked"
                )
                return
            unit.marks = by_hand
        unit.marks = tuple(
            replace(mark, used=False, remark="not used by the result")
            if mark.kind == "rest" and int(mark.label) not in numbers
            else mark
            for mark in unit.marks
        )

    def _inspect(self, unit: ViewedUnit) -> None:
        self._enter(unit, "inspecting")
        unit.inspection = inspect(unit.samples.kept())

    def _compare(self, unit: ViewedUnit) -> None:
        """Notes where log and calibration do not belong together."""
        about, calibration = unit.samples.recording.metadata, unit.samples.calibration
        if calibration is not None:
            unit.remarks += warnings_on(
                calibration, what="log", name=about.name, serial=about.serial, triads=about.triads
            )
        if unit.result is not None and unit.result.sha256:
            path = parse_spec(unit.source).path
            if log_digest(path) != unit.result.sha256:
                unit.remarks.append(
                    f"{path.name} is not, or no longer, the log that the result was found from"
                )
        self.version += 1

    def close(self) -> None:
        """Gives the disk free, once nobody uses the samples any more."""
        with self._lock:
            self._is_closed = True
            self._free_unused()

    def _free_unused(self) -> None:
        if self._is_closed and not self._users:
            for unit in self.units:
                unit.samples.close()


def _rests_in(marks: Sequence[SegmentMark]) -> int:
    return sum(mark.kind == "rest" for mark in marks)


def _used_marks(samples: KeptSamples, result: ResultFile) -> Iterator[SegmentMark]:
    rests = sorted(result.rests, key=lambda rest: rest.start)
    before: SegmentMark | None = None
    number = 0
    for rest in rests:
        number += rest.used
        label = str(number) if rest.used else ""
        start, end = samples.shown_time(rest.start), samples.shown_time(rest.end)
        mark = SegmentMark("rest", start, end, label, rest.remark, used=rest.used)
        if before is not None and rest.used and start > before.end:
            yield SegmentMark("turn", before.end, start, f"{before.label}-{label}")
        yield mark
        before = mark if rest.used else before


def open_viewing(
    sources: Sequence[str],
    *,
    calibrations: Sequence[Path] = (),
    log: str | None = None,
    read: ReadOptions | None = None,
) -> Viewing:
    """Opens logs, sessions and results to be shown together; their samples are not read yet.

    Each of `calibrations` corrects the unit of its serial number or name; a single one of a single unit
    corrects that. `log` is where a result's log is, if it is not near it.

    Raises `TumbleError`, in one line, where something cannot be opened.
    """
    read = read or ReadOptions()
    loaded = [Calibration.load(path) for path in calibrations]
    units = [unit for source in sources for unit in _units_of(source, loaded, log, read)]
    if len(units) > MOST_UNITS:
        raise LogError(
            f"{len(units)} units are too many to show together; name at most {MOST_UNITS}, LOG:NAME"
        )
    if len(loaded) == 1 and len(units) == 1:
        about = units[0].samples.recording.metadata
        if not are_of_two(loaded[0].serial, about.serial):
            units[0].samples.calibration = loaded[0]
    for unit in units:
        how = unit.samples.recording.metadata.reading
        calibration_of(unit.samples.calibration, reading=how, about=unit.source)
    used = {id(unit.samples.calibration) for unit in units}
    for path, calibration in zip(calibrations, loaded, strict=True):
        if id(calibration) not in used:
            raise LogError(
                f"{path}: is of unit {calibration.serial or calibration.name}, which is none of those shown; "
                "give the calibration of one of them"
            )
    return Viewing(_title(sources), units, read)


def _title(sources: Sequence[str]) -> str:
    """Names what is shown, without folders."""
    first = Path(sources[0]).name or sources[0]
    return first if len(sources) == 1 else f"{first} and {len(sources) - 1} more"


def _units_of(
    source: str, calibrations: Sequence[Calibration], log: str | None, read: ReadOptions
) -> Iterator[ViewedUnit]:
    spec = parse_spec(source)
    if _holds_results(spec.path):
        for result in results_in(spec.path):
            yield _unit_of_result(result, log, read)
        return
    wanted = spec.imu or read.topic
    for imu in (wanted,) if wanted else list_imus(spec.path, read):
        typed = f"{spec.path}:{imu}" if imu and not read.topic else str(spec.path)
        recording = open_recording(typed, read)
        yield ViewedUnit(typed, KeptSamples(recording, _calibration_of(recording, calibrations)))


def _holds_results(path: Path) -> bool:
    if is_folder(path) and not is_file(path / SESSION_FILE):
        return any(is_result(each) for each in path.glob("*.yaml"))
    return is_result(path)


def _unit_of_result(result: ResultFile, log: str | None, read: ReadOptions) -> ViewedUnit:
    if log is None:
        spec = result.find_log()
        source = f"{spec.path}:{spec.imu}" if spec.imu else str(spec.path)
    else:
        source = log
    recording = open_recording(source, read)
    return ViewedUnit(source, KeptSamples(recording, result.calibration), result)


def _calibration_of(recording: Recording, calibrations: Sequence[Calibration]) -> Calibration | None:
    """Returns the calibration of a unit: of its serial number where both state one, else of its name."""
    about = recording.metadata
    for each in calibrations:
        if each.serial == about.serial if each.serial and about.serial else each.name == about.name:
            return each
    return None
