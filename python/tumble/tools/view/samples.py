"""Samples of one unit, kept while its recording is shown: raw, and corrected where a calibration is given."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Final, Literal

import numpy as np

from tumble.calibration.document import Calibration
from tumble.calibration.turned_axes import in_axes
from tumble.foundation.magnetic import MAGNETIC_CHANNELS, MagneticTrack
from tumble.foundation.recording import Chunk, FloatArray, Recording, SampleProgress
from tumble.foundation.timing import TimeWatch
from tumble.foundation.units import CHANNELS, TRIADS, Triad, channels_of
from tumble.logs import ChunkStream, Counts
from tumble.logs.ahead import ahead
from tumble.tools.apply.magnetic import corrected_magnetometer
from tumble.tools.view.column import Extremes, GrowingColumn
from tumble.tools.view.levels import level
from tumble.tools.viewers.content import Form

TEMPERATURE: Final = "temperature"
HELD: Final = 1.0
"""s for which a reading of a magnetometer is shown where no other follows."""
PAUSE: Final = 1.0
"""s between the files of a recording, of which each has a clock of its own; the core puts as much there."""
CHUNK: Final = 1 << 16
"""Samples of a chunk that is read again."""


@dataclass(frozen=True, slots=True)
class SampleLine:
    """Samples of one channel that show it in a window."""

    channel: str
    """`ax` to `gz`, `mx` to `mz`, or `temperature`."""
    form: Form
    time: FloatArray
    """(n,) s from the start of what is shown."""
    value: FloatArray
    """(n,) SI units; NaN between samples with a gap between them."""


@dataclass(slots=True)
class _Part:
    """Samples with one clock: those of a recording, or of one of its files."""

    recording: Recording
    first: int
    """Number of its first sample."""
    zero: float
    """Time, s of its clock, at which the time shown is `begins`."""
    begins: float
    """s of the time shown."""
    counts: Counts


class KeptSamples:
    """Samples of one unit on disk, at any level of detail.

    `read` is called once, on any thread; all else may be called meanwhile, for what is there.
    """

    def __init__(self, recording: Recording, calibration: Calibration | None = None) -> None:
        self.recording = recording
        self.calibration = calibration
        self.is_read = False
        self.offset = 0.0
        """s to add to its times, where it began after others on the same clock."""
        self._columns: dict[tuple[Form, str], GrowingColumn] = {}
        self._extremes: dict[tuple[Form, str], Extremes] = {}
        self._time = GrowingColumn()
        self._length = 0
        self._parts: list[_Part] = []
        self._gaps: list[int] = []

    def __len__(self) -> int:
        return self._length

    @property
    def name(self) -> str:
        """Short name of the recording."""
        return self.recording.name

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that were recorded, magnetometer and temperature last."""
        warmth = (TEMPERATURE,) if ("raw", TEMPERATURE) in self._columns else ()
        magnetic = MAGNETIC_CHANNELS if ("raw", MAGNETIC_CHANNELS[0]) in self._columns else ()
        return (*self.recording.metadata.channels, *magnetic, *warmth)

    @property
    def start(self) -> float:
        """Time of the first sample, s of the recording's own clock; NaN before there is one."""
        return self._parts[0].zero if self._parts else float("nan")

    @property
    def duration(self) -> float:
        """Time shown of the last sample so far, s."""
        return float(self._shown(np.array([self._length - 1]))[0]) if self._length else 0.0

    def read(self, progress: SampleProgress | None = None) -> None:
        """Reads the recording; `progress` receives the samples done, and those expected where known.

        Raises `LogError` where it breaks off or is not fit to use, or the disk is full.
        """
        fields = self._fields()
        for part in self.recording.parts or (self.recording,):
            begins = self.duration + PAUSE if self._parts else 0.0
            watch, counts, is_first = TimeWatch(), Counts(), True
            stream = part.chunks()
            for chunk in ahead(stream):
                if is_first:
                    if self._length:
                        self._gaps.append(self._length - 1)
                    self._parts.append(_Part(part, self._length, float(chunk.time[0]), begins, counts))
                self._append(chunk, watch, fields)
                is_first = False
                if progress is not None:
                    progress(self._length, stream.expected if isinstance(stream, ChunkStream) else None)
            if isinstance(stream, ChunkStream):
                counts.add(stream.counts)
        self.is_read = True

    def _fields(self) -> dict[Form, MagneticTrack]:
        """Reads the magnetometer, raw and corrected; none of a recording of several files."""
        track = None if self.recording.parts else self.recording.magnetic
        if track is None or not len(track):
            return {}
        found: dict[Form, MagneticTrack] = {"raw": track}
        if self.calibration is not None and self.calibration.magnetometer is not None:
            corrected = corrected_magnetometer(self.calibration, self.recording)
            found["calibrated"] = track if corrected is None else corrected
        return found

    def _append(self, chunk: Chunk, watch: TimeWatch, fields: Mapping[Form, MagneticTrack]) -> None:
        steps = np.diff(chunk.time, prepend=watch.end)
        watch.push(chunk.time)
        gaps = np.flatnonzero(steps > watch.longest_step)
        self._keep("raw", chunk)
        if self.calibration is not None:
            calibration = in_axes(self.calibration, self.recording.metadata.body)
            force, rate = calibration.correct(chunk.accelerometer, chunk.gyroscope, chunk.temperature)
            self._keep("calibrated", replace(chunk, accelerometer=force, gyroscope=rate, temperature=None))
        for form, track in fields.items():
            held = _held(track, chunk.time)
            for axis, channel in enumerate(MAGNETIC_CHANNELS):
                self._push(form, channel, held[:, axis])
        self._time.append(chunk.time)
        self._gaps += (self._length + gaps - 1).tolist()
        self._length += len(chunk)

    def _keep(self, form: Form, chunk: Chunk) -> None:
        recorded = self.recording.metadata.channels
        for triad in TRIADS:
            for axis, channel in enumerate(channels_of(triad)):
                if channel in recorded:
                    self._push(form, channel, getattr(chunk, triad)[:, axis])
        if chunk.temperature is not None:
            self._push(form, TEMPERATURE, chunk.temperature)

    def _push(self, form: Form, channel: str, values: FloatArray) -> None:
        if (form, channel) not in self._columns:
            self._columns[form, channel], self._extremes[form, channel] = GrowingColumn(), Extremes()
        column, extremes = self._columns[form, channel], self._extremes[form, channel]
        if len(column) < self._length:
            # Temperature that only began later was not a number before.
            missing = np.full(self._length - len(column), np.nan)
            column.append(missing)
            extremes.append(missing)
        column.append(values)
        extremes.append(np.ascontiguousarray(values))

    def lines(
        self, start: float, end: float, bins: int, forms: tuple[Form, ...] = ("raw",)
    ) -> list[SampleLine]:
        """Returns the samples that show the window from `start` to `end`, s, in so many bins.

        One sample to either side is among them, so that lines reach the edges.
        """
        first, last = self._window(start, end)
        width = (end - start) / bins
        return [
            self._line(form, channel, first, last, bins, width)
            for form in forms
            for channel in self.channels
            if (form, channel) in self._columns
        ]

    def _line(self, form: Form, channel: str, first: int, last: int, bins: int, width: float) -> SampleLine:
        column = self._columns[form, channel]
        last = min(last, len(column))
        places = level(column, self._extremes[form, channel], first, last, bins)
        time, value = self._shown(places), column.values()[places]
        gaps = np.array(self._gaps, np.int64)
        gaps = gaps[(gaps >= first) & (gaps < last - 1)]
        if len(gaps):
            before, after = self._shown(gaps), self._shown(gaps + 1)
            at = np.searchsorted(places, gaps, side="right")
            # Gaps that are narrower than a bin cannot be seen, unless all samples are.
            seen = (after - before > width) | (np.diff(places, append=last)[at - 1] == 1)
            time = np.insert(time, at[seen], 0.5 * (before + after)[seen])
            value = np.insert(value, at[seen], np.nan)
        return SampleLine(channel, form, time, value)

    def _window(self, start: float, end: float) -> tuple[int, int]:
        """Returns the numbers of the first sample that is shown, and of that after the last."""
        first, last = self._at(start, "left"), self._at(end, "right")
        return max(first - 1, 0), min(last + 1, self._length)

    def _at(self, shown: float, side: Literal["left", "right"]) -> int:
        """Returns the number of the first sample not before (`left`), or after (`right`), a time shown, s."""
        times = self._time.values()
        place = 0
        for part, after in self._spans():
            if part.begins + self.offset > shown:
                break
            time = part.zero + (shown - self.offset - part.begins)
            place = part.first + int(np.searchsorted(times[part.first : after], time, side))
        return place

    def _spans(self) -> Iterator[tuple[_Part, int]]:
        """Returns each part, and the number of the sample after its last."""
        parts = tuple(self._parts)  # `read` may add one meanwhile
        ends = [part.first for part in parts[1:]]
        return zip(parts, [*ends, self._length][: len(parts)], strict=True)

    def _shown(self, places: np.ndarray[tuple[int], np.dtype[np.int64]]) -> FloatArray:
        """Returns the times shown of samples (n,), s."""
        time = np.array(self._time.values()[places])
        firsts = np.array([part.first for part in self._parts])
        of_part = np.searchsorted(firsts, places, side="right") - 1
        shift = np.array([part.begins - part.zero for part in self._parts])
        shown: FloatArray = time + shift[of_part] + self.offset
        return shown

    def shown_time(self, time: float) -> float:
        """Returns the time shown of a time as acquisition has it, s.

        That is the recording's own clock; the core, too, lets the files of poses follow one another.
        """
        return time - self.start + self.offset

    def stretches(self, start: float, end: float) -> list[slice]:
        """Returns runs of samples without a gap in a section, s of the time shown."""
        first, last = self._at(start, "left"), self._at(end, "right")
        cuts = [gap + 1 for gap in self._gaps if first <= gap < last - 1]
        return [slice(*run) for run in pairwise([first, *cuts, last]) if run[1] > run[0]]

    def values(self, form: Form, channel: str, rows: slice) -> FloatArray:
        """Returns the values of a channel, mapped: (n,) in SI units."""
        return self._columns[form, channel].values()[rows]

    def interval(self, rows: slice) -> float:
        """Returns the mean time between samples of a run without gaps, s; NaN for fewer than two."""
        time = self._time.values()[rows]
        return float(time[-1] - time[0]) / (len(time) - 1) if len(time) > 1 else float("nan")

    def kept(self) -> Recording:
        """Returns the recording as it was read, without its file being read again.

        Its samples, facts and counts are those of the log; only `read` must have come to its end.
        """
        spans = list(self._spans())
        parts = tuple(
            replace(part.recording, open=partial(_Kept, self, part, after), parts=()) for part, after in spans
        )
        if not self.recording.parts:
            return parts[0]
        return Recording(
            self.recording.metadata, lambda: (chunk for part in parts for chunk in part.chunks()), parts
        )

    def cut(self, sections: list[tuple[float, float]]) -> Recording:
        """Returns the recording without what is in none of the sections, s of the time shown."""
        remark = "only from " + ", ".join(f"{start:.3f} to {end:.3f} s" for start, end in sections)
        parts = []
        for part, _ in self._spans():
            shift = part.zero - part.begins - self.offset
            own = [(start + shift, end + shift) for start, end in sections]
            parts.append(replace(part.recording, open=partial(_cut, part.recording, own)))
        about = replace(self.recording.metadata, remarks=(*self.recording.metadata.remarks, remark))
        if not self.recording.parts:
            return replace(parts[0], metadata=about)
        return Recording(about, lambda: (chunk for part in parts for chunk in part.chunks()), tuple(parts))

    def chunk(self, rows: slice) -> Chunk:
        """Returns samples as they were read."""
        count = len(self._time.values()[rows])

        def triad(name: Triad) -> FloatArray:
            values = np.full((count, 3), np.nan)
            for axis, channel in enumerate(channels_of(name)):
                if ("raw", channel) in self._columns:
                    values[:, axis] = self.values("raw", channel, rows)
            return values

        warmth = np.array(self.values("raw", TEMPERATURE, rows)) if TEMPERATURE in self.channels else None
        return Chunk(np.array(self._time.values()[rows]), triad("accelerometer"), triad("gyroscope"), warmth)

    def close(self) -> None:
        """Gives the disk free."""
        for column in (self._time, *self._columns.values()):
            column.close()


