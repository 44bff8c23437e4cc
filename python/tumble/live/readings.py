"""Samples as a device sent them, before any unit is decided."""

from __future__ import annotations

from dataclasses import dataclass

from tumble.logs.track import RawSamples, StatedUnit
from tumble.recording import FloatArray


@dataclass(frozen=True, slots=True)
class Readings:
    """Samples that came together, at least one, in the units of the device."""

    samples: RawSamples
    moving: FloatArray | None = None
    """As in `LiveChunk`."""

    def __len__(self) -> int:
        return len(self.samples)


@dataclass(frozen=True, slots=True)
class StreamFacts:
    """What a stream states of itself; see `tumble.logs.conversion.Stating`."""

    source: str
    """What was typed."""
    has_time: bool
    """Whether samples carry stamps of the device."""
    accelerometer_unit: StatedUnit | None = None
    gyroscope_unit: StatedUnit | None = None
    time_unit: StatedUnit | None = None
    temperature_unit: StatedUnit | None = None
    rate: None = None
    notices: tuple[str, ...] = ()
