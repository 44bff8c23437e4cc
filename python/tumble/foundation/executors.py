"""Threads of generators, which may be left half way.

The garbage collector then ends the generator in any thread, also in one that is beginning and holds the lock
of Python that a join needs (CPython up to 3.12). So nothing is joined there: that would wait for ever.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager


@contextmanager
def unjoined_executor(threads: int) -> Iterator[ThreadPoolExecutor]:
    """Executor whose threads end after the block by themselves, once the work that they began is done."""
    executor = ThreadPoolExecutor(threads)
    try:
        yield executor
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
