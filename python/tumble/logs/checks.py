"""Requirements on every log, checked while it streams by: increasing time, and finite numbers."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tumble import _core
from tumble.foundation.errors import LogError
from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.units import UNITS
from tumble.foundation.words import count_of
from tumble.logs.beginning import Beginning
from tumble.logs.row_order import (
    LARGEST_DISPLACEMENT,
    Reordering,
    RowOrder,
    Rows,
    WrongOrderError,
    WrongTime,
    select,
)
from tumble.logs.set_clock import SetClock
from tumble.logs.track import LoggedImu, RawSamples
from tumble.logs.triads import largest_each
from tumble.logs.unit_switch import UnitSwitch
from tumble.logs.units import IMPOSSIBLE_RAD_PER_S, LARGEST_SI, LARGEST_TIME, SLOWEST_HZ

_LARGEST_SHARE_WITHOUT_NUMBER = 0.01
_LARGEST_SHARE_OF_BAD_LINES = 0.01
_LARGEST_SHARE_OF_CLASHES = 0.1
_SPIKE = 10.0
"""Ratio of an isolated reading to the usual one, above which it is a spike."""
_SMALLEST_SPIKE: Mapping[Literal["accelerometer", "gyroscope"], float] = {
    "accelerometer": 15.0,
    "gyroscope": 1.0,
}
"""SI: less does not affect a calibration."""
_FEWEST_FOR_SPIKES = 100
_LEAST_WARMING, FASTEST_WARMING = 10.0, 5.0
"""K, and K/s: what changes less, or slower, may be a sensor in an oven."""
_PARTS_FOR_WARMING = 8

Mask = NDArray[np.bool_]
Numbers = NDArray[np.int64]
MeasuredValues: TypeAlias = Literal["time", "accelerometer", "gyroscope"]
_LARGEST_POSSIBLE: dict[MeasuredValues, float] = {
    "time": LARGEST_TIME,
    "accelerometer": LARGEST_SI,
    "gyroscope": LARGEST_SI,
}

_HOUR, _DAY = 3600.0, 86400.0
_LONGEST_STEP = 1.0 / SLOWEST_HZ
"""s: the longest time between samples, which passes while a clock steps."""


@dataclass(slots=True)
class Oddities:
    """Number of irregularities of one kind, and the place of the first."""

    count: int = 0
    first: str = ""

    def add(self, other: Oddities) -> None:
        """Counts what came after."""
        self.count += other.count
        self.first = self.first or other.first

    def phrase(self) -> str:
        """Describes the first, and the number of others."""
        return self.first if self.count == 1 else f"{self.first}, and {self.count - 1} more"


@dataclass(slots=True)
class Warming:
    """Span of the temperature and of time, by which a wrong unit of time shows."""

    low: float = np.inf
    high: float = -np.inf
    first: float = np.inf
    last: float = -np.inf

    def add(self, chunk: Chunk) -> None:
        """Adds a chunk; medians of its parts leave out garbled readings."""
        if chunk.temperature is None:
            return
        self.first, self.last = min(self.first, float(chunk.time[0])), max(self.last, float(chunk.time[-1]))
        for part in np.array_split(chunk.temperature, _PARTS_FOR_WARMING):
            if len(finite := part[np.isfinite(part)]):
                middle = float(np.median(finite))
                self.low, self.high = min(self.low, middle), max(self.high, middle)

    def join(self, other: Warming) -> None:
        """Adds another pass."""
        self.low, self.high = min(self.low, other.low), max(self.high, other.high)
        self.first, self.last = min(self.first, other.first), max(self.last, other.last)

    def notices(self) -> tuple[str, ...]:
        """Reports warming faster than any sensor warms."""
        span, duration = self.high - self.low, self.last - self.first
        if not (span > _LEAST_WARMING and span > FASTEST_WARMING * duration):
            return ()
        return (
            f"temperature changes by {span:.3g} K in {duration:.3g} s, faster than sensors do: check "
            "time, with --time-unit or --rate",
        )


@dataclass(slots=True)
class Counts:
    """Counts of a pass over a recording so far."""

    read: int = 0
    """Samples in the log."""
    duplicates: int = 0
    """Samples left out because they carry the time stamp of the one before."""
    clashes: int = 0
    """Those of the duplicates whose values differ from the sample before."""
    unstamped: int = 0
    """Samples left out because their driver had not stamped them."""
    without_number: int = 0
    """Samples left out because the time or a channel is no finite number."""
    channels: dict[str, int] = field(default_factory=dict)
    """Number of those samples for which each channel accounts."""
    bad_lines: Oddities = field(default_factory=Oddities)
    """Lines left out because they cannot be read."""
    impossible: Oddities = field(default_factory=Oddities)
    """Samples left out because they hold a reading, or a time, that no sensor has."""
    spikes: Oddities = field(default_factory=Oddities)
    """Samples kept whose reading stands alone, far from those before and after."""
    reordering: Reordering = field(default_factory=Reordering)
    """Samples that were sorted by time."""
    beginning: Beginning = field(default_factory=Beginning)
    """First readings, and where they come again."""
    warming: Warming = field(default_factory=Warming)
    """Temperature over the whole pass."""
    unit_switch: UnitSwitch = field(default_factory=UnitSwitch)
    """Length of gravity at rest over the whole pass."""
    clock_sets: list[float] = field(default_factory=list)
    """s, of the first sample after each time that the clock was set ahead by years."""

    def add(self, other: Counts) -> None:
        """Counts what another pass has met as well."""
        self.read += other.read
        self.duplicates += other.duplicates
        self.clashes += other.clashes
        self.unstamped += other.unstamped
        self.without_number += other.without_number
        for name, count in other.channels.items():
            self.channels[name] = self.channels.get(name, 0) + count
        self.bad_lines.add(other.bad_lines)
        self.impossible.add(other.impossible)
        self.spikes.add(other.spikes)
        self.reordering.add(other.reordering)
        self.beginning.join(other.beginning)
        self.warming.join(other.warming)
        self.unit_switch.join(other.unit_switch)
        self.clock_sets += other.clock_sets

    def notices(self) -> tuple[str, ...]:
        """Describes omissions; empty if there were none."""
        notices = []
        if self.reordering.rows:
            notices.append(self.reordering.phrase())
        if self.duplicates:
            notices.append(
                f"left out {count_of('sample', self.duplicates)} with the time stamp of the one before"
            )
        if self.clock_sets:
            when = ", ".join(f"{time:.6g} s" for time in self.clock_sets)
            notices.append(
                f"its clock was set while it was written, at {when}: later times follow on earlier ones "
                "after a pause of unknown length, and no turn across it is used"
            )
        if self.unstamped:
            notices.append(
                f"left out {count_of('sample', self.unstamped)} with the stamp 0, which no driver had set"
            )
        if self.without_number:
            channels = ", ".join(f"{name} {count}" for name, count in self.channels.items())
            notices.append(
                f"left out {count_of('sample', self.without_number)} without a number ({channels})"
            )
        if self.bad_lines.count:
            notices.append(
                f"left out {count_of('bad line', self.bad_lines.count)}: {self.bad_lines.phrase()}"
            )
        if self.impossible.count:
            notices.append(
                f"left out {count_of('sample', self.impossible.count)} that no sensor reads: "
                f"{self.impossible.phrase()}"
            )
        if self.spikes.count:
            notices.append(
                f"{count_of('sample', self.spikes.count)} far from those before and after, garbled or "
                f"knocked: {self.spikes.phrase()}"
            )
        return (*notices, *self.beginning.notices(), *self.warming.notices(), *self.unit_switch.notices())


class ChunkStream(Iterator[Chunk]):
    """One pass over a track: chunks that are fit to use, and `counts` of what was left out on the way.

    `expected` is the number of samples to come where that is known beforehand, for those who show progress.

    Samples that came late are sorted by time, within `LARGEST_DISPLACEMENT` places.

    Raises `LogError` at a sample whose time belongs nowhere in that window, and at the end of a pass in which
    too many samples had to be left out; not so with `keep_faults`, which passes on all that has a time, in
    the order of the log. With `skip_bad_lines` a single wrong time stamp is left out as a bad line.
    """

    def __init__(
        self,
        track: LoggedImu,
        pieces: Iterator[RawSamples],
        rate: float | None,
        radians_are_guessed: bool,
        keep_faults: bool = False,
        skip_bad_lines: bool = False,
        counts_from_1970: bool = False,
    ) -> None:
        self._counts_from_1970 = counts_from_1970
        self.counts = Counts()
        self.expected = track.expected
        self._track = track
        self._rate = rate
        self._radians_are_guessed = radians_are_guessed
        self._keep_faults = keep_faults
        self._skip_bad_lines = skip_bad_lines
        self._largest_usual: Mapping[MeasuredValues, float] = _LARGEST_POSSIBLE | (
            {"gyroscope": IMPOSSIBLE_RAD_PER_S} if radians_are_guessed else {}
        )
        self._largest: dict[MeasuredValues, float] = {}
        """Largest reading so far; infinite once there was one that is no reading."""
        self._last: Chunk | None = None
        self._order = RowOrder(drop_wrong=skip_bad_lines)
        self._clock = SetClock()
        self.counts.clock_sets = self._clock.times
        self.counts.reordering = self._order.reordering
        self._chunks = self._generate(pieces)

    def __next__(self) -> Chunk:
        return next(self._chunks)

    def close(self) -> None:
        """Stops reading and lets go of the file."""
        self._chunks.close()

    def _generate(self, pieces: Iterator[RawSamples]) -> Generator[Chunk, None, None]:
        for piece in pieces:
            first = self.counts.read
            self.counts.read += len(piece)
            if piece.bad_lines:
                self.counts.bad_lines.add(Oddities(len(piece.bad_lines), piece.bad_lines[0]))
            stamped = self._with_time(piece, first)
            if self._keep_faults:
                yield from self._finished(self._drop_no_samples(stamped, first))
                continue
            for rows in self._in_order(*self._drop_unsound(stamped, first)):
                yield from self._finished(self._on_one_clock(self._read(rows)))
        for rows in self._rest():
            yield from self._finished(self._on_one_clock(self._read(rows)))
        self._check_totals()

    def _on_one_clock(self, chunk: Chunk) -> Chunk:
        """Puts times on the clock of the first sample where the clock was set meanwhile."""
        if len(chunk) == 0:
            return chunk
        time, received = self._clock.follow(chunk.time, chunk.received)
        return chunk if time is chunk.time else replace(chunk, time=time, received=received)

    def _finished(self, kept: Chunk) -> Iterator[Chunk]:
        """Returns what is left of a chunk, if anything is, without duplicates and gaps of temperature."""
        chunk = self._drop_duplicates(kept)
        if len(chunk) == 0:
            return
        chunk = self._hold_temperature(chunk)
        self.counts.warming.add(chunk)
        self.counts.beginning.add(chunk)
        if "accelerometer" in self._track.triads:
            self.counts.unit_switch.add(chunk)
        self._last = chunk
        if self._keep_faults:
            self._refuse_degrees(chunk)
        yield chunk

    def _with_time(self, piece: RawSamples, first: int) -> Chunk:
        time = piece.time
        if time is None:
            assert self._rate is not None
            time = np.arange(first, first + len(piece), dtype=np.float64) / self._rate
        return Chunk(time, piece.accelerometer, piece.gyroscope, piece.temperature, received=piece.received)

    def _stamped(self, chunk: Chunk) -> Mask:
        """Leaves out samples stamped 0 by a clock that counts from 1970: a driver had not stamped them."""
        if not self._counts_from_1970:
            return np.ones(len(chunk), dtype=np.bool_)
        stamped: Mask = chunk.time != 0.0
        self.counts.unstamped += int((~stamped).sum())
        return stamped

    def _drop_unsound(self, chunk: Chunk, first: int) -> tuple[Chunk, Numbers]:
        """Omits samples that are no readings; returns the others, and their numbers in the log.

        `first` is the number of the first sample in the log.
        """
        numbers = np.arange(first, first + len(chunk), dtype=np.int64)
        if not (stamped := self._stamped(chunk)).all():
            chunk, numbers = select(chunk, stamped), numbers[stamped]
        if len(chunk) == 0:
            return chunk, numbers
        if not self._is_sound(chunk):
            finite = self._finite(chunk)
            chunk, numbers = select(chunk, finite), numbers[finite]
            self._refuse_degrees(chunk)
            possible = self._possible(chunk, numbers)
            chunk, numbers = select(chunk, possible), numbers[possible]
        return chunk, numbers

    def _quantities(self, chunk: Chunk) -> Mapping[MeasuredValues, FloatArray]:
        """Returns what was recorded."""
        found: dict[MeasuredValues, FloatArray] = {"time": chunk.time}
        for triad in self._track.triads:
            found[triad] = getattr(chunk, triad)
        return found

    def _is_sound(self, chunk: Chunk) -> bool:
        """Returns whether all is finite and within usual readings: one pass where masks would take many."""
        largest = {what: _core.largest(values) for what, values in self._quantities(chunk).items()}
        is_sound = all(value <= self._largest_usual[what] for what, value in largest.items())
        for what, value in largest.items():
            self._largest[what] = max(self._largest.get(what, 0.0), value if is_sound else math.inf)
        return is_sound

    def _in_order(self, chunk: Chunk, numbers: Numbers) -> list[Rows]:
        """Sorts samples by time; returns those that are ready."""
        try:
            ready = self._order.push(chunk, numbers)
        except WrongOrderError as error:
            raise self._wrong_order(error.row) from None
        self._note_dropped()
        return ready

    def _rest(self) -> list[Rows]:
        """Returns the samples that were held for sorting."""
        try:
            ready = self._order.finish()
        except WrongOrderError as error:
            raise self._wrong_order(error.row) from None
        self._note_dropped()
        return ready

    def _note_dropped(self) -> None:
        for row in self._order.dropped:
            seen = f"{self._track.locate(row.number)} jumps in time, to {row.time:.9g} s"
            self.counts.bad_lines.add(Oddities(1, seen))
        self._order.dropped.clear()

    def _wrong_order(self, row: WrongTime) -> LogError:
        """Returns the sample whose time fits nowhere."""
        moves = "runs backwards" if row.step < 0.0 else "jumps ahead"
        seen = (
            f"{self._track.source}: {self._track.locate(row.number)}: time {moves} by "
            f"{abs(row.step):.6g} s to {row.time:.9g} s"
        )
        if row.alone:
            return LogError(
                f"{seen} in this sample alone; repair or delete it, or leave it out with --skip-bad-lines"
            )
        if cause := _change_of_clock(row.step):
            return LogError(f"{seen}, {cause}, or read it with --rate if its samples are in order")
        if row.goes_on:
            return LogError(
                f"{seen}, and goes on from there: the device or its clock started anew, or recordings were "
                "joined; cut the log there, and give its parts as files of a folder"
            )
        return LogError(
            f"{seen}, further than the {LARGEST_DISPLACEMENT} rows within which late rows are sorted, "
            "or into no gap; sort the log by time, or read it with --rate if its samples are in order"
        )

    def _possible(self, chunk: Chunk, numbers: Numbers) -> Mask:
        """Omits and counts readings that no sensor gives."""
        impossible = {
            what: largest_each(values) > _LARGEST_POSSIBLE[what]
            for what, values in self._quantities(chunk).items()
        }
        if self._radians_are_guessed:
            impossible["gyroscope"] |= _stand_alone(chunk.gyroscope, IMPOSSIBLE_RAD_PER_S)
        found: Mask = np.logical_or.reduce(list(impossible.values()))
        if found.any():
            at = int(np.argmax(found))
            what = next(name for name, mask in impossible.items() if mask[at])
            self._note(self.counts.impossible, int(found.sum()), chunk, numbers, what, at)
        return ~found

    def _read(self, rows: Rows) -> Chunk:
        """Omits and counts readings of zero that a driver gave where it could read none; counts spikes."""
        chunk, numbers = rows.chunk, rows.numbers
        failed = {
            triad: _core.failed_reads(np.ascontiguousarray(getattr(chunk, triad)))
            for triad in self._track.triads
        }
        if any(failed.values()):
            read: Mask = np.ones(len(chunk), dtype=np.bool_)
            read[[row for found in failed.values() for row in found]] = False
            at = int(np.argmin(read))
            triad = next(triad for triad, found in failed.items() if at in found)
            self._note(self.counts.impossible, int((~read).sum()), chunk, numbers, triad, at)
            chunk, numbers = select(chunk, read), numbers[read]
        self._note_spikes(chunk, numbers)
        return chunk

    def _note_spikes(self, chunk: Chunk, numbers: Numbers) -> None:
        """Counts readings that are in the range of sensors, but not in that of the samples about them."""
        for what in self._track.triads:
            least = _SMALLEST_SPIKE[what]
            if len(chunk) < _FEWEST_FOR_SPIKES or not self._largest[what] > least:
                continue
            values = self._quantities(chunk)[what]
            if not _core.largest(values) > least:
                continue
            # A product of BLAS wakes threads, which wait busily and take longer than the sum.
            usual = float(np.sqrt(np.einsum("ij,ij", values, values) / values.size))
            alone = _stand_alone(values, max(least, _SPIKE * usual))
            if alone.any():
                at = int(np.argmax(alone))
                self._note(self.counts.spikes, int(alone.sum()), chunk, numbers, what, at)

    def _note(
        self, oddities: Oddities, count: int, chunk: Chunk, numbers: Numbers, what: MeasuredValues, at: int
    ) -> None:
        """Counts oddities of one kind; the first is described with place, value and time."""
        seen = ""
        if not oddities.count:
            values = self._quantities(chunk)[what].reshape(len(chunk), -1)[at]
            axis = int(np.abs(values).argmax())
            name = what if what == "time" else f"{what} {'xyz'[axis]}"
            unit = "s" if what == "time" else UNITS[what]
            when = "" if what == "time" else f" at {float(chunk.time[at]):.6f} s"
            place = self._track.locate(int(numbers[at]))
            seen = f"{name} reads {float(values[axis]):.6g} {unit}{when} ({place})"
        oddities.add(Oddities(count, seen))

    def _drop_no_samples(self, chunk: Chunk, first: int) -> Chunk:
        """Omits rows without time, and rows in which only other IMUs of the table have numbers.

        `first` is the number of the first sample in the log.
        """
        numbers = np.arange(first, first + len(chunk), dtype=np.int64)
        if not (is_set := self._stamped(chunk)).all():
            chunk, numbers = select(chunk, is_set), numbers[is_set]
        finite = np.isfinite(chunk.time)
        impossible = finite & (np.abs(chunk.time) > LARGEST_TIME)
        if impossible.any():
            at = int(np.argmax(impossible))
            self._note(self.counts.impossible, int(impossible.sum()), chunk, numbers, "time", at)
            chunk, finite = select(chunk, ~impossible), finite[~impossible]
        stamped = finite
        if unstamped := int((~stamped).sum()):
            self.counts.channels["time"] = self.counts.channels.get("time", 0) + unstamped
            self.counts.without_number += unstamped
        if not self._track.alone:
            stamped &= np.isfinite(chunk.accelerometer).any(axis=1) | np.isfinite(chunk.gyroscope).any(axis=1)
        return chunk if stamped.all() else select(chunk, stamped)

    def _finite(self, chunk: Chunk) -> Mask:
        bad = {"time": ~np.isfinite(chunk.time)}
        for triad in self._track.triads:
            for axis, values in zip("xyz", getattr(chunk, triad).T, strict=True):
                bad[triad[0] + axis] = ~np.isfinite(values)
        for name, mask in bad.items():
            if found := int(mask.sum()):
                self.counts.channels[name] = self.counts.channels.get(name, 0) + found
        finite: Mask = ~np.logical_or.reduce(list(bad.values()))
        self.counts.without_number += int((~finite).sum())
        return finite

    def _drop_duplicates(self, chunk: Chunk) -> Chunk:
        if len(chunk) == 0:
            return chunk
        begins_again = self._last is not None and chunk.time[0] == self._last.time[-1]
        if not begins_again and _core.steps(chunk.time)[1] == 0:
            return chunk
        doubled = np.zeros(len(chunk), dtype=np.bool_)
        doubled[1:] = chunk.time[1:] == chunk.time[:-1]
        doubled[0] = begins_again
        self.counts.duplicates += int(doubled.sum())
        self.counts.clashes += int((doubled & self._differs_from_previous(chunk)).sum())
        return select(chunk, ~doubled)

    def _differs_from_previous(self, chunk: Chunk) -> Mask:
        values = np.hstack([chunk.accelerometer, chunk.gyroscope])
        differs = np.zeros(len(chunk), dtype=np.bool_)
        differs[1:] = (values[1:] != values[:-1]).any(axis=1)
        if self._last is not None:
            previous = np.hstack([self._last.accelerometer[-1], self._last.gyroscope[-1]])
            differs[0] = bool((values[0] != previous).any())
        return differs

    def _hold_temperature(self, chunk: Chunk) -> Chunk:
        """Fills gaps in temperature, which is often logged less often, with the value before."""
        if chunk.temperature is None or not np.isnan(chunk.temperature).any():
            return chunk
        before = np.nan
        if self._last is not None and self._last.temperature is not None:
            before = self._last.temperature[-1]
        values = np.concatenate([[before], chunk.temperature])
        latest = np.maximum.accumulate(np.where(np.isnan(values), 0, np.arange(len(values))))
        return replace(chunk, temperature=values[latest][1:])

    def _refuse_degrees(self, chunk: Chunk) -> None:
        """Raises `LogError` where rates of unknown unit are too large for rad/s, but for single samples."""
        if not self._radians_are_guessed or len(chunk) == 0:
            return
        largest = np.nan_to_num(largest_each(chunk.gyroscope))
        fast = (largest > IMPOSSIBLE_RAD_PER_S) & (largest < LARGEST_SI)
        fast &= ~_stand_alone(chunk.gyroscope, IMPOSSIBLE_RAD_PER_S)
        if fast.any():
            at = int(np.where(fast, largest, 0.0).argmax())
            seen = f"{float(largest[at]):.6g} at {float(chunk.time[at]):.6f} s"
            raise LogError(
                f"{self._track.source}: gyroscope was assumed to be in rad/s, as no unit is stated, but "
                f"reads {seen}; give --gyroscope-unit (deg/s?)"
            )

    def _check_totals(self) -> None:
        counts = self.counts
        lines = counts.read + counts.bad_lines.count
        if counts.bad_lines.count > _LARGEST_SHARE_OF_BAD_LINES * lines:
            raise LogError(
                f"{self._track.source}: {counts.bad_lines.count} of {lines} lines "
                f"are bad, {counts.bad_lines.first}; up to 1 % can be left out: repair the log"
            )
        if counts.read == 0:
            raise LogError(f"{self._track.source}: holds no samples")
        if counts.impossible.count > _LARGEST_SHARE_WITHOUT_NUMBER * counts.read:
            raise LogError(
                f"{self._track.source}: {counts.impossible.count} of {counts.read} samples are what no "
                f"sensor reads: {counts.impossible.first}; up to 1 % would be left out, but this is a fault: "
                "check columns and units, or repair the log"
            )
        if self._keep_faults:
            return
        if counts.without_number > _LARGEST_SHARE_WITHOUT_NUMBER * counts.read:
            name, found = max(counts.channels.items(), key=lambda item: item[1])
            raise LogError(
                f"{self._track.source}: {name} is no number in {found} of {counts.read} samples; "
                "up to 1 % would be left out, but this is a fault: repair or cut the log"
            )
        if clocks_clash(counts.clashes, counts.read):
            raise LogError(
                f"{self._track.source}: {counts.clashes} of {counts.read} samples share the time stamp of "
                "the one before but not its values: the clock of the log is too coarse; read it with --rate"
            )


def clocks_clash(clashes: int, samples: int) -> bool:
    """Returns whether so many samples share a stamp but no readings that the clock is too coarse for them."""
    return clashes > _LARGEST_SHARE_OF_CLASHES * samples


def _stand_alone(values: FloatArray, least: float) -> Mask:
    """Finds the samples of (n, 3) that read more than `least` and twice what those beside them do."""
    largest = np.nan_to_num(largest_each(values))
    if len(largest) < 2:
        return largest > least
    before = np.concatenate([largest[1:2], largest[:-1]])
    after = np.concatenate([largest[1:], largest[-2:-1]])
    return (largest > least) & (0.5 * largest > before) & (0.5 * largest > after)


def _change_of_clock(step: float) -> str:
    """Returns why the clock of a wall steps back by so many s, with the remedy; empty for all other steps."""
    if abs(step + _HOUR) < _LONGEST_STEP:
        return "as clocks do at the end of summer time; write times in UTC"
    if abs(step + _DAY) < _LONGEST_STEP:
        return "as times of day do at midnight; write the date before them"
    return ""
