"""Interface of all writers of recordings, and the facts they store beside the samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from tumble.foundation.recording import Chunk
from tumble.foundation.units import TRIADS, Triad
from tumble.logs.track import SI


@dataclass(frozen=True, slots=True)
class Facts:
    """Facts that a written log keeps beside its samples for the next reader."""

    frame: str = "case"
    """Frame of the samples; MCAP only."""
    serial: str = ""
    """Serial number of the unit."""
    corrected: str = ""
    """Hash of the calibration that corrected the samples; empty if they are raw."""
    triads: tuple[Triad, ...] = TRIADS
    """Those that were recorded, and are written."""
    further: tuple[str, ...] = ()
    """Columns besides, which chunks have under these names: (n,), or a word for all; CSV and Parquet only."""
    doubts: tuple[str, ...] = ()
    """Doubts about the correction, for the next reader."""
    notes: Mapping[str, str] = field(default_factory=dict)
    """Other notes that the file keeps; Parquet only."""

    def of_the_samples(self) -> dict[str, str]:
        """Returns what is kept of the samples in the head or the metadata of the file, by its name."""
        found = {
            "units": SI,
            "serial": self.serial,
            "corrected": self.corrected,
            "warning": "; ".join(self.doubts),
        }
        return {key: value for key, value in found.items() if value}


class Writer(Protocol):
    """Takes the chunks of one recording, in order."""

    def write(self, chunk: Chunk) -> None:
        """Appends samples."""
        ...

    def close(self) -> None:
        """Finishes the file."""
        ...
