"""Record several units at once: every sample on the disk within two seconds, readable whatever happens."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Literal, TypeAlias

import numpy as np

from tumble import _core
from tumble.errors import LogError, OutputError
from tumble.file_names import SESSION_FILE
from tumble.files import prepare_folder
from tumble.live import FIRST_SAMPLE_WITHIN, LiveChunk, LiveSet, Source, SourceEvent
from tumble.logs import Facts
from tumble.logs.session import Session, SessionUnit, joined_file, recorded_so_far
from tumble.provenance import date_now
from tumble.record.parts import FURTHER, UnitParts, recorded
from tumble.record.session_files import hold, release, write_session
from tumble.words import join

FLUSH_EVERY = 1.0
"""s between two writings to the disk; half of what a kill may cost, as the writing takes time as well."""
REPORT_EVERY = 1.0
"""s between two reports of how far it is."""
SILENT_AFTER = 2.0
"""s without a sample after which a unit is called silent."""
REST_WINDOW = 2.5
"""s of the newest samples by which a unit is at rest or in motion."""
SHORTEST_REST = 1.0
"""s of rest at their end that count."""
SAME_START = 1.0
"""s to which two starts of one computer's clock agree unless it was started anew between."""

UnitCondition: TypeAlias = Literal["waiting", "rest", "motion", "silent", "lost"]
RecordStepKind: TypeAlias = Literal["recording", "progress", "lost", "returned", "silent", "done"]
EndReason: TypeAlias = Literal["duration", "count", "stopped", "end of sources"]


@dataclass(frozen=True, slots=True)
class UnitProgress:
    """How the recording of one unit goes."""

    name: str
    samples: int
    rate: float
    """Hz, gaps left out; NaN before it is known."""
    gaps: int
    missing: int
    """Samples that would fill the gaps."""
    condition: UnitCondition


@dataclass(frozen=True, slots=True)
class RecordStep:
    """What has just happened, and how far the recording is."""

    kind: RecordStepKind
    elapsed: float
    """s since it began."""
    units: tuple[UnitProgress, ...]
    bytes: int
    """On disk."""
    unit: str = ""
    """Of which unit it happened."""
    reason: str = ""
    """Why a source was lost, or the recording ended."""


@dataclass(slots=True)
class _Unit:
    """What is kept of one unit in memory."""

    parts: UnitParts
    heard: float
    samples: int = 0
    with_temperature: bool | None = None
    is_lost: bool = False
    is_silent: bool = False
    waiting: list[LiveChunk] = field(default_factory=list)
    """Samples that are not on disk."""
    newest: deque[LiveChunk] = field(default_factory=deque)
    """Samples of the last `REST_WINDOW`."""
    last: float = -math.inf
    """s of the session's clock, of the last sample that was recorded before."""


