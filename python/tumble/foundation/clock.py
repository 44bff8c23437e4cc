"""The one clock of the process: its time, and every wait for time, lines, events, threads and work.

Code that reads the time or waits does it here. So a simulated clock can take the place of the computer's, and
a session of minutes then takes a second and is the same each run. Coroutines wait by their event loop.

>>> from tumble.foundation import clock
>>> began = clock.now()
>>> clock.sleep(0.01)
>>> clock.now() - began >= 0.01
True
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeAlias, Union

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future
    from selectors import BaseSelector, SelectorKey

    Ready: TypeAlias = list[tuple[SelectorKey, int]]
    """Lines that are ready, each with the kinds of its readiness, as a selector gives them."""

Awaited: TypeAlias = Union[threading.Event, threading.Thread, "Future[Any]"]
"""Event that is set, thread that ends, or work that is done, in time."""


class Clock:
    """The clock of the computer. A simulated one derives from it, and replaces all its methods.

    They do what the functions of this module of the same names state.
    """

    now = staticmethod(time.monotonic)
    utc = staticmethod(time.time)
    sleep = staticmethod(time.sleep)

    def wait(self, awaited: Awaited, longest: float | None) -> bool:
        """See `wait`."""
        if isinstance(awaited, threading.Event):
            return awaited.wait(longest)
        if isinstance(awaited, threading.Thread):
            awaited.join(longest)
            return not awaited.is_alive()
        from concurrent import futures

        return not futures.wait([awaited], longest).not_done

    def select(self, lines: BaseSelector, longest: float | None) -> Ready:
        """See `select`."""
        return lines.select(longest)

    def thread(self, work: Callable[..., object], arguments: tuple[Any, ...], name: str) -> threading.Thread:
        """See `thread`."""
        return threading.Thread(target=work, args=arguments, name=name or None, daemon=True)

    def executor(self, name: str) -> Executor:
        """See `executor`."""
        from concurrent.futures import ThreadPoolExecutor

        return ThreadPoolExecutor(1, thread_name_prefix=name)


_in_force = Clock()


@contextmanager
def replaced_by(clock: Clock) -> Iterator[None]:
    """Puts another clock in force, for all threads, while the block runs."""
    global _in_force
    before, _in_force = _in_force, clock
    try:
        yield
    finally:
        _in_force = before


def now() -> float:
    """Returns s of a clock that nobody sets, that of `time.monotonic()`."""
    return _in_force.now()


def utc() -> float:
    """Returns s since 1970, by a clock that may be set, that of `time.time()`."""
    return _in_force.utc()


def sleep(seconds: float) -> None:
    """Waits for so many s."""
    _in_force.sleep(seconds)


def wait(awaited: Awaited, longest: float | None = None) -> bool:
    """Waits for an event, a thread or some work, `longest` s at most; returns whether it came to pass."""
    return _in_force.wait(awaited, longest)


def select(lines: BaseSelector, longest: float | None = None) -> Ready:
    """Waits until any of the lines is ready, `longest` s at most; returns those that are."""
    return _in_force.select(lines, longest)


def readable(line: int, longest: float | None = None) -> bool:
    """Waits until a line is readable, `longest` s at most; returns whether it is."""
    from selectors import EVENT_READ, SelectSelector

    with SelectSelector() as lines:
        lines.register(line, EVENT_READ)
        return bool(select(lines, longest))


def thread(work: Callable[..., object], *arguments: Any, name: str = "") -> threading.Thread:  # noqa: ANN401
    """Returns a thread, to be started, for work that waits by this clock; the process ends without it."""
    return _in_force.thread(work, arguments, name)


def executor(name: str = "") -> Executor:
    """Returns an executor of one thread for work that others go on beside, until it is done.

    Work whose result is awaited at once, and only computes, can go to any executor.
    """
    return _in_force.executor(name)
