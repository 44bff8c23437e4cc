"""The first readings of a log, which no sensor with noise repeats: a log that does was appended to itself."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tumble.foundation.recording import Chunk, FloatArray

_ROWS = 100
"""Successive readings that are looked for."""
_FEWEST_DIFFERENT = 10
"""Readings among them that differ: a coarse or dead sensor repeats itself by chance."""


@dataclass(slots=True)
class Beginning:
    """The first readings of a pass, and the time at which they come again."""

    again: float | None = None
    """s of the log; None where they do not."""
    _head: FloatArray | None = None
    _kept: list[FloatArray] = field(default_factory=list)
    """Pieces of the beginning, then the last rows of the chunk before."""

    def add(self, chunk: Chunk) -> None:
        """Looks for the beginning in the next chunk."""
        if self.again is not None or (self._head is not None and not len(self._head)):
            return
        rows = np.column_stack([chunk.accelerometer, chunk.gyroscope])
        before = np.concatenate([*self._kept, rows])
        if self._head is None:
            self._kept = [before]
            if len(before) < _ROWS:
                return
            self._head = _telling(before[:_ROWS])
            start = _ROWS
        else:
            start = 0
        at = self._find(before[start:])
        if at is not None:
            # A row of the chunk before is earlier by less than the beginning is long.
            self.again = float(chunk.time[max(at + start - (len(before) - len(rows)), 0)])
        self._kept = [before[max(len(before) - _ROWS + 1, start) :]]

    def _find(self, rows: FloatArray) -> int | None:
        assert self._head is not None
        places = np.arange(max(len(rows) - _ROWS + 1, 0)) if len(self._head) else np.arange(0)
        known = np.isfinite(self._head[0]) if len(self._head) else np.zeros(0, bool)
        for k, row in enumerate(self._head):
            if not len(places):
                return None
            # One channel leaves few places, and the others are compared there alone.
            places = places[rows[places + k, int(np.argmax(known))] == row[int(np.argmax(known))]]
            places = places[(rows[places + k][:, known] == row[known]).all(axis=1)]
        return int(places[0]) if len(places) else None

    def join(self, other: Beginning) -> None:
        """Takes over what another pass has met."""
        self.again = other.again if self.again is None else self.again

    def notices(self) -> tuple[str, ...]:
        """Reports the repetition; empty where there is none."""
        if self.again is None:
            return ()
        return (
            f"its first readings come again to the bit at {self.again:.6g} s: the log holds itself twice, so "
            "that sigmas are too small; cut it there",
        )


def _telling(head: FloatArray) -> FloatArray:
    """Returns the readings, none of them where too few differ to show a repetition."""
    known = np.isfinite(head).all(axis=0)
    if not known.any() or len(np.unique(head[:, known], axis=0)) < _FEWEST_DIFFERENT:
        return head[:0]
    return np.where(known, head, np.nan)