class Recorder:
    """Records a `LiveSet` into a folder: a context manager; exhaust `steps`.

    `sources` is what was typed for each unit, `serials` the serial numbers that are known. With `resume` a
    session that is there goes on; its units have to be the same.

    Raises `OutputError`, in one line, where the folder cannot be written to, or holds a session and `resume`
    was not asked for. What is on disk by then stays readable.
    """

    def __init__(
        self,
        units: LiveSet,
        folder: Path,
        *,
        sources: Mapping[str, str],
        serials: Mapping[str, str] | None = None,
        resume: bool = False,
    ) -> None:
        self._set = units
        self._folder = folder
        self._events: list[SourceEvent] = []
        units.on_event = self._events.append
        clock: Literal["host", "log"] = "log" if units.is_replay else "host"
        origin = time.time() - time.monotonic() if clock == "host" else 0.0
        described = tuple(
            SessionUnit(
                name=name, source=typed, serial=(serials or {}).get(name) or units.sources[name].serial
            )
            for name, typed in sources.items()
        )
        fresh = Session(
            started=date_now(),
            clock=clock,
            clock_origin=origin,
            units=described,
            software=f"tumble {_core.__version__}",
        )
        prepare_folder(folder)
        self._held = hold(folder)
        try:
            self._session = _resumed(folder, fresh) if resume else _begun(folder, fresh)
        except BaseException:
            release(self._held)
            raise
        moved = origin - self._session.clock_origin
        self._shift = moved if abs(moved) > SAME_START else 0.0
        """s to add to the time of this computer's clock, if that was started anew since the session began."""
        self._units = {
            name: _Unit(UnitParts(folder, name, _facts(unit, source)), math.inf)
            for unit, (name, source) in zip(described, units.sources.items(), strict=True)
        }
        if resume:
            self._go_on()
        self._disk = ThreadPoolExecutor(1)
        """Writes: the sources go on being read while the disk takes its time."""
        self._writing: Future[None] | None = None
        self._bytes = 0
        self._began = math.nan
        self._newest, self._oldest = -math.inf, math.inf
        self._stopped = False
        self._reason: EndReason | None = None

    def __enter__(self) -> Recorder:
        write_session(self._folder, self._session)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._disk.shutdown()
        release(self._held)

    def stop(self) -> None:
        """Have `steps` come to its end soon; may be called by a handler of signals."""
        self._stopped = True

    def steps(self, duration: float | None = None, count: int | None = None) -> Iterator[RecordStep]:
        """Record until the set ends, for `duration` s, until each unit has `count` samples, or until `stop`.

        Raises `LogError` where a source cannot be opened, `OutputError` where the disk is full.
        """
        try:
            yield from self._steps(duration, count)
        except OutputError as error:
            raise OutputError(f"{error}; what was recorded is readable, and --resume adds to it") from error

    def _steps(self, duration: float | None, count: int | None) -> Iterator[RecordStep]:
        with self._set as units:
            self._began = now = time.monotonic()
            for unit in self._units.values():
                unit.heard = now
            flush_at, report_at = now + FLUSH_EVERY, now + REPORT_EVERY
            yield self._step("recording")
            for name, chunk in units:
                yield from self._what_happened()
                if len(chunk):
                    self._take(self._units[name], chunk, count)
                now = time.monotonic()
                if now >= flush_at:
                    self._flush()
                    flush_at = now + FLUSH_EVERY
                if now >= report_at:
                    yield from self._silences(now)
                    yield self._step("progress")
                    report_at = now + REPORT_EVERY
                self._reason = self._end(duration, count)
                if self._reason is not None:
                    break
            self._finish(self._reason or "end of sources")
        yield self._step("done", reason=self._reason or "end of sources")

    @property
    def session(self) -> Session:
        """What `session.yaml` says."""
        return self._session

    def _go_on(self) -> None:
        for name, unit in self._units.items():
            before = recorded_so_far(self._folder, name)
            if before.samples:
                unit.last, unit.with_temperature = before.last, before.has_temperature

    def _take(self, unit: _Unit, chunk: LiveChunk, count: int | None) -> None:
        if chunk.time[0] + self._shift <= unit.last:
            raise LogError(
                f"{unit.parts.name}: samples are older than those that were recorded before: the clock was "
                "set back, or the same log comes again; record into another folder"
            )
        if count is not None:
            chunk = chunk.part(slice(max(0, count - unit.samples)))
        if not len(chunk):
            return
        if unit.with_temperature is None:
            unit.with_temperature = chunk.temperature is not None
        unit.samples += len(chunk)
        unit.heard, unit.is_silent = time.monotonic(), False
        unit.waiting.append(chunk)
        unit.newest.append(chunk)
        while len(unit.newest) > 1 and chunk.time[-1] - unit.newest[0].time[-1] > REST_WINDOW:
            unit.newest.popleft()
        self._oldest = min(self._oldest, float(chunk.time[0]))
        self._newest = max(self._newest, float(chunk.time[-1]))

    def _flush(self) -> None:
        """Have written what waits, if what waited before is; raises what went wrong with that."""
        if self._writing is not None:
            if not self._writing.done():
                return
            self._writing.result()
        self._writing = self._disk.submit(self._write, self._taken())

    def _taken(self) -> list[tuple[_Unit, list[LiveChunk]]]:
        """Take what waits to be written."""
        taken = [(unit, unit.waiting) for unit in self._units.values() if unit.waiting]
        for unit, _ in taken:
            unit.waiting = []
        return taken

    def _write(self, taken: Sequence[tuple[_Unit, list[LiveChunk]]]) -> None:
        for unit, waiting in taken:
            unit.parts.write(recorded(waiting, bool(unit.with_temperature), self._shift))
        self._bytes = sum(unit.parts.size for unit in self._units.values())

    def _finish(self, reason: EndReason) -> None:
        """Write the rest, join the parts, and say in `session.yaml` how it ended."""
        if self._writing is not None:
            self._writing.result()
        self._write(self._taken())
        for unit in self._units.values():
            unit.parts.finish()
        remarks = self._set.remarks
        described = tuple(
            unit.model_copy(
                update={
                    "samples": (unit.samples or 0) + self._units[unit.name].samples,
                    "remarks": tuple(dict.fromkeys((*unit.remarks, *remarks[unit.name]))),
                }
            )
            for unit in self._session.units
        )
        self._session = self._session.model_copy(
            update={"ended": date_now(), "reason": reason, "units": described}
        )
        write_session(self._folder, self._session)
        self._bytes = sum(unit.parts.size for unit in self._units.values())

    def _end(self, duration: float | None, count: int | None) -> EndReason | None:
        if self._stopped:
            return "stopped"
        if duration is not None and self._elapsed >= duration:
            return "duration"
        if count is not None and all(unit.samples >= count for unit in self._units.values()):
            return "count"
        return None

    @property
    def _elapsed(self) -> float:
        if self._session.clock == "log":
            return max(0.0, self._newest - self._oldest)
        return time.monotonic() - self._began

    def _what_happened(self) -> Iterator[RecordStep]:
        while self._events:
            event = self._events.pop(0)
            self._units[event.name].is_lost = event.kind == "lost"
            yield self._step(event.kind, event.name, event.reason)

    def _silences(self, now: float) -> Iterator[RecordStep]:
        """Say once of each silence that there is one."""
        for name, unit in self._units.items():
            patience = SILENT_AFTER if unit.samples else FIRST_SAMPLE_WITHIN
            if now - unit.heard > patience and not (unit.is_silent or unit.is_lost):
                unit.is_silent = True
                yield self._step("silent", name)

    def _step(self, kind: RecordStepKind, unit: str = "", reason: str = "") -> RecordStep:
        progress = tuple(self._progress(name) for name in self._units)
        return RecordStep(kind, self._elapsed, progress, self._bytes, unit, reason)

    def _progress(self, name: str) -> UnitProgress:
        unit, timing = self._units[name], self._set.timing[name]
        return UnitProgress(
            name, unit.samples, 1.0 / timing.interval, timing.gaps, timing.missing, _condition(unit)
        )


