"""Processes that compute for a program: they show no trace of Ctrl-C, and import what the program imports.

A terminal sends Ctrl-C to them too, and a process of Python that is only beginning shows a trace, whatever it
does later. So workers begin with Ctrl-C held back, which they inherit from the thread that starts them.

Such a process would also import from the working folder first, where a file may have the name of any module.
Python 3.11 and later leave that folder out where the environment asks for it.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import TYPE_CHECKING

HAS_MASKS = hasattr(signal, "pthread_sigmask")
"""Indicates whether a thread can hold signals back."""
_SAFE_PATH = "PYTHONSAFEPATH"


@contextmanager
def beginning() -> Iterator[None]:
    """Has processes that the block starts take no Ctrl-C until they call `begin`, and no module of others."""
    with _working_folder_left_out(), _control_c_held_back():
        yield


def begin() -> None:
    """Has this process end by Ctrl-C from now on, at once and without a word."""
    find_modules_as_always()
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if HAS_MASKS:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def find_modules_as_always() -> None:
    """Has programs that this worker starts look for modules as they do without it."""
    os.environ.pop(_SAFE_PATH, None)


@contextmanager
def _working_folder_left_out() -> Iterator[None]:
    before = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_SAFE_PATH]
        else:
            os.environ[_SAFE_PATH] = before


@contextmanager
def _control_c_held_back() -> Iterator[None]:
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


class _Worker(SpawnProcess):
    def start(self) -> None:
        with beginning():
            super().start()


class WorkerContext(SpawnContext):
    """Starts workers, each as a new process of Python."""

    if not TYPE_CHECKING:  # a class is no more than another one to those who check types
        Process = _Worker
