"""Writes a session: samples of each unit soon on disk, joined at the end, and `session.yaml` beside them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import TracebackType
from typing import Literal, TypeAlias

from tumble import _core
from tumble.foundation import clock
from tumble.foundation.documents import document_kind
from tumble.foundation.errors import LogError, OutputError
from tumble.foundation.file_names import SESSION_FILE
from tumble.foundation.file_status import exists
from tumble.foundation.files import hold_folder, missing_folders, prepare_folder, remove_empty, remove_made
from tumble.foundation.provenance import date_now
from tumble.foundation.words import join
from tumble.live import LiveChunk, Source
from tumble.logs import Facts
from tumble.logs.session import (
    SCHEMA,
    Session,
    SessionClock,
    SessionProcedure,
    SessionUnit,
    joined_file,
    recorded_so_far,
)
from tumble.tools.record.parts import COLUMN_OF, OPTIONAL, UnitParts, optional_columns, recorded
from tumble.tools.record.session_files import write_session

FLUSH_EVERY = 1.0
"""s between two writings to the disk; half of what a kill may cost, as the writing takes time as well."""
SAME_START = 1.0
"""s to which two starts of one computer's clock agree unless it was started anew between."""

EndReason: TypeAlias = Literal["duration", "count", "stopped", "end of sources", "done", "failed", "killed"]


@dataclass(frozen=True, slots=True)
class RecordedUnit:
    """A unit to be recorded."""

    source: Source
    typed: str
    """Source as typed by the user."""
    serial: str = ""
    """Serial number, where the source does not state it."""

    def described(self, name: str) -> SessionUnit:
        """Returns its entry in `session.yaml`."""
        serial = self.serial or getattr(self.source, "serial", "")
        return SessionUnit(name=name, source=self.typed, serial=serial)


@dataclass(slots=True)
class _Unit:
    """Samples of one unit in memory."""

    parts: UnitParts
    samples: int = 0
    optional: tuple[str, ...] | None = None
    """Columns that this unit has and others may not, once they are known."""
    waiting: list[LiveChunk] = field(default_factory=list)
    """Samples that are not on disk."""
    last: float = -math.inf
    """s of the session's clock, of the last sample that was recorded before."""