def finish_session(folder: Path) -> Session:
    """Join what a recording left that was killed; raises `OutputError` where one still runs."""
    session = Session.load(folder)
    held = hold(folder)
    try:
        units = []
        for unit in session.units:
            UnitParts(folder, unit.name, Facts()).finish()
            samples = recorded_so_far(folder, unit.name).samples
            units.append(unit.model_copy(update={"samples": samples}))
        ended = {} if session.ended else {"ended": date_now(), "reason": "killed"}
        session = session.model_copy(update={"units": tuple(units), **ended})
        write_session(folder, session)
    finally:
        release(held)
    return session


def _facts(unit: SessionUnit, source: Source) -> Facts:
    corrected = "by the source" if source.already_corrected else ""
    return Facts(serial=unit.serial, corrected=corrected, further=FURTHER)


def _begun(folder: Path, fresh: Session) -> Session:
    if (folder / SESSION_FILE).exists():
        raise OutputError(
            f"{folder}: holds a session already; add to it with --resume, or give another folder"
        )
    for unit in fresh.units:
        if (there := joined_file(folder, unit.name)).exists():
            raise OutputError(f"{there}: is there already and no part of a session; give another folder")
    return fresh


def _resumed(folder: Path, fresh: Session) -> Session:
    if not (folder / SESSION_FILE).exists():
        raise OutputError(f"{folder}: holds no session that could go on; leave out --resume")
    before = Session.load(folder)
    if set(before.names) != {unit.name for unit in fresh.units}:
        raise OutputError(
            f"{folder}: the session is of {join(before.names)}; name the same units, or give another folder"
        )
    if before.clock != fresh.clock:
        raise OutputError(
            f"{folder}: live units and replayed logs share no clock; record them into folders of their own"
        )
    counted = tuple(
        unit.model_copy(update={"samples": recorded_so_far(folder, unit.name).samples})
        for unit in before.units
    )
    return before.model_copy(update={"ended": None, "reason": None, "units": counted})


def _condition(unit: _Unit) -> UnitCondition:
    if unit.is_lost:
        return "lost"
    if not unit.samples:
        return "waiting"
    if unit.is_silent:
        return "silent"
    segmenter = _core.Segmenter(SHORTEST_REST)
    time_ = np.concatenate([chunk.time for chunk in unit.newest])
    segmenter.push(
        time_,
        np.concatenate([chunk.accelerometer for chunk in unit.newest]),
        np.concatenate([chunk.gyroscope for chunk in unit.newest]),
    )
    rests = segmenter.finish().rest_times
    rests_now = len(rests) > 0 and time_[-1] - rests[-1, 1] < SHORTEST_REST
    return "rest" if rests_now else "motion"
