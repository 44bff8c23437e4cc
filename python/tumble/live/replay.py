"""A log at its own pace, as if it were recorded just now: `replay:LOG:NAME?speed=1`."""

from __future__ import annotations

import math
from dataclasses import replace
from types import TracebackType

import numpy as np

from tumble.foundation import clock
from tumble.foundation.recording import Chunk, FloatArray, Recording
from tumble.live.address import Address
from tumble.live.conditioning import EMPTY
from tumble.live.source import LOG_CLOCK, LiveChunk, PolledSource
from tumble.logs import open_recording
from tumble.logs.magnetic_rows import MagneticRows
from tumble.logs.options import ReadOptions
from tumble.logs.session import RecordedColumn, wheels_of

PIECE_SAMPLES = 50
"""Samples given together where the pace does not matter."""


def open_replay(address: Address, options: ReadOptions) -> ReplaySource:
    """Opens a log as a source; `speed=2` replays it twice as fast, `speed=max` at full speed.

    Raises `LogError` where there is no such log.
    """
    address.refuse_other_settings("speed")
    unlimited = address.settings.get("speed") == "max"
    speed = np.inf if unlimited else address.number("speed", 1.0)
    recording = open_recording(address.place, replace(options, live_times=True))
    recording.need_both_triads("a live procedure")
    return ReplaySource(recording, speed, wheels_of(recording.metadata.source))


class ReplaySource(PolledSource):
    """Replays a recording; a `Source` that ends where the recording ends."""

    clock = LOG_CLOCK

    def __init__(self, recording: Recording, speed: float, wheels: RecordedColumn | None = None) -> None:
        self.name = recording.name
        self.remarks = recording.metadata.remarks
        self.serial = recording.metadata.serial
        self.already_corrected = recording.metadata.already_corrected
        self.gyroscope_unit_is_assumed = recording.metadata.gyroscope_unit.is_guessed_radians
        self._chunks = (chunk for chunk in recording.chunks() if len(chunk))
        self._speed = speed
        self._chunk: Chunk | None = None
        self._wheels = wheels
        self._moving: FloatArray | None = None
        """State of the wheels in the chunk."""
        track = recording.magnetic
        self._rows = None if track is None else MagneticRows(track)
        self._field: FloatArray | None = None
        """(n, 3) uT in the rows of the chunk."""
        self._done = 0
        """Samples of the chunk that were given."""
        self._began, self._start = math.nan, math.nan
        """s of this machine's clock and of the log at the first sample."""

    def __enter__(self) -> ReplaySource:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def fileno(self) -> None:
        """See `Source`."""

    def read(self) -> LiveChunk:
        """See `Source`."""
        chunk = self._unfinished()
        if math.isinf(self._speed):
            return self._given(chunk, self._done + PIECE_SAMPLES, None)
        up_to = int(np.searchsorted(chunk.time, self._due(), side="right"))
        return self._given(chunk, up_to, clock.now()) if up_to > self._done else EMPTY

    def wait(self, longest: float) -> None:
        """Waits until the next sample is due, `longest` s at most."""
        if self._chunk is None or self._done >= len(self._chunk) or math.isinf(self._speed):
            return
        ahead = (float(self._chunk.time[self._done]) - self._due()) / self._speed
        if ahead > 0.0:
            clock.sleep(min(longest, ahead))

    def _unfinished(self) -> Chunk:
        """Returns the chunk that has samples left; raises `EOFError` after the last one."""
        if self._chunk is None or self._done >= len(self._chunk):
            self._chunk, self._done = next(self._chunks, None), 0
            if self._wheels is not None and self._chunk is not None:
                self._moving = self._wheels.take(len(self._chunk))
            if self._rows is not None and self._chunk is not None:
                self._field = self._rows.beside(self._chunk).field
        if self._chunk is None:
            raise EOFError
        if math.isnan(self._began):
            self._began, self._start = clock.now(), float(self._chunk.time[0])
        return self._chunk

    def _due(self) -> float:
        """Returns the time of the log that it is by now, s."""
        return self._start + (clock.now() - self._began) * self._speed

    def _given(self, chunk: Chunk, up_to: int, arrival: float | None) -> LiveChunk:
        part = slice(self._done, up_to)
        self._done = up_to
        temperature = None if chunk.temperature is None else chunk.temperature[part]
        moving = None if self._moving is None else self._moving[part]
        return LiveChunk(
            chunk.time[part],
            chunk.accelerometer[part],
            chunk.gyroscope[part],
            temperature,
            moving,
            arrival,
            field=None if self._field is None else self._field[part],
        )