class SessionWriter:
    """Writes samples as they come: a context manager; call `take` and `flush` while they do, then `finish`.

    `times` is the clock of the samples, and `clock_rate` as in `Session`. With `resume` a session that is
    there goes on; its units have to be the same. Left with an error, what was taken is written and the
    session ends as failed.

    Raises `OutputError`, in one line, where the folder cannot be written to, or holds a session and `resume`
    was not asked for. The files on disk stay readable.
    """

    def __init__(
        self,
        folder: Path,
        units: Mapping[str, RecordedUnit],
        times: SessionClock,
        *,
        resume: bool = False,
        clock_rate: float = 1.0,
    ) -> None:
        origin = clock.utc() - clock.now() if times == "host" else 0.0
        fresh = Session(
            started=date_now(),
            clock=times,
            clock_origin=origin,
            clock_rate=clock_rate,
            units=tuple(unit.described(name) for name, unit in units.items()),
            software=f"tumble {_core.__version__}",
        )
        self._missing = missing_folders(folder)
        """Folders that were not there before."""
        self._folder = prepare_folder(folder)
        self._release = hold_folder(self._folder)
        try:
            self.session = _resumed(folder, fresh) if resume else _begun(folder, fresh)
            write_session(folder, self.session)
        except BaseException:
            self._release()
            raise
        moved = origin - self.session.clock_origin
        self._shift = moved if abs(moved) > SAME_START else 0.0
        """s to add to the time of this computer's clock, if that was started anew since the session began."""
        self._units = {
            unit.name: _Unit(UnitParts(folder, unit.name, _facts(unit, units[unit.name].source)))
            for unit in fresh.units
        }
        self._sources = {name: unit.source for name, unit in units.items()}
        if resume:
            self._go_on()
        self._disk = clock.executor("disk")
        """Writes: sources go on being read while the disk takes its time."""
        self._writing: Future[None] | None = None
        self._flush_at = clock.now() + FLUSH_EVERY
        self.bytes = 0
        """Bytes on disk."""

    def __enter__(self) -> SessionWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            # A failed write is not repeated.
            if error is not None and not isinstance(error, OutputError):
                self._end_failed()
        finally:
            self._disk.shutdown()
            self._release()
            if not exists(self._session_file):
                remove_empty(self._missing)

    @property
    def _session_file(self) -> Path:
        return self._folder / SESSION_FILE

    def samples(self, name: str) -> int:
        """Returns how many samples of a unit were taken since this began."""
        return self._units[name].samples

    def describe(self, procedure: SessionProcedure) -> None:
        """Stores the purpose of the recording in `session.yaml`, at once and after each change."""
        self.session = self.session.model_copy(update={"procedure": procedure})
        write_session(self._folder, self.session)

    def take(self, name: str, chunk: LiveChunk) -> LiveChunk:
        """Adds samples, at least one, and returns them as they are recorded.

        Raises `LogError` where they are older than what was recorded.
        """
        unit = self._units[name]
        if chunk.time[0] + self._shift <= unit.last:
            raise LogError(
                f"{name}: samples are older than those that were recorded before: the clock was set back, or "
                "the same log comes again; record into another folder"
            )
        if unit.optional is None:
            unit.optional = optional_columns(chunk)
        unit.samples += len(chunk)
        unit.waiting.append(chunk)
        return replace(chunk, time=chunk.time + self._shift) if self._shift else chunk

    def flush(self) -> None:
        """Starts writing waiting samples when it is time; cheap, to be called regularly.

        Raises `OutputError` where what was to be written before could not be.
        """
        now = clock.now()
        if now < self._flush_at or (self._writing is not None and not self._writing.done()):
            return
        self._flush_at = now + FLUSH_EVERY
        self._wait()
        self._keep_how_read()
        self._writing = self._disk.submit(self._write, self._taken())

    def _keep_how_read(self) -> None:
        """States in `session.yaml` how units are read, before samples read so are on the disk."""
        known = {
            unit.name: read_as
            for unit in self.session.units
            if unit.read_as is None and (read_as := getattr(self._sources[unit.name], "read_as", None))
        }
        if not known:
            return
        units = tuple(
            unit.model_copy(update={"read_as": known[unit.name]}) if unit.name in known else unit
            for unit in self.session.units
        )
        self.session = self.session.model_copy(update={"units": units})
        write_session(self._folder, self.session)

    def finish(
        self,
        reason: EndReason,
        remarks: Mapping[str, Sequence[str]] | None = None,
        *,
        closed: float | None = None,
    ) -> None:
        """Writes the rest, joins the parts, and states its end in `session.yaml`.

        `remarks` are those on each unit, where they are not those of its source alone. `closed` is the time
        of the clock of arrivals, s, at which it ended; now by default.
        """
        closed = (clock.now() if closed is None else closed) + self._shift
        self._wait()
        self._keep_how_read()
        try:
            self._write(self._taken())
            for kept in self._units.values():
                kept.parts.finish()
        except OutputError as error:
            raise _but_readable(error) from error
        self.bytes = sum(unit.parts.size for unit in self._units.values())
        said = remarks or {name: source.remarks for name, source in self._sources.items()}
        units = tuple(
            unit.model_copy(
                update={
                    "samples": (unit.samples or 0) + self._units[unit.name].samples,
                    "remarks": tuple(dict.fromkeys((*unit.remarks, *said[unit.name], *self._wheels(unit)))),
                }
            )
            for unit in self.session.units
        )
        self.session = self.session.model_copy(
            update={"ended": date_now(), "reason": reason, "closed": closed, "units": units}
        )
        write_session(self._folder, self.session)

    def _wheels(self, unit: SessionUnit) -> tuple[str, ...]:
        if "moving" not in (self._units[unit.name].optional or ()):
            return ()
        return ("whether the wheels turn is recorded: a replay goes by it, a spin on the session does not",)

    def _end_failed(self) -> None:
        """Keeps what was taken; where there is nothing, leaves no session for the next attempt."""
        if self.session.ended:
            return
        if any(unit.samples or math.isfinite(unit.last) for unit in self._units.values()):
            self.finish("failed")
        else:
            remove_made(self._session_file, kind=document_kind(SCHEMA))

    def _go_on(self) -> None:
        for described in self.session.units:
            if described.read_as is not None:
                self._sources[described.name].go_on_as(described.read_as)
        for name, unit in self._units.items():
            before = recorded_so_far(self._folder, name)
            if before.samples:
                unit.last = before.last
                unit.optional = tuple(
                    name for name in OPTIONAL if COLUMN_OF.get(name, name) in before.columns
                )

    def _wait(self) -> None:
        """Waits for what is being written; raises what went wrong with it."""
        writing, self._writing = self._writing, None
        try:
            if writing is not None:
                clock.wait(writing)
                writing.result()
        except OutputError as error:
            raise _but_readable(error) from error

    def _taken(self) -> list[tuple[_Unit, list[LiveChunk]]]:
        """Removes and returns the samples that wait to be written."""
        taken = [(unit, unit.waiting) for unit in self._units.values() if unit.waiting]
        for unit, _ in taken:
            unit.waiting = []
        return taken

    def _write(self, taken: Sequence[tuple[_Unit, list[LiveChunk]]]) -> None:
        for unit, waiting in taken:
            unit.parts.write(recorded(waiting, unit.optional or (), self._shift))
        self.bytes = sum(unit.parts.size for unit in self._units.values())


def finish_session(folder: Path) -> Session:
    """Joins what a recording left that was killed; raises `OutputError` where one still runs."""
    session = Session.load(folder)
    release = hold_folder(prepare_folder(folder))
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
        release()
    return session


def _but_readable(error: OutputError) -> OutputError:
    return OutputError(f"{error}; what was recorded is readable, and --resume adds to it")


def _facts(unit: SessionUnit, source: Source) -> Facts:
    corrected = "by the source" if getattr(source, "already_corrected", None) else ""
    return Facts(serial=unit.serial, corrected=corrected)


def _begun(folder: Path, fresh: Session) -> Session:
    if exists(folder / SESSION_FILE):
        raise OutputError(
            f"{folder}: holds a session already; add to it with --resume, or give another folder"
        )
    for unit in fresh.units:
        if exists(there := joined_file(folder, unit.name)):
            raise OutputError(f"{there}: is there already and no part of a session; give another folder")
    return fresh


def _resumed(folder: Path, fresh: Session) -> Session:
    if not exists(folder / SESSION_FILE):
        raise OutputError(f"{folder}: holds no session that could go on; leave out --resume")
    before = Session.load(folder)
    if set(before.names) != set(fresh.names):
        raise OutputError(
            f"{folder}: the session is of {join(before.names)}; name the same units, or give another folder"
        )
    if before.clock != fresh.clock:
        raise OutputError(
            f"{folder}: its times are of the clock {before.clock!r}, those that come of {fresh.clock!r}; "
            "record into another folder"
        )
    counted = tuple(
        unit.model_copy(update={"samples": recorded_so_far(folder, unit.name).samples})
        for unit in before.units
    )
    return before.model_copy(update={"ended": None, "reason": None, "closed": None, "units": counted})
