"""When a sample was taken: by the device's own stamps, by its number, or by when it arrived."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FEW_SAMPLES, FloatArray

STALL, STALL_STEPS = 0.25, 20.0
"""s, and usual steps, ahead of the newest at which a stamp is taken only when the next one bears it out."""
LEAP = 10.0
"""s ahead of the newest at which a stamp is strange: robots and radio links stall for less."""
RESTARTED = 1.0
"""s behind the newest at which it is: a sample that is late is so by less."""
SET_BACK = 0.25
"""s for which stamps go on behind the newest where the clock was set back: a sample that is late is alone."""
STAMPS_TO_BELIEVE = 5
"""Strange stamps in succession that agree with each other: the clock itself has leapt."""
ABSURD = 1e25
"""Bound that no stamp and no reading reaches in any unit; larger numbers are invalid."""
COUNTER = 2.0**32
"""Overflow of the counters of small devices: after 71.6 minutes if they count microseconds."""


def without_absurd(values: FloatArray) -> FloatArray:
    """Replaces values that would overflow in later arithmetic by NaN."""
    return np.where(np.abs(values) < ABSURD, values, np.nan)


@dataclass(slots=True)
class DeviceClock:
    """Stamps of the device, made to run on where a 32-bit counter begins again."""

    _last: float | None = None
    _rounds: float = 0.0

    def stamp(self, stamps: FloatArray) -> FloatArray:
        """Returns (n,) stamps, in the unit of the device, without the leaps of a counter."""
        if len(stamps) <= FEW_SAMPLES and self._runs_on(stamps):
            return stamps + COUNTER * self._rounds
        stamps = without_absurd(stamps)
        before = stamps[0] if self._last is None else self._last
        steps = np.diff(stamps, prepend=before)
        # Stamps beyond a counter are those of a wider one, which does not begin again.
        again = (steps < -COUNTER / 2.0) & (stamps - steps < COUNTER)
        # A sample that was overtaken on the way comes from the round before.
        back = (steps > COUNTER / 2.0) & (self._rounds + np.cumsum(again) > 0.0)
        leaps = again.astype(np.float64) - back
        rounds = self._rounds + np.cumsum(leaps)
        finite = np.flatnonzero(np.isfinite(stamps))
        if len(finite):
            self._last, self._rounds = float(stamps[finite[-1]]), float(rounds[finite[-1]])
        running: FloatArray = stamps + COUNTER * rounds
        return running

    def _runs_on(self, stamps: FloatArray) -> bool:
        """Returns whether no counter began again since the stamps before, as is usual; stores the newest."""
        last = self._last
        for stamp in stamps.tolist():
            if last is None or not abs(stamp - last) <= COUNTER / 2.0:
                return False
            last = stamp
        self._last = last
        return True


@dataclass(slots=True)
class StampGate:
    """Keeps single stamps, far from those before, from being taken for the time."""

    newest: float = -np.inf
    """s, of all that were accepted."""
    ran_back: float = 0.0
    """s by which the clock itself ran back; 0 if it did not."""
    left: int = 0
    """Stamps given last that are of the time after the clock ran back."""
    _stall: float = np.nan
    _strange: float = np.nan
    _leap: float = 0.0
    _successive: int = 0
    _behind: float = np.nan
    """s, the first of successive stamps behind the newest."""

    def believe_pauses(self) -> None:
        """Accepts stamps however far ahead, as those of this computer's own clock are."""
        self._stall = np.inf

    def believes_all(self, time: FloatArray) -> bool:
        """Returns whether (n,) stamps, s, continue evenly, as most do, and accepts them if so."""
        newest = self.newest
        for stamp in time.tolist():
            if not 0.0 < stamp - newest <= self._stall:
                return False
            newest = stamp
        self.newest, self._successive, self._behind = newest, 0, np.nan
        return True

    def believed(self, time: FloatArray) -> NDArray[np.bool_]:
        """Returns for each of (n,) stamps, s, whether it is valid; one that is not finite is invalid.

        The usual step is that of the first stamps. Stamps behind the one that shows that the clock ran back
        are left out: they are of another time, and `left` is their number, with that one.
        """
        if np.isnan(self._stall):
            steps = np.diff(time[np.isfinite(time)])
            self._stall = max(STALL, STALL_STEPS * float(np.median(steps))) if len(steps) else LEAP
        believed = np.zeros(len(time), dtype=np.bool_)
        for place, stamp in enumerate(time.tolist()):
            believed[place] = self._is_believed(stamp)
            if self.ran_back > 0.0:
                self.left = len(time) - place
                break
        return believed

    def _is_believed(self, stamp: float) -> bool:
        if not np.isfinite(stamp):
            return False
        if np.isinf(self.newest) or -RESTARTED <= stamp - self.newest <= self._stall:
            if self._is_set_back(stamp):
                self.ran_back, self.newest = self.newest - stamp, stamp
            self.newest, self._successive = max(self.newest, stamp), 0
            return True
        if not 0.0 < stamp - self._strange <= LEAP:
            self._successive, self._leap = 0, stamp - self.newest
        self._strange = stamp
        self._successive += 1
        if self._successive < (2 if 0.0 < self._leap <= LEAP else STAMPS_TO_BELIEVE):
            return False
        self.ran_back = max(0.0, -self._leap)
        self.newest, self._successive = stamp, 0
        return True

    def _is_set_back(self, stamp: float) -> bool:
        """Returns whether stamps have continued behind the newest for so long that the clock was set back."""
        if stamp > self.newest:
            self._behind = np.nan
        elif not stamp >= self._behind:
            self._behind = stamp
        return stamp - self._behind > SET_BACK


@dataclass(slots=True)
class CountingClock:
    """The number of a sample over the rate: for devices that sample evenly and lose nothing."""

    rate: float
    """Hz."""
    _count: int = 0

    def stamp(self, count: int) -> FloatArray:
        """Returns s since the first sample, of the next `count` samples."""
        time: FloatArray = np.arange(self._count, self._count + count, dtype=np.float64) / self.rate
        self._count += count
        return time


@dataclass(slots=True)
class ArrivalClock:
    """When samples arrived. Those that came together are spread over the time since the ones before."""

    _first: float | None = None
    _last: float = 0.0

    def stamp(self, count: int, arrival: float) -> FloatArray:
        """Returns s since the first sample, of `count` samples that arrived together at `arrival`, s.

        Only the last sample of the first arrival has a time; the others are NaN.
        """
        if self._first is None:
            self._first = arrival
            time = np.full(count, np.nan)
            time[-1] = 0.0
            return time
        now = arrival - self._first
        spread: FloatArray = self._last + (now - self._last) * np.arange(1, count + 1) / count
        self._last = now
        return spread
