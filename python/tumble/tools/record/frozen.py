"""Units that repeat one reading: their line is alive, their sensor is not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tumble.acquisition.repetitions import is_coarse, repeats
from tumble.foundation.recording import FloatArray
from tumble.live import LiveChunk
from tumble.tools.record.objections import Objection

FROZEN_AFTER = 2.0
"""s of one reading; at rest a coarse sensor may have as many alike, while it moves none has."""


@dataclass(slots=True)
class _Reading:
    """Reading that a unit repeats."""

    value: FloatArray
    """(6,)."""
    since: float
    until: float
    """s of the samples."""
    different: int = 0
    """Readings before it."""
    repeated: int = 0
    """Those of them that came again and again."""


class FrozenUnits:
    """Receives all samples; names the units that are frozen."""

    def __init__(self) -> None:
        self._readings: dict[str, _Reading] = {}
        self._found: dict[str, float] = {}
        """s of the samples since which each unit that was named repeats its reading."""

    def push(self, name: str, chunk: LiveChunk) -> None:
        """Adds samples of a unit, one or more."""
        rows = np.hstack([chunk.accelerometer, chunk.gyroscope])
        times = chunk.time
        last = self._readings.get(name)
        if last is not None:
            rows = np.vstack([last.value, rows])
            times = np.concatenate([[last.since], times])
        last = last or _Reading(rows[0], float(times[0]), 0.0)
        first = np.flatnonzero(np.concatenate([[True], ~repeats(rows)]))
        lengths = np.diff(first)
        if len(lengths):
            was_repeated = lengths[0] > 1 or last.until > last.since
            repeated = last.repeated + int(was_repeated) + int((lengths[1:] > 1).sum())
            last = _Reading(rows[-1], float(times[first[-1]]), 0.0, last.different + len(lengths), repeated)
        last.until = float(times[-1])
        self._readings[name] = last

    def is_frozen(self, name: str) -> bool:
        """Returns whether a unit that was reported still repeats the same reading."""
        return name in self._found and self._readings[name].since == self._found[name]

    def objections(self, moving: Mapping[str, bool]) -> Iterator[Objection]:
        """Names units that have repeated one reading while another moved; `moving` marks those that do now.

        One that is alone is named where none of its readings lasted before.
        """
        for name, reading in self._readings.items():
            others_move = any(moves for other, moves in moving.items() if other != name)
            alone = len(moving) == 1 and not is_coarse(reading.different, reading.repeated)
            if (others_move or alone) and reading.until - reading.since > FROZEN_AFTER:
                self._found[name] = reading.since
                seen = "as no sensor with noise does" if alone else "while others move"
                text = (
                    f"is frozen: it repeats one reading {seen}; check the sensor and its cable, and show the "
                    "poses again that it missed"
                )
                yield Objection(name, f"frozen {reading.since}", text)
