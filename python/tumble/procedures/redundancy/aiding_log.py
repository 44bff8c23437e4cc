"""Aiding measurements that were recorded with a session, as a table that `Aiding.load` reads."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tumble.foundation.errors import OutputError
from tumble.foundation.file_names import AIDING_FILE
from tumble.foundation.file_status import exists
from tumble.foundation.files import append_line
from tumble.logs.aiding import (
    ARRIVAL,
    SCORE,
    SIGMA,
    TIME,
    AidingKind,
    NativeAiding,
    measured_columns,
)


class AidingLog:
    """Writes a line for each measurement, at once, so that a kill loses nothing.

    `units` are the names of the set, primary first. Raises `OutputError` where the folder holds such a table
    already, or cannot be written to.
    """

    def __init__(self, folder: Path, units: Sequence[str]) -> None:
        self._path = folder / AIDING_FILE
        self._scores = tuple(f"{SCORE}{unit}" for unit in units)
        kinds: tuple[AidingKind, ...] = ("velocity", "body velocity", "heading")
        measured = [name for kind in kinds for name in measured_columns(kind)]
        self._names = (TIME, ARRIVAL, *measured, *(f"{SIGMA}_{name}" for name in measured), *self._scores)
        if exists(self._path):
            raise OutputError(f"{self._path}: is there already; give another folder")
        self._is_empty = True

    def write(self, said: Sequence[NativeAiding], turn: float) -> None:
        """Writes what counted from the samples of a turn on, s; raises `OutputError` where that fails."""
        for aiding in said:
            if self._is_empty:
                append_line(self._path, ",".join(self._names))
                self._is_empty = False
            cells = {TIME: aiding[0], ARRIVAL: turn, **self._figures(aiding)}
            append_line(
                self._path, ",".join(repr(cells[name]) if name in cells else "" for name in self._names)
            )

    def _figures(self, aiding: NativeAiding) -> dict[str, float]:
        _, kind, unit, value, sigma, _ = aiding
        if kind == "score":
            return {self._scores[unit]: float(value[0])}
        names = measured_columns(kind)
        measured = [place for place in range(len(names)) if np.isfinite(sigma[place])]
        return {
            **{names[place]: float(value[place]) for place in measured},
            **{f"{SIGMA}_{names[place]}": float(sigma[place]) for place in measured},
        }
