"""Units that repeat one reading while others move: their line is alive, their sensor is not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tumble.live import LiveChunk
from tumble.recording import FloatArray
from tumble.turntable.so_far import Objection

FROZEN_AFTER = 2.0
"""s of one reading; at rest a coarse sensor may have as many alike, while it moves none has."""


@dataclass(slots=True)
class _Reading:
    """What a unit reads again and again."""

    value: FloatArray
    """(6,)."""
    since: float
    until: float
    """s of the samples."""


class FrozenUnits:
    """Tell it of all samples; it names the units that are frozen."""

    def __init__(self) -> None:
        self._readings: dict[str, _Reading] = {}

    def push(self, name: str, chunk: LiveChunk) -> None:
        """Take in samples of a unit, one or more."""
        rows = np.hstack([chunk.accelerometer, chunk.gyroscope])
        last = self._readings.get(name)
        other = np.flatnonzero((rows != rows[-1]).any(axis=1))
        if len(other) or last is None or not np.array_equal(last.value, rows[-1]):
            first = int(other[-1]) + 1 if len(other) else 0
            last = _Reading(rows[-1], float(chunk.time[first]), 0.0)
        last.until = float(chunk.time[-1])
        self._readings[name] = last

    def objections(self, moving: Mapping[str, bool]) -> Iterator[Objection]:
        """Name units that have repeated one reading while another moved; `moving` says who does now."""
        for name, reading in self._readings.items():
            others_move = any(moves for other, moves in moving.items() if other != name)
            if others_move and reading.until - reading.since > FROZEN_AFTER:
                text = (
                    "is frozen: it repeats one reading while others move; check the sensor and its cable, "
                    "and show the poses again that it missed"
                )
                yield Objection(name, f"frozen {reading.since}", text)
