"""A log at its own pace, as if it were recorded just now: `replay:LOG:NAME?speed=1`."""

from __future__ import annotations

import time
from collections.abc import Iterator
from types import TracebackType

import numpy as np

from tumble.live.address import Address
from tumble.live.conditioning import EMPTY
from tumble.live.source import HEARTBEAT, LiveChunk
from tumble.logs import open_recording
from tumble.logs.options import ReadOptions
from tumble.recording import Chunk, Recording

PIECE_SAMPLES = 50
"""Samples given together where the pace does not matter."""


def open_replay(address: Address, options: ReadOptions) -> ReplaySource:
    """Make a source of a log; `speed=2` replays it twice as fast, `speed=max` as fast as it can be read.

    Raises `LogError` where there is no such log.
    """
    address.refuse_other_settings("speed")
    unlimited = address.settings.get("speed") == "max"
    speed = np.inf if unlimited else address.number("speed", 1.0)
    recording = open_recording(address.place, options)
    recording.need_both_triads("a spin")
    return ReplaySource(recording, speed)


class ReplaySource:
    """Replays a recording; a `Source` that ends where the recording ends."""

    def __init__(self, recording: Recording, speed: float) -> None:
        self.name = recording.name
        self.remarks = recording.metadata.remarks
        self.gyroscope_unit_is_assumed = recording.metadata.gyroscope_unit.reason == "assumed"
        self._recording = recording
        self._speed = speed

    def __enter__(self) -> ReplaySource:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def __iter__(self) -> Iterator[LiveChunk]:
        return self._unpaced() if np.isinf(self._speed) else self._paced()

    def _unpaced(self) -> Iterator[LiveChunk]:
        for chunk in self._recording.chunks():
            for first in range(0, len(chunk), PIECE_SAMPLES):
                yield _part(chunk, first, first + PIECE_SAMPLES)

    def _paced(self) -> Iterator[LiveChunk]:
        began = time.monotonic()
        start: float | None = None
        for chunk in self._recording.chunks():
            start = float(chunk.time[0]) if start is None else start
            done = 0
            while done < len(chunk):
                due = start + (time.monotonic() - began) * self._speed
                up_to = int(np.searchsorted(chunk.time, due, side="right"))
                yield _part(chunk, done, up_to) if up_to > done else EMPTY
                done = max(done, up_to)
                if done < len(chunk):
                    ahead = (float(chunk.time[done]) - due) / self._speed
                    time.sleep(min(HEARTBEAT, max(0.0, ahead)))


def _part(chunk: Chunk, first: int, last: int) -> LiveChunk:
    part = slice(first, last)
    temperature = None if chunk.temperature is None else chunk.temperature[part]
    return LiveChunk(chunk.time[part], chunk.accelerometer[part], chunk.gyroscope[part], temperature)