class _Kept(ChunkStream):
    """A pass over samples that were read before."""

    def __init__(self, samples: KeptSamples, part: _Part, after: int) -> None:
        self.counts, self.expected = part.counts, after - part.first
        self._chunks = (
            samples.chunk(slice(first, min(first + CHUNK, after)))
            for first in range(part.first, after, CHUNK)
        )

    def __next__(self) -> Chunk:
        return next(self._chunks)

    def close(self) -> None:
        """Has no file to let go of."""


class _Cut(ChunkStream):
    """A pass over those samples of another that are in sections, s of its clock."""

    def __init__(self, stream: Iterator[Chunk], sections: list[tuple[float, float]]) -> None:
        self._stream, self._sections = stream, sections
        self.counts, self.expected = Counts(), None
        if isinstance(stream, ChunkStream):
            self.counts, self.expected = stream.counts, stream.expected

    def __next__(self) -> Chunk:
        while True:
            chunk = next(self._stream)
            inside = np.zeros(len(chunk), np.bool_)
            for start, end in self._sections:
                inside |= (chunk.time >= start) & (chunk.time <= end)
            if inside.any():
                return chunk if inside.all() else _rows(chunk, inside)

    def close(self) -> None:
        """Lets go of the file."""
        if isinstance(self._stream, ChunkStream):
            self._stream.close()


def _cut(recording: Recording, sections: list[tuple[float, float]]) -> _Cut:
    return _Cut(recording.chunks(), sections)


def _rows(chunk: Chunk, inside: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Chunk:
    return Chunk(
        chunk.time[inside],
        chunk.accelerometer[inside],
        chunk.gyroscope[inside],
        None if chunk.temperature is None else chunk.temperature[inside],
        received=None if chunk.received is None else chunk.received[inside],
    )


def _held(track: MagneticTrack, time: FloatArray) -> FloatArray:
    """Returns the latest reading at each time, (n, 3) uT; NaN before the first, and `HELD` s after one."""
    latest = np.searchsorted(track.time, time, side="right") - 1
    is_held = (latest >= 0) & (time - track.time[latest] <= HELD)
    return np.where(is_held[:, np.newaxis], track.field[latest], np.nan)


def channel_name(channel: str) -> str:
    """Names a channel as people do: `accelerometer x`."""
    if channel in MAGNETIC_CHANNELS:
        return f"magnetometer {channel[-1]}"
    if channel not in CHANNELS:
        return channel
    return f"{TRIADS[CHANNELS.index(channel) // 3]} {channel[-1]}"
