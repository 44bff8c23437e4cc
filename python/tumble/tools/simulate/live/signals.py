"""Ctrl-C and SIGTERM end a live bench as the end of its motion does."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from tumble.tools.simulate.live.procedure import LiveSimulation

POLL = 0.2
"""s after which a signal that came is seen at the latest."""


@contextmanager
def ended_by_signals() -> Iterator[Callable[[LiveSimulation], None]]:
    """Context that waits for the end of a bench, or a signal that requests it, even before."""
    asked: list[int] = []

    def ask(number: int, _frame: FrameType | None) -> None:
        asked.append(number)

    before = {which: signal.signal(which, ask) for which in (signal.SIGINT, signal.SIGTERM)}

    def wait(simulation: LiveSimulation) -> None:
        while not asked and not simulation.wait(POLL):
            pass

    try:
        yield wait
    finally:
        for which, handler in before.items():
            signal.signal(which, handler)
