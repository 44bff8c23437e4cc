"""A live aiding measurement: rows of what `Aiding.load` reads, over a line of text."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from types import TracebackType
from typing import Literal, TypeAlias

from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.live import FIRST_SAMPLE_WITHIN, HEARTBEAT, parse_address
from tumble.live.labels import LabelledRow, LabelRow
from tumble.live.multi_source import RETRY
from tumble.live.readings import Readings, StreamFacts
from tumble.live.registry import text_line
from tumble.live.shared_line import LineUnit
from tumble.logs.aiding import BODY, HEADING, LEVEL, SCORE, Aiding
from tumble.logs.options import ReadOptions
from tumble.procedures.redundancy.aiding_rows import AidingRows
from tumble.procedures.redundancy.result import RedundancyEvent

BETWEEN_LOOKS = 0.02
"""s between two looks at a file, which cannot be waited for."""

Heard: TypeAlias = Aiding | RedundancyEvent


class LiveAiding:
    """Listens in a thread of its own while it is entered; `take` gives the measurements received meanwhile.

    `text` is an address of what sends text. `sigma`, m/s, is that of velocities that state none, `units` are
    the names of the set, `sender` is as for `open_source`. Times are put on the clock of this computer, as
    those of units are, `clock_rate` s of it a second; rows without a time are of when they came.

    A line that is lost is opened anew every second. Raises `LogError` where it cannot be opened at first.
    """

    def __init__(
        self,
        text: str,
        units: Sequence[str],
        *,
        sigma: float | None = None,
        sender: str | None = None,
        clock_rate: float = 1.0,
    ) -> None:
        self.name = text
        columns = {name: name for name in (*LEVEL, *BODY, *HEADING, *(f"{SCORE}{unit}" for unit in units))}
        self._options = ReadOptions(columns=columns)
        self._sender = sender
        self._line = self._made()
        self._is_open = False
        midway = self._line.line.transport.joined_midway
        self._rows = AidingRows(text, units, sigma=sigma, clock_rate=clock_rate, joined_midway=midway)
        self._heard: deque[Heard] = deque()
        self._left = threading.Event()
        self._thread = clock.thread(self._listen)

    def __enter__(self) -> LiveAiding:
        self._line.__enter__()
        self._is_open = True
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._left.set()
        clock.wait(self._thread)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on its measurements, for the user."""
        return (*self._rows.remarks, *self._line.line.notices)

    def take(self) -> list[Heard]:
        """Returns its measurements, and the events of its line, since the last call."""
        return [self._heard.popleft() for _ in range(len(self._heard))]

    def _made(self) -> _AidingLine:
        line = text_line(self.name, self._options, self._sender)
        return _AidingLine(line, parse_address(self.name), self._options)

    def _listen(self) -> None:
        until = clock.now() + FIRST_SAMPLE_WITHIN
        try:
            while not self._left.is_set():
                try:
                    self._heard += self._rows.read(*self._line.come())
                except LogError as error:
                    self._tell("lost", str(error))
                    self._reopen()
                if not self._rows.used and (self._rows.objection or clock.now() > until):
                    self._tell("silent", self._rows.objection or "has said nothing that is known")
                    until = float("inf")
        except EOFError:
            pass  # Whoever wrote it has ended, and so has the aiding measurement.
        finally:
            if self._is_open:
                self._line.__exit__(None, None, None)

    def _reopen(self) -> None:
        """Opens the line anew, every second until it is there again or nobody listens any more."""
        self._line.__exit__(None, None, None)
        self._is_open = False
        while not clock.wait(self._left, RETRY):
            line = self._made()
            try:
                line.__enter__()
            except LogError:
                continue
            self._line, self._is_open = line, True
            self._tell("returned")
            return

    def _tell(self, event: Literal["lost", "returned", "silent"], reason: str = "") -> None:
        figures = {"reason": reason} if reason else {}
        self._heard.append(RedundancyEvent(clock.now(), self.name, event, figures))


class _AidingLine(LineUnit[LabelledRow]):
    """A line whose rows are those of an aiding measurement, and of no IMU."""

    def come(self) -> tuple[list[LabelRow], float]:
        """Waits a while for rows; returns them, and when they came, s of `clock.now()`."""
        self._rows: list[LabelRow] = []
        if self.fileno() is None:
            clock.sleep(BETWEEN_LOOKS)
        else:
            self.wait(HEARTBEAT)
        self.read()
        return self._rows, self._arrival

    def _readings(self, parts: Sequence[LabelledRow]) -> tuple[Readings, StreamFacts] | None:
        self._rows += [part.row for part in parts]
        return None
