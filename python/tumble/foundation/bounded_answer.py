"""A bound of time and memory for a library that keeps whatever another program answers."""

from __future__ import annotations

import os
from collections.abc import Generator
from pathlib import Path
from typing import TypeVar

from tumble.foundation import clock
from tumble.foundation.regular_files import open_regular

Wanted = TypeVar("Wanted")
Ready = TypeVar("Ready")
Answer = TypeVar("Answer")

_OF_PROCESS = Path("/proc/self/statm")
"""Sizes of the process in pages, of which the second is in use."""


def bounded_answer(
    answer: Generator[Wanted, Ready, Answer], seconds: float, largest: int
) -> Generator[Wanted, Ready, Answer]:
    """Goes on with an answer that comes piece by piece, and gives it back once it is whole.

    Raises `TimeoutError` where it takes more than so many s, and `MemoryError` where the process grows by
    more than `largest` bytes meanwhile; only Linux shows that.
    """
    begun, memory = clock.now(), _memory_in_use()
    try:
        wanted = next(answer)
        while True:
            if clock.now() - begun > seconds:
                raise TimeoutError(f"sends no whole answer within {seconds:g} s")
            if _memory_in_use() - memory > largest:
                raise MemoryError(f"sends an answer of more than {largest >> 20} MiB")
            wanted = answer.send((yield wanted))
    except StopIteration as end:
        whole: Answer = end.value
        return whole


def _memory_in_use() -> int:
    """Returns the memory of this process, bytes; 0 where the system does not show it."""
    try:
        with open_regular(_OF_PROCESS) as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return 0
