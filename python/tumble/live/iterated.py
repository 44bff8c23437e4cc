"""A source that can only be iterated, read by a thread so that it can be waited for like any other."""

from __future__ import annotations

import queue
import socket
import threading
from dataclasses import replace
from types import TracebackType

from tumble.foundation import clock
from tumble.live.conditioning import EMPTY
from tumble.live.source import HEARTBEAT, LiveChunk, PolledSource, Source

MOST_KEPT = 100
"""Chunks that a reader may be behind; the thread waits then, as the source itself would have to."""


class IteratedSource(PolledSource):
    """Iterates a source in a thread of its own."""

    def __init__(self, source: Source) -> None:
        self.name = source.name
        self.clock = getattr(source, "clock", "")
        self.serial = getattr(source, "serial", "")
        self.already_corrected = getattr(source, "already_corrected", None)
        self._source = source
        self._come: queue.Queue[LiveChunk | Exception] = queue.Queue(MOST_KEPT)
        self._has_room = threading.Event()
        self._left = threading.Event()
        self._here: socket.socket | None = None
        self._there: socket.socket | None = None
        self._thread = clock.thread(self._iterate)

    @property
    def remarks(self) -> tuple[str, ...]:
        """See `Source`."""
        return self._source.remarks

    @property
    def gyroscope_unit_is_assumed(self) -> bool:
        """See `Source`."""
        return self._source.gyroscope_unit_is_assumed

    def __enter__(self) -> IteratedSource:
        self._source.__enter__()
        self._here, self._there = socket.socketpair()
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._left.set()
        clock.wait(self._thread, 2.0 * HEARTBEAT)
        for end in (self._here, self._there):
            if end is not None:
                end.close()
        self._source.__exit__(kind, error, trace)

    def fileno(self) -> int:
        """See `Source`."""
        assert self._here is not None, "a source is waited for while it is open"
        return self._here.fileno()

    def read(self) -> LiveChunk:
        """See `Source`."""
        assert self._here is not None, "a source is read while it is open"
        try:
            come = self._come.get_nowait()
        except queue.Empty:
            return EMPTY
        if isinstance(come, Exception):
            # The byte stays, so that the next call receives it again.
            self._come.put(come)
            raise come
        self._has_room.set()
        self._here.recv(1)
        return come

    def _iterate(self) -> None:
        try:
            for chunk in self._source:
                if self._left.is_set():
                    return
                if len(chunk):
                    self._give(chunk if chunk.arrival is not None else replace(chunk, arrival=clock.now()))
        except Exception as error:
            self._give(error)
        else:
            self._give(EOFError())

    def _give(self, come: LiveChunk | Exception) -> None:
        """Passes on the chunk, with one byte that wakes the waiting reader."""
        while not self._left.is_set():
            self._has_room.clear()
            try:
                self._come.put_nowait(come)
            except queue.Full:
                clock.wait(self._has_room, HEARTBEAT)
                continue
            assert self._there is not None, "the thread runs while the source is open"
            self._there.send(b".")
            return
