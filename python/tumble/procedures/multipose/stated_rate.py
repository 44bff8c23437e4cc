"""A sample rate that is stated although the log has stamps: the stamps check it.

Method: docs/theory/multipose.md, section 8.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tumble import _core
from tumble.foundation.errors import LogError
from tumble.foundation.recording import Recording, RecordingSource
from tumble.foundation.words import count_of
from tumble.logs import ReadOptions, open_recording


@dataclass(frozen=True, slots=True)
class StampedRate:
    """A stated rate beside that of the stamps of the same log."""

    stated: float
    """Hz."""
    shown: float
    """Hz, mean of the log."""
    missing: int
    """Samples that are missing between the stamps."""
    agrees: bool
    """True where clocks and the ends of the log explain the difference of the rates."""

    def sentence(self) -> str:
        """Names both rates, and the samples that are missing."""
        lost = f", with {count_of('sample', self.missing)} missing" if self.missing else ""
        if self.agrees:
            return (
                f"--rate states {self.stated:g} Hz, and the log's stamps show {self.shown:.5g} Hz{lost}: a "
                "turn that lost samples is cut short; leave out --rate"
            )
        off = 100.0 * (self.shown / self.stated - 1.0)
        return (
            f"--rate states {self.stated:g} Hz, but the log's stamps show {self.shown:.5g} Hz{lost}: the "
            f"gyroscope's scale is off by {off:+.2g} %; leave out --rate, or the time column if that is wrong"
        )


def stamped_rate(source: RecordingSource, read: ReadOptions | None) -> StampedRate | None:
    """Compares the rate that was stated for a log with its stamps; None where nothing can be compared."""
    if isinstance(source, Recording) or read is None or read.rate is None:
        return None
    try:
        recording = open_recording(source, replace(read, rate=None))
        if recording.parts or recording.metadata.rate is not None:
            return None
        stamps = np.concatenate([np.zeros(0), *(chunk.time for chunk in recording.chunks())])
    except LogError:
        # Stamps that nobody can read are why a rate is stated.
        return None
    shown = _core.stamped_rate(stamps, read.rate)
    return None if shown is None else StampedRate(read.rate, *shown)
