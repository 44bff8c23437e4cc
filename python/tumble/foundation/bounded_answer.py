"""A bound of time and memory for a library that keeps whatever another program answers."""

from __future__ import annotations

import os
from collections.abc import Callable, Coroutine, Generator
from pathlib import Path
from typing import TypeVar

from tumble.foundation import clock
from tumble.foundation.regular_files import open_regular

Wanted = TypeVar("Wanted")
Ready = TypeVar("Ready")
Answer = TypeVar("Answer")

ANSWERING = 120.0
"""s to wait for the whole answer of a server."""
LARGEST_ANSWER = 1 << 30
"""Bytes of memory for that answer."""
_LOOK_EVERY = 0.05
"""s between two looks at an answer that a library takes in: a fast server sends 50 MB meanwhile."""
_OF_PROCESS = Path("/proc/self/statm")
"""Sizes of the process in pages, of which the second is in use."""


def bounded_answer(
    answer: Generator[Wanted, Ready, Answer], seconds: float, largest: int
) -> Generator[Wanted, Ready, Answer]:
    """Goes on with an answer that comes piece by piece, and gives it back once it is whole.

    Raises `TimeoutError` where it takes more than so many s, and `MemoryError` where the process grows by
    more than `largest` bytes meanwhile; only Linux shows that.
    """
    bound = _Bound(seconds, largest)
    try:
        wanted = next(answer)
        while True:
            bound.check()
            wanted = answer.send((yield wanted))
    except StopIteration as end:
        whole: Answer = end.value
        return whole


async def awaited_within(
    work: Callable[[], Coroutine[object, object, Answer]], seconds: float, largest: int
) -> Answer:
    """Awaits an answer that a library takes in by itself; raises as `bounded_answer` does."""
    import asyncio

    bound, task = _Bound(seconds, largest), asyncio.ensure_future(work())
    try:
        while not (await asyncio.wait({task}, timeout=_LOOK_EVERY))[0]:
            bound.check()
        return task.result()
    finally:
        task.cancel()


class _Bound:
    """Time and memory from now on."""

    def __init__(self, seconds: float, largest: int) -> None:
        self._seconds, self._largest = seconds, largest
        self._begun, self._memory = clock.now(), _memory_in_use()

    def check(self) -> None:
        """Raises `TimeoutError` or `MemoryError` where one of them is beyond its bound."""
        if clock.now() - self._begun > self._seconds:
            raise TimeoutError(f"sends no whole answer within {self._seconds:g} s")
        if _memory_in_use() - self._memory > self._largest:
            raise MemoryError(f"sends an answer of more than {self._largest >> 20} MiB")


def _memory_in_use() -> int:
    """Returns the memory of this process, bytes; 0 where the system does not show it."""
    try:
        with open_regular(_OF_PROCESS) as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return 0
