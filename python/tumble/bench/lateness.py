"""Time that a message of a page took to come: what its user saw may not be what is, once it is late.

A page stamps its messages by its own clock. The least delay so far shows how the clocks differ.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from weakref import WeakKeyDictionary

from nicegui.client import Client

from tumble.foundation import clock

MOST_LATE = 1.0
"""s by which a message may be late and still be acted on; a run shows another instruction in that time."""
SENT = "sent"
"""Key of the time, ms of the clock of the page, at which a message was sent."""

_least: WeakKeyDictionary[Client, float] = WeakKeyDictionary()
"""Least delay of the messages of each page, s."""
_late: ContextVar[float] = ContextVar("late", default=0.0)


@contextmanager
def measured(page: Client, sent: object) -> Iterator[None]:
    """Knows, while the block runs, how late the message is that it handles; one without a time is not."""
    before = _late.set(_lateness(page, sent))
    try:
        yield
    finally:
        _late.reset(before)


def is_late() -> bool:
    """Returns whether the message that is handled came too late to be acted on."""
    return _late.get() > MOST_LATE


def _lateness(page: Client, sent: object) -> float:
    if isinstance(sent, bool) or not isinstance(sent, int | float) or not math.isfinite(sent):
        return 0.0
    delay = clock.now() - 1e-3 * sent
    least = _least[page] = min(_least.get(page, delay), delay)
    return delay - least
