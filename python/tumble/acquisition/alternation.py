"""Samples of two or more units that take turns in one log, as if they were of one."""

from __future__ import annotations

from collections.abc import Sequence

from tumble import _core
from tumble.acquisition.messages import PLACES, TAKE_TURNS
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Chunk, recorded_rows
from tumble.foundation.units import Triad

MOST_UNITS = max(PLACES)
"""Units that may take turns."""


class AlternationWatch:
    """Compares the medians of every second, third and fourth sample, less the motion, block by block."""

    def __init__(self, triads: Sequence[Triad]) -> None:
        self._triads = triads
        self._watch = _core.AlternationWatch()

    def push(self, chunk: Chunk) -> None:
        """Takes in successive samples."""
        self._watch.push(*recorded_rows(chunk, self._triads))

    def units(self) -> int:
        """Returns how many units take turns; 1 where nothing shows that it is more than one."""
        return self._watch.units

    def refuse(self, name: str) -> None:
        """Raises `ProcedureError` where samples of several units take turns."""
        if (units := self.units()) > 1:
            raise ProcedureError(TAKE_TURNS.format(units=units, place=PLACES[units]), about=name)
