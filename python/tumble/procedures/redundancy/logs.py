"""The logs of a redundant set, read side by side: samples of all units, in order of time, block by block."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tumble.acquisition.duplicate_sensors import SensorHead, duplicate_sensors
from tumble.foundation.errors import LogError, ProcedureError
from tumble.foundation.file_status import exists
from tumble.foundation.log_reading import LogReading
from tumble.foundation.recording import Chunk, FloatArray, Recording, RecordingSource, SampleProgress
from tumble.foundation.sample_rates import on_slow_rate
from tumble.foundation.units import Channel
from tumble.foundation.words import count_of
from tumble.logs import (
    ChunkStream,
    ReadOptions,
    SingleAxes,
    list_imus,
    open_recording,
    open_single_axes,
    options_for,
    parse_spec,
    session,
)
from tumble.logs.session_clock import ARRIVAL
from tumble.logs.single_axes import FORMAT as SINGLE_AXES
from tumble.procedures.redundancy.monitor import ALL_WITHIN, SILENCE, SampleArrays, refuse_other_counts

SHORT_BLOCK = 0.02
"""s of a block where the time of a unit went back, so that units still take turns."""


@dataclass(frozen=True, slots=True)
class UnitLog:
    """One unit of the set, as its log has it."""

    name: str
    """That of the IMU in its log, without slashes about it; of the recording where units have own logs."""
    source: str
    """Unambiguous name of the recording: path and IMU."""
    recording: Recording | None
    """`None` for a unit that is missing: it has no samples."""
    missing: str = ""
    """Why it is missing."""


def open_units(
    sources: Sequence[RecordingSource | SingleAxes],
    log: str | Path | None = None,
    read: ReadOptions | Mapping[str, ReadOptions] | None = None,
    allow_missing: bool = False,
    *,
    live_times: bool = True,
) -> tuple[UnitLog, ...]:
    """Opens all units, primary first.

    Each is an IMU in `log` by its name, or `LOG:NAME`, a recording, a table, or single axes. `read` holds the
    options of reading all of them, or each by what was typed. With `allow_missing`, a unit that cannot be
    read is taken to be silent. With `live_times`, what a live monitor did comes out again of the times that
    it was given.

    Raises `TumbleError`, in one line, where a unit is not there, or is named twice.
    """
    refuse_other_counts(max(len(sources) - 1, 0))
    known = _Known.of(log, read) if log is not None else None
    units = [_open_unit(source, known, read, allow_missing, live_times) for source in sources]
    _refuse_twins(units)
    return tuple(_told_apart(units))


def serials_of(units: Sequence[UnitLog]) -> dict[str, str]:
    """Returns the serials that logs state, by the names of units; empty where none is stated."""
    return {unit.name: unit.recording.metadata.serial if unit.recording is not None else "" for unit in units}


def readings_of(units: Sequence[UnitLog]) -> dict[str, LogReading]:
    """Returns how logs were read, by the names of units that are not missing."""
    return {unit.name: unit.recording.metadata.reading for unit in units if unit.recording is not None}


def channels_of_units(units: Sequence[UnitLog]) -> dict[str, tuple[Channel, ...]]:
    """Returns the channels that logs hold, by the names of units that are not missing."""
    return {unit.name: unit.recording.metadata.channels for unit in units if unit.recording is not None}


def has_own_log(recording: Recording) -> bool:
    """Returns whether one log holds a unit, which `LOG:NAME` names."""
    return not recording.metadata.in_memory and recording.metadata.format != SINGLE_AXES


def _told_apart(units: Sequence[UnitLog]) -> Iterator[UnitLog]:
    """Returns units of one name others: what was typed, as of two logs in different folders, or a number."""
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
        """Returns `LOG:NAME` of what was typed, and the name alone if it is that of an IMU of this log."""
        for name in self.names:
            if name and name.strip("/") == source.strip("/"):
                return f"{self.path}:{name}", name.strip("/")
        if ":" in source or exists(Path(source)):
            return source, ""
        named = ", ".join(name for name in self.names if name) or "only one IMU, without a name"
        raise LogError(f"{self.path}: no IMU {source!r}; found: {named}")


def _open_unit(
    source: RecordingSource | SingleAxes,
    known: _Known | None,
    read: ReadOptions | Mapping[str, ReadOptions] | None,
    allow_missing: bool,
    live_times: bool,
) -> UnitLog:
    """Opens a unit; one whose log cannot be read is missing where that is allowed."""
    place, name = source.name if isinstance(source, SingleAxes) else str(source), ""
    try:
        if isinstance(source, SingleAxes):
            name, recording = source.name, open_single_axes(source, read)
        else:
            options = replace(options_for(source, read) or ReadOptions(), live_times=live_times)
            if known is not None and isinstance(source, str | Path):
                place, name = known.locate(place)
            given = place if isinstance(source, str | Path) else source
            recording = open_recording(given, options, keep_faults=True)
    except LogError as error:
        if not isinstance(source, str | Path | SingleAxes):
            raise
        if not allow_missing:
            raise LogError(f"{error}; or go on without it, with --allow-missing") from error
        return UnitLog(name or place, place, None, str(error))
    _refuse_parts(recording)
    return UnitLog(name or recording.name, recording.metadata.source, recording)


def _refuse_parts(recording: Recording) -> None:
    if recording.parts:
        raise ProcedureError(
            f"{recording.name}: is a folder of {count_of('log', len(recording.parts))}, one per pose; "
            "give one log of the whole time"
        )


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
    """Returns what two ways of writing the same log and IMU have in common."""
    recording = unit.recording
    if recording is None:
        return unit.source
    if not has_own_log(recording):
        return f"recording {id(recording)}" if recording.metadata.in_memory else unit.source
    spec = parse_spec(recording.metadata.source)
    return f"{spec.path.resolve()}:{(spec.imu or '').strip('/')}"


@dataclass(frozen=True, slots=True)
class RecordedOrder:
    """In what order samples of a session came, and when it ended."""

    arrivals: list[session.RecordedColumn]
    """Arrivals of the samples of each unit."""
    closed: float
    """s of the clock of arrivals; NaN where that is not known."""


def _recorded_order(units: Sequence[UnitLog]) -> RecordedOrder | None:
    """Returns that of units that were recorded together, in one session; None where they were not."""
    recordings = [unit.recording for unit in units]
    specs = [
        parse_spec(each.metadata.source) for each in recordings if each and each.metadata.format == "session"
    ]
    if len(specs) < len(units) or len({spec.path.resolve() for spec in specs}) > 1:
        return None
    found = [session.RecordedColumn(spec.path, spec.imu or "", ARRIVAL) for spec in specs]
    if not all(each.is_known for each in found):
        return None
    closed = session.Session.load(specs[0].path).closed
    return RecordedOrder(found, np.nan if closed is None else closed)


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
    recorded: session.RecordedColumn | None = None
    """When samples came, where that was recorded: then they arrived at that time."""
    ended: bool = False
    read: int = 0
    interval: float = np.nan
    """s between two samples, in the middle of those read last."""
    gyroscope: SensorHead = field(default_factory=SensorHead)

    def refill(self) -> None:
        """Reads on where nothing is waiting."""
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
        self.waiting = chunk
        self.gyroscope.push(chunk.gyroscope)
        self.read += len(chunk)
        if len(time) > 1:
            self.interval = float(np.median(np.diff(time)))
        if self.recorded is None:
            self._arrive_in_time(time)
        else:
            self.arrival = self.recorded.take(len(chunk))
            self.last = float(self.arrival[-1])

    def _arrive_in_time(self, time: FloatArray) -> None:
        before = time[0] if np.isinf(self.last) else self.last - self.stepped_back
        steps = np.diff(time, prepend=before)
        usual = float(np.median(np.abs(steps)))
        back = np.cumsum(np.where(steps < 0.0, usual - steps, 0.0))
        self.arrival = time + (self.stepped_back + back)
        self.stepped_back += float(back[-1])
        self.last = float(self.arrival[-1])

    def arrived(self, until: float) -> FloatArray:
        """Returns when those that wait arrived, up to a time."""
        return self.arrival[: int(np.searchsorted(self.arrival, until, side="right"))]

    def leave_out(self, until: float) -> None:
        """Omits samples that arrived up to a time."""
        self.take(until)
        if self.waiting is not None and len(self.waiting):
            self.first = float(self.waiting.time[0])

    def take(self, until: float) -> Chunk:
        """Removes and returns samples that arrived up to a time."""
        if self.waiting is None:
            return _NOTHING
        count = len(self.arrived(until))
        taken = self.waiting
        self.waiting = _cut(taken, slice(count, None))
        self.arrival = self.arrival[count:]
        return _cut(taken, slice(0, count))


_NOTHING = Chunk(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))


def _cut(chunk: Chunk, part: slice) -> Chunk:
    temperature = None if chunk.temperature is None else chunk.temperature[part]
    return Chunk(chunk.time[part], chunk.accelerometer[part], chunk.gyroscope[part], temperature)


def _temperature(chunk: Chunk) -> FloatArray | None:
    return None if chunk.temperature is None else np.ascontiguousarray(chunk.temperature)


def _arrays(chunk: Chunk) -> SampleArrays:
    return (
        np.ascontiguousarray(chunk.time),
        np.ascontiguousarray(chunk.accelerometer),
        np.ascontiguousarray(chunk.gyroscope),
    )


class SideBySide(Iterator[list[SampleArrays]]):
    """Blocks of the samples of all units since the block before, primary first; memory does not grow.

    Units of one session are given in the order in which their samples came, as they were while they were
    recorded: `arrivals` are then those of the block given last, else None, and `silence` the time, s, in
    which no unit sent a sample before it, 0 where that is no longer than `SILENCE`. `temperatures` are those
    of the block given last, degC, None of units whose logs have none.

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
        recorded = _recorded_order(units)
        for reader, arrivals in zip(self._readers, recorded.arrivals if recorded else (), strict=False):
            reader.recorded = arrivals
        self._closed = recorded.closed if recorded else np.nan
        self._progress = progress
        self._expected = _expected(self._readers)
        self.start, self.end = np.inf, -np.inf
        self.arrivals: list[FloatArray] | None = None if recorded is None else []
        self.temperatures: list[FloatArray | None] = []
        self.silence = 0.0
        self._heard = np.nan

    def __next__(self) -> list[SampleArrays]:
        for reader in self._readers:
            reader.refill()
        live = [reader for reader in self._readers if not reader.ended]
        if self.arrivals is None:
            self._refuse_if_apart()
        elif np.isinf(self.start) and live:
            self._begin_with_the_primary()
        if not live:
            raise StopIteration
        cut = min(reader.last for reader in live)
        if self.arrivals is not None:
            cut = self._until_silence(live, cut)
            self.arrivals = [reader.arrived(cut) for reader in self._readers]
        elif any(reader.stepped_back for reader in live):
            # Within a block samples are taken by their time, which is no guide where it went back.
            cut = min(cut, min(float(reader.arrival[0]) for reader in live) + SHORT_BLOCK)
        taken = [reader.take(cut) for reader in self._readers]
        block = [_arrays(chunk) for chunk in taken]
        self.temperatures = [_temperature(chunk) for chunk in taken]
        self.start = min(reader.first for reader in self._readers if reader.first is not None)
        latest = cut if self.arrivals is None else max(float(time.max()) for time, _, _ in block if len(time))
        self.end = max(self.end, latest)
        if self._progress is not None:
            self._progress(sum(reader.read for reader in self._readers), self._expected)
        return block

    @property
    def last_silence(self) -> float:
        """Time, s, from the last sample of all units to the end of their session; 0 where it is not known."""
        silence = self._closed - self._heard
        return float(silence) if silence > 0.0 else 0.0

    def _begin_with_the_primary(self) -> None:
        """Omits samples before the first of the primary, as a live set does."""
        primary, *others = self._readers
        begun = min(float(reader.arrival[0]) for reader in self._readers if len(reader.arrival))
        if len(primary.arrival) and primary.arrival[0] - begun <= ALL_WITHIN:
            for reader in others:
                reader.leave_out(float(np.nextafter(primary.arrival[0], -np.inf)))

    def _until_silence(self, live: Sequence[_Reader], cut: float) -> float:
        """Arrival, up to `cut`, after which no unit sent a sample for long; stores the one before."""
        arrived = np.sort(np.concatenate([reader.arrived(cut) for reader in live]))
        before = arrived[0] if np.isnan(self._heard) else self._heard
        steps = np.diff(arrived, prepend=before)
        self.silence = float(steps[0]) if steps[0] > SILENCE else 0.0
        gaps = np.flatnonzero(steps[1:] > SILENCE)
        self._heard = float(arrived[gaps[0]] if len(gaps) else arrived[-1])
        return self._heard

    def notices(self) -> Iterator[str]:
        """Describes omissions from each unit's log, rates too slow, and units with the same gyroscope."""
        yield from duplicate_sensors(
            (reader.unit.name, reader.gyroscope.digest()) for reader in self._readers
        )
        for reader in self._readers:
            if isinstance(reader.stream, ChunkStream):
                yield from (f"{reader.unit.name}: {notice}" for notice in reader.stream.counts.notices())
            if reader.interval > 0.0:
                yield from (f"{reader.unit.name}: {line}" for line in on_slow_rate(1.0 / reader.interval))

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
