"""One source looked at before anything is recorded: its rate, gaps and clock, and whether it rests."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass

from tumble.foundation import clock
from tumble.foundation.errors import TumbleError
from tumble.live import FIRST_SAMPLE_WITHIN, LiveSet, SourceEvent, open_set
from tumble.logs.options import ReadOptions
from tumble.tools.record.procedure import SILENT_AFTER, UnitCondition, UnitWatch

RETRY_AFTER = 2.0
"""s until a source that cannot be opened is tried again."""
LOOK_EVERY = 0.25
"""s between two looks whether it rests."""


@dataclass(frozen=True, slots=True)
class SourceState:
    """State of a source."""

    condition: UnitCondition = "waiting"
    rate: float = math.nan
    """Hz; NaN before it is known."""
    samples: int = 0
    gaps: int = 0
    remark: str = ""
    """Remark on its clock; empty where there is none."""
    trouble: str = ""
    """Reason why it cannot be opened, or was lost; empty while it is read."""


class SourceWatch:
    """Reads one source in a thread of its own, and keeps nothing but its state.

    `close` it before anything else opens the source: a line has one reader.
    """

    def __init__(self, name: str, address: str, options: ReadOptions | None = None) -> None:
        self.state = SourceState()
        self._name = name
        self._address = address
        self._options = options or ReadOptions()
        self._ends = threading.Event()
        self._thread = clock.thread(self._work, name=f"watch {name}")
        self._thread.start()

    def close(self) -> None:
        """Ends it, and waits until the line is free."""
        self._ends.set()
        clock.wait(self._thread)

    def _work(self) -> None:
        while not self._ends.is_set():
            try:
                self._read()
            except TumbleError as error:
                self.state = SourceState("lost", trouble=str(error))
            clock.wait(self._ends, RETRY_AFTER)

    def _read(self) -> None:
        events: list[SourceEvent] = []
        words = [f"{self._name}={self._address}"]
        with open_set(words, {self._name: self._options}, keep_going=True) as units:
            units.on_event = events.append
            watch, looked = UnitWatch(), -math.inf
            for name, chunk in units:
                if self._ends.is_set():
                    return
                if len(chunk):
                    watch.hear(chunk, units.listened)
                while events:
                    event = events.pop(0)
                    watch.is_lost, trouble = event.kind == "lost", event.reason
                    self.state = SourceState("lost", trouble=trouble) if watch.is_lost else self.state
                if units.listened - looked >= LOOK_EVERY:
                    looked = units.listened
                    self._look(units, name, watch)

    def _look(self, units: LiveSet, name: str, watch: UnitWatch) -> None:
        patience = SILENT_AFTER if watch.newest else FIRST_SAMPLE_WITHIN
        watch.is_silent = units.listened - watch.heard > patience
        if watch.is_lost:
            return
        timing = units.timing[name]
        condition = "silent" if watch.is_silent else watch.condition[0]
        self.state = SourceState(
            condition,
            1.0 / timing.interval,
            timing.samples,
            timing.gaps,
            "; ".join(units.remarks[name]),
        )
