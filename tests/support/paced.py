"""Rate of a device that is a process of its own, as those are that send by a library of others."""

from __future__ import annotations

import itertools
import sys
from selectors import EVENT_READ, DefaultSelector


def numbers_at(rate):
    """Counts samples, `rate` of them each s, until the standard input is closed."""
    with DefaultSelector() as lines:
        lines.register(sys.stdin, EVENT_READ)
        for number in itertools.count():
            yield number
            if lines.select(1.0 / rate):
                return
