"""Interface of a live source: samples of one IMU, as they come."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Protocol

import numpy as np

from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk, FloatArray
from tumble.logs.read_as import ReadAs

HEARTBEAT = 0.1
"""Longest time, s, for which a source keeps its reader waiting without a word."""
FIRST_SAMPLE_WITHIN = 15.0
"""s to wait for the first sample: autopilots and boards that start anew take their time."""
BETWEEN_LOOKS = 0.001
"""s between two looks at a line that cannot be waited on, or at several lines that are."""
LOG_CLOCK = "log"
"""Clock of replayed logs, whose times stay as they were recorded."""


def nothing_came(name: str) -> LogError:
    """Returns the error for a source that has sent nothing for `FIRST_SAMPLE_WITHIN`."""
    return LogError(
        f"{name}: no sample came in {FIRST_SAMPLE_WITHIN:.0f} s; is the device on, does it send to this "
        "address, and is the baud rate or port right?"
    )


class UnreadableSourceError(LogError):
    """A source is not read further: whoever opens it again reads the same."""


class SourceChangedError(UnreadableSourceError):
    """A source states other columns or units than before, so that it is not read further."""


@dataclass(frozen=True, slots=True)
class LiveChunk(Chunk):
    """Samples that came together, in SI units and the case frame of the IMU; it may hold none."""

    moving: FloatArray | None = None
    """(n,) 1 where wheels turn, 0 where they stand, NaN where nobody knows; None where nobody ever does."""
    arrival: float | None = None
    """s of `clock.now()` when they came; None where none came, or a log is read as fast as can be."""
    sensor_time: FloatArray | None = None
    """(n,) s of the sensor's own clock, where `time` is that of another."""
    field: FloatArray | None = None
    """(n, 3) uT of a magnetometer, in the case frame; NaN in rows without a reading, None where none is."""

    @property
    def magnetic(self) -> MagneticTrack | None:
        """Returns the readings of the magnetometer among these samples; None where there are none."""
        if self.field is None:
            return None
        rows = np.isfinite(self.field).all(axis=1)
        return MagneticTrack(self.time[rows], self.field[rows]) if rows.any() else None

    def on_clock(self, time: FloatArray) -> LiveChunk:
        """Returns the samples with times of another clock, (n,) s; their own become `sensor_time`."""
        return LiveChunk(
            time,
            self.accelerometer,
            self.gyroscope,
            self.temperature,
            self.moving,
            self.arrival,
            self.time,
            self.field,
        )

    def part(self, which: slice) -> LiveChunk:
        """Returns some of the samples."""
        return replace(
            self, **{name: column[which] for name in _COLUMNS if (column := getattr(self, name)) is not None}
        )


_COLUMNS = ("time", "accelerometer", "gyroscope", "temperature", "moving", "sensor_time", "field")


class Source(Protocol):
    """A stream of samples that ends when whoever reads it has enough, or when there is no more.

    It is a context manager: entering it opens the line, leaving it lets go of the line. Between the two it is
    iterated once, or asked with `read` again and again. While nothing comes, iterating gives an empty chunk
    every `HEARTBEAT` seconds or so, so that its reader can distinguish silence from waiting. It ends where a
    stream has an end, as a replayed log has.

    Raises `LogError`, in one line, where the line cannot be opened, is lost, or carries data of no IMU.
    """

    @property
    def name(self) -> str:
        """Short name for tables and file names: `ttyUSB0`."""

    @property
    def clock(self) -> str:
        """Name of the clock its times are of: sources with the same non-empty one share it for certain."""

    @property
    def serial(self) -> str:
        """Serial number of the unit, where the source states one."""

    @property
    def already_corrected(self) -> bool | None:
        """True where samples are known to have been corrected before, None where nobody knows."""

    @property
    def stamped(self) -> bool:
        """Indicates whether samples carry a time of their own; otherwise their time is that of arrival."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on the samples given so far, for the user: units assumed, samples left out."""

    @property
    def gyroscope_unit_is_assumed(self) -> bool:
        """Indicates whether rad/s is an assumption that neither the stream nor the user states."""

    @property
    def read_as(self) -> ReadAs | None:
        """Columns and units of its samples, once known; None where nothing of it could be read otherwise."""

    def go_on_as(self, before: ReadAs) -> None:
        """Has it read as before, in a recording that goes on; call it before the first sample.

        A source that then states otherwise is refused by `SourceChangedError`.
        """

    def __enter__(self) -> Source: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def __iter__(self) -> Iterator[LiveChunk]: ...

    def fileno(self) -> int | None:
        """Returns a descriptor that is readable once something has come; None if there is none."""

    def read(self) -> LiveChunk:
        """Returns what has come by now, without waiting; nothing may have.

        Raises `EOFError` where a stream that has an end is at it.
        """


class PolledSource(ABC):
    """A `Source` that is waited for and then asked for what has come."""

    clock = ""
    serial = ""
    already_corrected: bool | None = None

    @property
    def read_as(self) -> ReadAs | None:
        """See `Source`."""
        return None

    def go_on_as(self, before: ReadAs) -> None:
        """See `Source`."""
        del before  # nothing of it could be read otherwise

    @property
    def stamped(self) -> bool:
        """See `Source`."""
        return True

    @abstractmethod
    def fileno(self) -> int | None:
        """See `Source`."""

    @abstractmethod
    def read(self) -> LiveChunk:
        """See `Source`."""

    def wait(self, longest: float) -> None:
        """Waits until something may have come, `longest` s at most."""
        line = self.fileno()
        if line is None:
            clock.sleep(min(BETWEEN_LOOKS, longest))
        else:
            clock.readable(line, longest)

    def __iter__(self) -> Iterator[LiveChunk]:
        while True:
            self.wait(HEARTBEAT)
            try:
                chunk = self.read()
            except EOFError:
                return
            yield chunk

    async def __aiter__(self) -> AsyncIterator[LiveChunk]:
        while True:
            await readable(self.fileno(), HEARTBEAT)
            try:
                chunk = self.read()
            except EOFError:
                return
            yield chunk


async def readable(line: int | None, longest: float) -> None:
    """Waits, while other tasks run, until a descriptor is readable, `longest` s at most."""
    import asyncio

    if line is None:
        await asyncio.sleep(min(BETWEEN_LOOKS, longest))
        return
    loop, ready = asyncio.get_running_loop(), asyncio.Event()
    timer = loop.call_later(longest, ready.set)
    loop.add_reader(line, ready.set)
    try:
        await ready.wait()
    finally:
        loop.remove_reader(line)
        timer.cancel()
