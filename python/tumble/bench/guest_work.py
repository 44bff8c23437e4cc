"""Work for browsers that do not hold the bench: so much at once, then a rate that leaves time for the run.

To build a page takes a thousand times as long as to ask for it, and to take a message apart ten times as long
as to send it. Whoever asks again and again would take the time of the server, which reads samples and stops
tables, and its memory.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from tumble.bench.authority import is_allowed
from tumble.foundation import clock

WORK_OF_A_PAGE = 10
"""Work of a page that is built, in files that are sent; a page takes 21 ms of a processor."""
MOST_WORK = 1000
"""Work at once: 20 pages, with the files of each."""
WORK_OF_A_MESSAGE = 8192
"""Bytes of a message on a socket that are taken apart as long as a file of a page is sent."""
MOST_WORK_OF_MESSAGES = 100
"""Work at once: a fifth of a second of a processor."""
WORK_A_SECOND = 100
"""Work a second after that: a fifth of a processor, and 10 pages."""
WORK_OF_A_PROCESSOR = 500
"""Work that a processor does in a second, as pages and messages were measured."""
_TURNS_OF_THE_LOOP = 12
"""Turns of the event loop from one beginning to the next. The work itself begins in one of them, so that all
others, a stop among them, come between two works; from the socket to its handler a message takes six."""


class GuestWork:
    """Gives turns to guests once too much was asked for; each group of them waits in a line of its own."""

    def __init__(self, most: int = MOST_WORK) -> None:
        self._most = self._left = float(most)
        self._seen = clock.now()
        self._lines: dict[str, asyncio.Lock] = {}
        self._waiting: Counter[str] = Counter()
        self._turn = asyncio.Lock()

    async def begin(self, group: str, work: int) -> None:
        """Waits until there is time for the work of a group of guests, one work after the other."""
        line = self._lines.setdefault(group, asyncio.Lock())
        self._waiting[group] += 1
        try:
            async with line, self._turn:
                while not self._is_taken(work):
                    await asyncio.sleep((work - self._left) / WORK_A_SECOND)
                for _ in range(_TURNS_OF_THE_LOOP):
                    await asyncio.sleep(0)
        finally:
            self._waiting[group] -= 1
            if not self._waiting[group]:
                del self._waiting[group], self._lines[group]

    def charge(self, seconds: float) -> None:
        """Takes the time that work took beyond what was taken as it began, though none may be left."""
        self._left -= seconds * WORK_OF_A_PROCESSOR

    def _is_taken(self, work: int) -> bool:
        """Takes the time for work where there is some left."""
        now = clock.now()
        self._left = min(self._most, self._left + (now - self._seen) * WORK_A_SECOND)
        self._seen = now
        if self._left < work:
            return False
        self._left -= work
        return True


_charged: ContextVar[GuestWork | None] = ContextVar("charged", default=None)
"""Work of guests to which is charged what takes long; None for the bench itself."""


@contextmanager
def charged_to(work: GuestWork | None) -> Iterator[None]:
    """Has `charge_step` charge some work while the block runs, and in the tasks that it begins."""
    before = _charged.set(work)
    try:
        yield
    finally:
        _charged.reset(before)


def charge(seconds: float) -> None:
    """Charges the guest who acts, if one does, for a time of a processor."""
    work = _charged.get()
    if work is not None and not is_allowed():
        work.charge(seconds)


def charge_step(covered: int = 0) -> None:
    """Charges the guest who acts, if one does, what the event loop does from now on in this step of it.

    `covered` is the work that was taken before.
    """
    began = clock.now()
    end_of_step = asyncio.get_running_loop().call_soon
    end_of_step(lambda: charge(max(clock.now() - began - covered / WORK_OF_A_PROCESSOR, 0.0)))
