"""A sample rate that is stated although the log has stamps: the stamps check it.

Method: docs/theory/multipose.md, section 8.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray, Recording, RecordingSource
from tumble.foundation.words import count_of
from tumble.logs import ReadOptions, open_recording
from tumble.logs.session_clock import CRYSTAL

SIGMAS = 5.0
"""Sigmas of the pace of a crystal by which two rates of one sensor may differ."""
OF_ANOTHER_UNIT = 1.15
"""Ratio of rates from which stamps count another unit: turns show a rate that is so far off (eq. 32)."""
FEWEST = 100
"""Samples whose stamps show a rate."""
HOLE = 1.5
"""Mean steps from which a step holds a missing sample."""
EVEN = (0.75, 1.25)
"""Usual steps between which a step is even."""
MOSTLY = 0.8
"""Share of even steps of a log in which a longer step is a hole, and no late stamp."""


@dataclass(frozen=True, slots=True)
class StampedRate:
    """A stated rate beside that of the stamps of the same log."""

    stated: float
    """Hz."""
    shown: float
    """Hz, mean of the log."""
    missing: int
    """Samples that are missing between the stamps."""
    tolerance: float
    """Largest relative difference of the two that clocks and the ends of the log explain."""

    @property
    def agrees(self) -> bool:
        """Returns whether clocks explain the difference of the rates."""
        return abs(math.log(self.shown / self.stated)) <= self.tolerance

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
    return _compared(stamps, read.rate)


def _compared(stamps: FloatArray, stated: float) -> StampedRate | None:
    steps = np.diff(stamps)
    if len(stamps) < FEWEST or not np.isfinite(steps).all() or steps.min() < 0.0 or stamps[-1] <= stamps[0]:
        return None
    span = float(stamps[-1] - stamps[0])
    usual = float(np.median(steps))
    low, high = EVEN
    is_even = np.mean((steps >= low * usual) & (steps <= high * usual)) > MOSTLY
    holes = steps > HOLE * usual if is_even else np.zeros(len(steps), dtype=bool)
    missing = int(np.sum(np.round(steps[holes] / usual) - 1.0)) if is_even else 0
    if abs(math.log((len(steps) + missing) / span / stated)) > math.log(OF_ANOTHER_UNIT):
        return None
    # A stamp at either end is known to a step.
    tolerance = SIGMAS * CRYSTAL + float(steps[~holes].max()) / span
    return StampedRate(stated, len(steps) / span, missing, tolerance)
