"""Ctrl-C and SIGTERM end a live bench as the end of its motion does."""

from __future__ import annotations

import signal
from types import FrameType

from tumble.simulate.live.procedure import LiveSimulation

POLL = 0.2
"""s after which a signal that came is seen at the latest."""


def until_ended(simulation: LiveSimulation) -> None:
    """Wait until a bench has ended, or a signal asks for its end."""
    asked: list[int] = []

    def ask(number: int, _frame: FrameType | None) -> None:
        asked.append(number)

    before = {which: signal.signal(which, ask) for which in (signal.SIGINT, signal.SIGTERM)}
    try:
        while not asked and not simulation.wait(POLL):
            pass
    finally:
        for which, handler in before.items():
            signal.signal(which, handler)
