"""Work that may take long, such as asking a server: beside the event loop, which has a stop to heed."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from typing import TypeVar

from tumble.bench.authority import is_allowed
from tumble.bench.guest_work import charge_step

MOST_AT_ONCE = 4
"""Threads for all browsers that only look, and as many for whoever holds the bench."""
Found = TypeVar("Found")


class Beside:
    """Threads for work that waits for a server or a disk; further work waits until one is free."""

    def __init__(self) -> None:
        self._threads = {who: ThreadPoolExecutor(MOST_AT_ONCE, "beside") for who in (False, True)}

    async def done(self, work: Callable[[], Found]) -> Found:
        """Returns the result of some work, on behalf of the one who acts; raises what it raises."""
        threads = self._threads[is_allowed()]
        try:
            return await asyncio.get_running_loop().run_in_executor(threads, copy_context().run, work)
        finally:
            charge_step()  # whoever asked shows it now

    def close(self) -> None:
        """Begins no further work."""
        for threads in self._threads.values():
            threads.shutdown(wait=False, cancel_futures=True)
