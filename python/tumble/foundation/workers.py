"""Processes that compute for a program: Ctrl-C, which a terminal sends to them too, leaves no trace there.

A process of Python that is only beginning shows one, whatever it does later. So workers begin with Ctrl-C
held back, which they inherit from the thread that starts them.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import TYPE_CHECKING

HAS_MASKS = hasattr(signal, "pthread_sigmask")
"""Indicates whether a thread can hold signals back."""


@contextmanager
def control_c_held_back() -> Iterator[None]:
    """Has processes that the block starts take no Ctrl-C until they call `end_at_control_c`."""
    if not HAS_MASKS:
        yield
        return
    # It is there before any worker, and would let Ctrl-C through again as it starts.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_at_control_c() -> None:
    """Has this process end by Ctrl-C from now on, at once and without a word."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if HAS_MASKS:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


class _Worker(SpawnProcess):
    def start(self) -> None:
        with control_c_held_back():
            super().start()


class WorkerContext(SpawnContext):
    """Starts workers, each as a new process of Python."""

    if not TYPE_CHECKING:  # a class is no more than another one to those who check types
        Process = _Worker
