"""The logs of a redundant set, read side by side: what all units said, in order of time, block by block."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np

from tumble.acquisition.twins import GyroscopeHead, twins
from tumble.errors import LogError, ProcedureError
from tumble.logs import ChunkStream, ReadOptions, list_imus, open_recording, options_for, parse_spec
from tumble.recording import Chunk, FloatArray, Recording, RecordingSource, SampleProgress
from tumble.words import count_of

MOST_SECONDARIES = 7
SHORT_BLOCK = 0.02
"""s of a block where the time of a unit went back, so that units still take turns."""


@dataclass(frozen=True, slots=True)
class UnitLog:
    """One unit of the set, as its log has it."""

    name: str
    """That of the IMU in its log, without slashes about it; of the recording where units have own logs."""
    source: str
    """What names it for certain: path and IMU."""
    recording: Recording | None
    """`None` for a unit that is missing: it never says anything."""
    missing: str = ""
    """Why it is missing."""


def open_units(
    sources: Sequence[RecordingSource],
    log: str | Path | None = None,
    read: ReadOptions | Mapping[str, ReadOptions] | None = None,
    allow_missing: bool = False,
) -> tuple[UnitLog, ...]:
    """Open all units, primary first: each an IMU in `log` by its name, or `LOG:NAME`, a recording, a table.

    `read` says how to read all of them, or each by what was typed. With `allow_missing`, a unit that cannot
    be read is taken to be silent.

    Raises `TumbleError`, in one line, where a unit is not there, or is named twice.
    """
    if not 1 < len(sources) <= MOST_SECONDARIES + 1:
        raise ProcedureError(
            f"{max(len(sources) - 1, 0)} secondaries were named; give the primary 1 to {MOST_SECONDARIES}"
        )
    known = _Known.of(log, read) if log is not None else None
    units = [_open_unit(source, known, read, allow_missing) for source in sources]
    _refuse_twins(units)
    return tuple(_told_apart(units))


def _told_apart(units: Sequence[UnitLog]) -> Iterator[UnitLog]:
    """Give units of one name others: what was typed, as of two logs in different folders, or a number."""
    names = [unit.name for unit in units]
    sources = [unit.source for unit in units]
    for k, unit in enumerate(units):
        if names.count(unit.name) == 1:
            yield unit
        elif sources.count(unit.source) == 1:
            yield replace(unit, name=unit.source)
        else:
            yield replace(unit, name=f"{unit.name}-{names[: k + 1].count(unit.name)}")


@dataclass(frozen=True, slots=True)
class _Known:
    """A log that holds several IMUs, and their names."""

    path: Path
    names: tuple[str, ...]

    @classmethod
    def of(cls, log: str | Path, read: ReadOptions | Mapping[str, ReadOptions] | None) -> _Known:
        spec = parse_spec(log)
        if spec.imu is not None:
            raise LogError(f"{log}: names one IMU; give the log alone, and its IMUs as units")
        options = next(iter(read.values()), None) if isinstance(read, Mapping) else read
        return cls(spec.path, list_imus(spec.path, options))

    def locate(self, source: str) -> tuple[str, str]:
        """Give `LOG:NAME` of what was typed, and the name alone if it is that of an IMU of this log."""
        for name in self.names:
            if name and name.strip("/") == source.strip("/"):
                return f"{self.path}:{name}", name.strip("/")
        if ":" in source or Path(source).exists():
            return source, ""
        named = ", ".join(name for name in self.names if name) or "only one IMU, without a name"
        raise LogError(f"{self.path}: no IMU {source!r}; found: {named}")


def _open_unit(
    source: RecordingSource,
    known: _Known | None,
    read: ReadOptions | Mapping[str, ReadOptions] | None,
    allow_missing: bool,
) -> UnitLog:
    options = options_for(source, read)
    if not isinstance(source, str | Path):
        recording = _whole(open_recording(source, options, keep_faults=True))
        return UnitLog(recording.name, recording.metadata.source, recording)
    place, name = str(source), ""
    try:
        if known is not None:
            place, name = known.locate(place)
        recording = _whole(open_recording(place, options, keep_faults=True))
    except LogError as error:
        if not allow_missing:
            raise LogError(f"{error}; or go on without it, with --allow-missing") from error
        return UnitLog(name or place, place, None, str(error))
    return UnitLog(name or recording.name, recording.metadata.source, recording)


def _whole(recording: Recording) -> Recording:
    if recording.parts:
        raise ProcedureError(
            f"{recording.name}: is a folder of {count_of('log', len(recording.parts))}, one per pose; "
            "give one log of the whole time"
        )
    recording.need_both_triads("comparing units in motion")
    return recording


def _refuse_twins(units: Sequence[UnitLog]) -> None:
    seen: dict[str, int] = {}
    for index, unit in enumerate(units):
        earlier = seen.setdefault(_whose(unit), index)
        if earlier == index:
            continue
        if earlier == 0:
            raise ProcedureError(
                f"{unit.source}: is the primary and cannot be its own secondary; leave it out"
            )
        raise ProcedureError(f"{unit.source}: is named twice among the secondaries; leave one out")


def _whose(unit: UnitLog) -> str:
    """Give what two ways of writing the same log and IMU have in common."""
    recording = unit.recording
    if recording is None:
        return unit.source
    if recording.metadata.in_memory:
        return f"recording {id(recording)}"
    spec = parse_spec(recording.metadata.source)
    return f"{spec.path.resolve()}:{(spec.imu or '').strip('/')}"


@dataclass(slots=True)
class _Reader:
    """One unit's samples, taken off in order of arrival."""

    unit: UnitLog
    offset: float
    """s, added to its time gives that of the common clock."""
    stream: Iterator[Chunk]
    waiting: Chunk | None = None
    first: float | None = None
    last: float = -np.inf
    """When the last sample so far arrived, s of the common clock."""
    arrival: FloatArray = field(default_factory=lambda: np.empty(0))
    """When those that wait arrived: at their own time; where time went back, just after the one before."""
    stepped_back: float = 0.0
    """s by which time went back so far."""
    ended: bool = False
    read: int = 0
    gyroscope: GyroscopeHead = field(default_factory=GyroscopeHead)

    def refill(self) -> None:
        """Read on where nothing is waiting."""
        while not self.ended and (self.waiting is None or len(self.waiting) == 0):
            chunk = next(self.stream, None)
            if chunk is None:
                self.ended, self.waiting = True, None
            elif len(chunk):
                self._take_in(chunk)

    def _take_in(self, chunk: Chunk) -> None:
        time = chunk.time + self.offset
        chunk = replace(chunk, time=time)
        self.first = float(time[0]) if self.first is None else self.first
        before = time[0] if self.waiting is None else self.last - self.stepped_back
        steps = np.diff(time, prepend=before)
        usual = float(np.median(np.abs(steps)))
        back = np.cumsum(np.where(steps < 0.0, usual - steps, 0.0))
        self.waiting = chunk
        self.gyroscope.push(chunk.gyroscope)
        self.arrival = time + (self.stepped_back + back)
        self.stepped_back += float(back[-1])
        self.last = float(self.arrival[-1])
        self.read += len(chunk)

    def take(self, until: float) -> SampleArrays:
        """Take off what arrived up to a time."""
        if self.waiting is None:
            return _NOTHING
        count = int(np.searchsorted(self.arrival, until, side="right"))
        taken = self.waiting
        self.waiting = _cut(taken, slice(count, None))
        self.arrival = self.arrival[count:]
        return _arrays(_cut(taken, slice(0, count)))


