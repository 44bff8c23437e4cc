"""Clocks that are set while a log is written: stamps leap by years, as where a receiver finds the date.

The length of the pause of the samples meanwhile is unknown. Later times follow on after the least pause that
the core takes for a gap, so that no turn across it is used, and all times are on one clock.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.logs.units import usual_step

LONGEST_PAUSE = 30 * 86400.0
"""s between two samples of one log, beyond which a clock was set: those that nobody set are years behind, and
no logger pauses for a month. With twice as much, one that is set ahead by seven weeks would be a gap."""
PAUSE_INTERVALS = _core.GAP_INTERVALS + 1
"""Sample intervals that stand for the pause."""


OneClock: TypeAlias = tuple[FloatArray, FloatArray | None]
"""(n,) s of the log, and (n,) s of arrival, where the log has them."""


class SetClock:
    """Puts successive times of a log on the clock of its first."""

    def __init__(self) -> None:
        self.times: list[float] = []
        """s on that clock, of the first sample after each time that it was set."""
        self._last = math.nan
        self._arrived = math.nan
        self._back = 0.0
        self._early = 0.0

    def follow(self, time: FloatArray, received: FloatArray | None = None) -> OneClock:
        """Returns (n,) times, s, that rise as given, without leaps of the clock; (n,) times of arrival too.

        These take part in the pause, so that the delay of samples stays as it is.
        """
        before, self._last = (float(time[0]) if math.isnan(self._last) else self._last), float(time[-1])
        arrived = None if received is None else np.diff(received, prepend=self._arrived)
        self._arrived = math.nan if received is None else float(received[-1])
        if self._last - before <= LONGEST_PAUSE:
            return self._shifted(time, received) if self._back else (time, received)
        steps = np.diff(time, prepend=before)
        leaps = np.where(steps > LONGEST_PAUSE, steps, 0.0)
        usual = usual_step(time)
        pause = PAUSE_INTERVALS * (1.0 if math.isnan(usual) else usual)
        back = self._back + np.cumsum(np.where(leaps > 0.0, leaps - pause, 0.0))
        followed: FloatArray = time - back
        self._back = float(back[-1])
        self.times += followed[leaps > 0.0].tolist()
        if received is not None and arrived is not None:
            late = np.where((leaps > 0.0) & np.isfinite(arrived), pause - arrived, 0.0)
            received = received + self._early + np.cumsum(late)
            self._early += float(late.sum())
        return followed, received

    def _shifted(self, time: FloatArray, received: FloatArray | None) -> OneClock:
        return time - self._back, None if received is None else received + self._early
