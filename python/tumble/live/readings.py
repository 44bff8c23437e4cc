"""Samples as a device sent them, before any unit is decided."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FloatArray
from tumble.logs.track import RawSamples, StatedUnit


@dataclass(frozen=True, slots=True)
class Readings:
    """Samples that came together, at least one, in the units of the device."""

    samples: RawSamples
    moving: FloatArray | None = None
    """State of the wheels, as in `LiveChunk`."""
    magnetic: FloatArray | None = None
    """(n, 3) of a magnetometer; NaN in rows without a reading."""

    def __len__(self) -> int:
        return len(self.samples)

    def part(self, which: slice | NDArray[np.bool_] | NDArray[np.int64]) -> Readings:
        """Returns some of the samples."""
        samples = self.samples
        return Readings(
            RawSamples(
                None if samples.time is None else samples.time[which],
                samples.accelerometer[which],
                samples.gyroscope[which],
                None if samples.temperature is None else samples.temperature[which],
            ),
            None if self.moving is None else self.moving[which],
            None if self.magnetic is None else self.magnetic[which],
        )


@dataclass(frozen=True, slots=True)
class StreamFacts:
    """Statements of a stream about itself; see `tumble.logs.conversion.Stating`."""

    source: str
    """Source as typed by the user."""
    has_time: bool
    """Indicates whether samples carry stamps of the device."""
    accelerometer_unit: StatedUnit | None = None
    gyroscope_unit: StatedUnit | None = None
    time_unit: StatedUnit | None = None
    temperature_unit: StatedUnit | None = None
    magnetometer_unit: StatedUnit | None = None
    rate: None = None
    notices: tuple[str, ...] = ()


def joined(pieces: Sequence[Readings]) -> Readings:
    """Returns readings that came one after another together."""
    samples = [piece.samples for piece in pieces]

    def together(parts: list[FloatArray | None]) -> FloatArray | None:
        present = [part for part in parts if part is not None]
        return np.concatenate(present) if len(present) == len(parts) else None

    return Readings(
        RawSamples(
            together([each.time for each in samples]),
            np.concatenate([each.accelerometer for each in samples]),
            np.concatenate([each.gyroscope for each in samples]),
            together([each.temperature for each in samples]),
        ),
        together([piece.moving for piece in pieces]),
        _fields(pieces),
    )


def _fields(pieces: Sequence[Readings]) -> FloatArray | None:
    """Returns the readings of a magnetometer, NaN for pieces that came without; None where all did."""
    if all(piece.magnetic is None for piece in pieces):
        return None
    return np.concatenate(
        [np.full((len(each), 3), np.nan) if each.magnetic is None else each.magnetic for each in pieces]
    )
