"""Estimates from a session so far, computed in the background while it records."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Future
from typing import Generic, TypeVar

from tumble.foundation import clock

SHARE_OF_TIME = 0.1
"""Largest share of time that computing may take, unless it is hurried."""

Found = TypeVar("Found")


class Finding(Generic[Found]):
    """Runs one thing at a time."""

    def __init__(self) -> None:
        self._worker = clock.executor()
        self._running: Future[Found] | None = None
        self._began = 0.0
        self._due = -math.inf

    @property
    def is_running(self) -> bool:
        """Returns whether an estimate is being computed."""
        return self._running is not None and not self._running.done()

    @property
    def is_due(self) -> bool:
        """Returns whether it is time for the next estimate."""
        return self._running is None and clock.now() >= self._due

    def hurry(self) -> None:
        """Makes the next estimate due as soon as the running one is finished."""
        self._due = -math.inf

    def begin(self, find: Callable[[], Found]) -> None:
        """Starts the next estimate, once `take` gave the result of the last."""
        self._began, self._due = clock.now(), math.inf
        self._running = self._worker.submit(find)

    def take(self) -> Found | None:
        """Returns what was found, once; None where there is nothing new."""
        if self._running is None or not self._running.done():
            return None
        found, self._running = self._running.result(), None
        now = clock.now()
        if self._due == math.inf:
            self._due = now + (now - self._began) / SHARE_OF_TIME
        return found

    def wait(self) -> None:
        """Waits for what runs."""
        if self._running is not None:
            clock.wait(self._running)

    def close(self) -> None:
        """Finds nothing more."""
        self._worker.shutdown()
