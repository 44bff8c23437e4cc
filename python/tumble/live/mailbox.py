"""Messages that another thread receives, for a source that is waited on by a descriptor."""

from __future__ import annotations

import os
from collections import deque
from contextlib import suppress
from threading import Lock
from typing import Final

MOST_KEPT: Final = 4096
"""Messages that wait for their reader before the oldest is lost."""
MOST_BYTES: Final = 1 << 23
"""Bytes that wait for their reader before the oldest message is lost."""
AT_ONCE: Final = 1 << 18
"""Bytes that are taken at once, but for one message: whoever decodes them looks around in between."""


class Mailbox:
    """Keeps messages in order of arrival; its descriptor is readable as soon as one has come."""

    def __init__(self) -> None:
        self.lost = 0
        """Messages that were lost because nobody read them in time."""
        self._waiting: deque[bytes] = deque()
        self._bytes = 0
        self._lock = Lock()
        self._ready, self._signal = os.pipe()
        for descriptor in (self._ready, self._signal):
            os.set_blocking(descriptor, False)
        self._failure: Exception | None = None
        self._is_open = True

    def fileno(self) -> int:
        """Returns a descriptor that is readable once something has come."""
        return self._ready

    def put(self, message: bytes) -> None:
        """Adds a message; called by the thread that receives them."""
        with self._lock:
            self._waiting.append(message)
            self._bytes += len(message)
            while len(self._waiting) > MOST_KEPT or self._bytes > MOST_BYTES:
                self._next()
                self.lost += 1
            self._wake()

    def _next(self) -> bytes:
        message = self._waiting.popleft()
        self._bytes -= len(message)
        return message

    def fail(self, error: Exception) -> None:
        """Has `take` raise an error once what came before it was taken."""
        with self._lock:
            self._failure = error
            self._wake()

    def _wake(self) -> None:
        # A full pipe is readable as it is.
        with suppress(BlockingIOError):
            if self._is_open:
                os.write(self._signal, b"\0")

    def take(self) -> list[bytes]:
        """Returns what has come since, `AT_ONCE` bytes of it or one message; raises what `fail` was given.

        The descriptor stays readable while more waits.
        """
        with suppress(BlockingIOError):
            os.read(self._ready, MOST_KEPT)
        with self._lock:
            found: list[bytes] = []
            taken = 0
            while self._waiting and (not found or taken + len(self._waiting[0]) <= AT_ONCE):
                found.append(self._next())
                taken += len(found[-1])
            if self._waiting:
                self._wake()
            failure = self._failure
        if failure is not None and not found:
            raise failure
        return found

    def close(self) -> None:
        """Closes the descriptor; messages that come later are dropped."""
        with self._lock:
            if self._is_open:
                self._is_open = False
                os.close(self._ready)
                os.close(self._signal)
