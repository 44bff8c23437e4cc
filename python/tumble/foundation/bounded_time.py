"""A bound of time for a library that reads a file of others: it may loop for as long as the file states."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from tumble.foundation import clock


class _Over(BaseException):
    """Ends the block, past whatever the library catches."""


_STEPS = 1000
"""Steps of Python, of which one is enough."""


@contextmanager
def bounded_time(seconds: float) -> Iterator[None]:
    """Ends the block once it has taken so many s, between two steps of Python; raises `TimeoutError` then."""
    reader = ctypes.c_ulong(threading.get_ident())
    is_done, is_over = threading.Event(), threading.Event()

    def watch() -> None:
        if not clock.wait(is_done, seconds):
            is_over.set()
            ctypes.pythonapi.PyThreadState_SetAsyncExc(reader, ctypes.py_object(_Over))

    watchdog = clock.thread(watch, name="bounded time")
    try:
        watchdog.start()
        try:
            yield
        finally:
            is_done.set()
            clock.wait(watchdog)
            # One that has not come yet would end something else, and comes between two of these steps.
            # Taken back, it leaves Python 3.11 looking for it for good, where a function that is traced
            # or profiled never begins.
            if is_over.is_set():
                for _ in range(_STEPS):
                    pass
    except _Over:
        raise TimeoutError(f"takes more than {seconds:g} s") from None
