"""What every writer of recordings is, and what it is told beside the samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from tumble.foundation.recording import Chunk
from tumble.foundation.units import TRIADS, Triad


@dataclass(frozen=True, slots=True)
class Facts:
    """What a written log keeps beside its samples, so that the next reader knows it."""

    frame: str = "case"
    """Frame of the samples; MCAP only."""
    serial: str = ""
    """Serial number of the unit."""
    corrected: str = ""
    """What the samples were corrected with, as the hash of a calibration; empty if they are as measured."""
    triads: tuple[Triad, ...] = TRIADS
    """Those that were recorded, and are written."""
    further: tuple[str, ...] = ()
    """Columns besides, which chunks have under these names: (n,), or a word for all; CSV and Parquet only."""
    doubts: tuple[str, ...] = ()
    """What its reader has to know of the correction."""
    notes: Mapping[str, str] = field(default_factory=dict)
    """What else is kept of the file; Parquet only."""

    def of_the_samples(self) -> dict[str, str]:
        """Give what is kept of the samples in the head or the metadata of the file, by its name."""
        found = {"serial": self.serial, "corrected": self.corrected, "warning": "; ".join(self.doubts)}
        return {key: value for key, value in found.items() if value}


class Writer(Protocol):
    """Takes the chunks of one recording, in order."""

    def write(self, chunk: Chunk) -> None:
        """Append samples."""
        ...

    def close(self) -> None:
        """Finish the file."""
        ...