SampleArrays: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]
"""Time (n,) s of the common clock, specific force (n, 3) m/s^2, angular rate (n, 3) rad/s."""

_NOTHING: SampleArrays = (np.empty(0), np.empty((0, 3)), np.empty((0, 3)))


def _cut(chunk: Chunk, part: slice) -> Chunk:
    return Chunk(chunk.time[part], chunk.accelerometer[part], chunk.gyroscope[part])


def _arrays(chunk: Chunk) -> SampleArrays:
    return (
        np.ascontiguousarray(chunk.time),
        np.ascontiguousarray(chunk.accelerometer),
        np.ascontiguousarray(chunk.gyroscope),
    )


class SideBySide(Iterator[list[SampleArrays]]):
    """Blocks of what all units said since the block before, primary first; memory does not grow.

    All times are of the common clock, s; `start` and `end` are the first and the last given so far.

    Raises `ProcedureError` as soon as it is seen that a secondary has no time in common with the primary,
    and `LogError` where a log cannot be read.
    """

    def __init__(
        self, units: Sequence[UnitLog], offsets: Sequence[float], progress: SampleProgress | None = None
    ) -> None:
        self._readers = [
            _Reader(unit, offset, iter(()) if unit.recording is None else unit.recording.chunks())
            for unit, offset in zip(units, offsets, strict=True)
        ]
        self._progress = progress
        self._expected = _expected(self._readers)
        self.start, self.end = np.inf, -np.inf

    def __next__(self) -> list[SampleArrays]:
        for reader in self._readers:
            reader.refill()
        self._refuse_if_apart()
        live = [reader for reader in self._readers if not reader.ended]
        if not live:
            raise StopIteration
        cut = min(reader.last for reader in live)
        if any(reader.stepped_back for reader in live):
            # Within a block samples are taken by their time, which is no guide where it went back.
            cut = min(cut, min(float(reader.arrival[0]) for reader in live) + SHORT_BLOCK)
        block = [reader.take(cut) for reader in self._readers]
        self.start = min(reader.first for reader in self._readers if reader.first is not None)
        self.end = max(self.end, cut)
        if self._progress is not None:
            self._progress(sum(reader.read for reader in self._readers), self._expected)
        return block

    def notices(self) -> Iterator[str]:
        """Say what was left out of each unit's log, and which units have one gyroscope."""
        yield from twins((reader.unit.name, reader.gyroscope.digest()) for reader in self._readers)
        for reader in self._readers:
            if isinstance(reader.stream, ChunkStream):
                yield from (f"{reader.unit.name}: {notice}" for notice in reader.stream.counts.notices())

    def _refuse_if_apart(self) -> None:
        primary, *secondaries = self._readers
        for secondary in secondaries:
            for early, late in ((primary, secondary), (secondary, primary)):
                if (
                    early.ended
                    and early.first is not None
                    and late.first is not None
                    and early.last < late.first
                ):
                    raise ProcedureError(_apart(primary, secondary, early, late))


def _apart(primary: _Reader, secondary: _Reader, early: _Reader, late: _Reader) -> str:
    name = secondary.unit.name
    return (
        f"{name}: shares no time with the primary {primary.unit.name}: {early.unit.name} ends at "
        f"{early.last:.3f} s, {late.unit.name} begins at {late.first:.3f} s; if they were recorded together, "
        f"give the offset of its clock with --set units.{name}.time_offset=SECONDS"
    )


def _expected(readers: Sequence[_Reader]) -> int | None:
    counts = [reader.stream.expected for reader in readers if isinstance(reader.stream, ChunkStream)]
    known = [count for count in counts if count is not None]
    return sum(known) if known and len(known) == len(counts) else None
