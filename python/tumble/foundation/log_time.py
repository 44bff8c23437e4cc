"""Times of a recording as people read them: seconds from its first sample, and the date of that sample once.

Logs count from 1970, from when a device started, or from anything else; results and JSON keep their times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import datetime, timezone
from typing import Final

DATES: Final = (1e9, 4e9)
"""s since 1970, from 2001 to 2096: stamps of this size are dates, all others count from something unknown."""


@dataclass(frozen=True, slots=True)
class LogTime:
    """Clock of one recording: times of it, s, are printed from its first sample."""

    start: float
    """Time of the first sample, s of the recording's own clock; NaN where there is none."""

    @property
    def zero(self) -> float:
        """Time that is printed as zero, s of the recording's own clock."""
        return self.start if math.isfinite(self.start) else 0.0

    def since(self, time: float) -> float:
        """Returns the seconds from the first sample to `time`, s of the recording's own clock."""
        return time - self.zero

    def at(self, time: float, decimals: int = 1) -> str:
        """Prints `12.3 s`."""
        return f"{self._printed(time, decimals)} s"

    def span(self, start: float, end: float, decimals: int = 1) -> str:
        """Prints `12.3 to 45.6`, to stand before a unit or in a column that has it."""
        return f"{self._printed(start, decimals)} to {self._printed(end, decimals)}"

    @property
    def date(self) -> str:
        """Date of the first sample, `2026-05-04 13:22:10 UTC`; empty where the stamps are no dates."""
        if not DATES[0] <= self.start <= DATES[1]:
            return ""
        return f"{datetime.fromtimestamp(self.start, timezone.utc):%Y-%m-%d %H:%M:%S} UTC"

    def _printed(self, time: float, decimals: int) -> str:
        # Adding zero makes a zero of the negative zero that rounding leaves.
        return f"{round(self.since(time), decimals) + 0.0:.{decimals}f}"


FROM_START: Final = LogTime(0.0)
"""Clock of times that are from the first sample already."""

UNKNOWN_TIME: Final = LogTime(math.nan)
"""Clock of a recording of which nothing is known: times are printed as they are."""
