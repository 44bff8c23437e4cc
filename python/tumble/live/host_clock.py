"""When samples were taken, by this computer's clock: what several sensors with clocks of their own share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.live.least_delay import LeastDelay

SETTLED = 5.0
"""s of stamps, and
"""
SETTLED_ARRIVALS = 50
"""arrivals, after which host times are slewed and no longer stepped."""
SLEW = 1e-3
"""s a second by which host times then go over to a better estimate."""
CATCH_UP = 0.9
"""The same before: times that ran ahead go on at a tenth of their pace, for they never run back."""
LEAP = 1.0
"""s by which samples are late, all of them for
"""
LEAP_ARRIVALS = 5.0
"""s, where it is not the line that stalls but the clock that was set back, if stamps step unevenly meanwhile;
"""
LATE_FOR_GOOD = 60.0
"""s, if they are even: a busy computer is late for less, a sensor that loses samples for longer."""
SET_FORWARD = 0.1
"""s by which a sample arrives before it was taken, after a step of stamps too long by as much, where the
clock was set forward. An arrival as early after an even step had a shorter delay."""
UNEVEN = 0.5
"""Relative deviation from the step between stamps before, beyond which the clock may have been set."""
DOUBTED = 5e-3
"""s by which a sample comes sooner than any before, at which one alone is not accepted."""
ALMOST_THERE = 1e-9
"""s from the line at which host times are on it."""
STEP_AFTER_LEAP = 1e-4
"""s by which the first host time after a leap is later than the last before it, at least a tenth of it."""
SCATTER_OF = 1000
"""Arrivals from which their unevenness is known; older ones are forgotten."""
FINEST_DELAY, DELAYS_PER_OCTAVE, OCTAVES = 1e-6, 4, 26
"""s of the first class of delays, classes for each doubling, and doublings: up to a minute."""


@dataclass(slots=True)
class DelayCounts:
    """Histogram of the delays of arrivals beyond the least possible one, in classes a fifth apart."""

    largest: float = 0.0
    """s."""
    _counts: list[int] = field(default_factory=lambda: [0] * (DELAYS_PER_OCTAVE * OCTAVES + 1))

    def add(self, delays: Sequence[float]) -> None:
        """Counts delays, s."""
        for delay in delays:
            self.largest = max(self.largest, delay)
            place = DELAYS_PER_OCTAVE * math.log2(max(delay / FINEST_DELAY, 1.0))
            self._counts[min(int(place), len(self._counts) - 1)] += 1

    def quantile(self, share: float) -> float:
        """Delay, s, that this share of all stays below, to a fifth of it; NaN before the first."""
        total = sum(self._counts)
        if total == 0:
            return math.nan
        below = np.cumsum(self._counts)
        place = int(np.searchsorted(below, share * total))
        return float(min(FINEST_DELAY * 2.0 ** ((place + 1) / DELAYS_PER_OCTAVE), self.largest))


@dataclass(slots=True)
class Scatter:
    """Standard deviation of the newest of many numbers."""

    _count: int = 0
    _mean: float = 0.0
    _variance: float = 0.0

    def add(self, value: float) -> None:
        """Adds a number."""
        self._count = min(self._count + 1, SCATTER_OF)
        off = value - self._mean
        self._mean += off / self._count
        self._variance += (off * (value - self._mean) - self._variance) / self._count

    @property
    def sigma(self) -> float:
        """Infinite where there are fewer than three."""
        return math.sqrt(self._variance) if self._count > 2 else math.inf


class HostClock:
    """Gives a sensor's samples the time of this computer's monotonic clock.

    A sample arrives no earlier than it was taken. So the least delays, not the mean ones, show how the
    sensor's clock goes against this one; `LeastDelay` finds the line below them. The delay of
    the quickest sample is not observable: host times are late by it, those of a unit alike.

    `stamped` is true if times are the sensor's own. Where they are those of arrival there is nothing to
    find, and `sigma` is how unevenly samples arrive.
    """

    def __init__(self, *, stamped: bool = True) -> None:
        self.delays = DelayCounts()
        """Delays of arrivals beyond the least."""
        self.leaps = 0
        """Times that the sensor's clock was set, or began again."""
        self._stamped = stamped
        self._line = LeastDelay()
        self._first: tuple[float, float] | None = None
        """Stamp and arrival, s, that the line counts from: differences of large numbers stay exact."""
        self._newest = -math.inf
        self._late_since: float | None = None
        self._given: tuple[float, float] | None = None
        """Stamp and host time, s, of the last sample, stamps counted as the line counts them."""
        self._last_arrival: float | None = None
        self._steps = Scatter()
        self._left = 0.0
        """s by which the last host time is off the line, yet to be slewed."""
        self._stamp, self._arrival, self._step = math.nan, math.nan, math.nan
        """s of the last sample, and the step of stamps before it."""
        self._set_forward_at = self._uneven_at = -math.inf
        """s of the last arrivals after which the clock may have been set forward, or set at all."""
        self._sooner = 0.0
        """s by which the last sample came sooner than all before; never above zero."""

    @property
    def offset(self) -> float:
        """s, to be added to the sensor's time at its newest sample; NaN before the first."""
        if self._first is None:
            return math.nan
        return self._first[1] - self._first[0] + self._line.at(self._newest)

    @property
    def skew(self) -> float:
        """Growth of the offset, s a second of the sensor: positive where the sensor's clock is slow."""
        return self._line.skew

    @property
    def skew_sigma(self) -> float:
        """1-sigma of `skew`."""
        return self._line.skew_sigma

    @property
    def sigma(self) -> float:
        """1-sigma of host times now, s, beyond the least delay; infinite while nothing is known."""
        return math.hypot(self._line.sigma, self._left) if self._stamped else self._steps.sigma

    @property
    def settled(self) -> bool:
        """Returns whether the line rests on enough samples for host times to follow it slowly."""
        return self._line.span >= SETTLED and self._line.arrivals >= SETTLED_ARRIVALS

    @property
    def remark(self) -> str:
        """Remark for the user, in one line; empty while nothing is known."""
        if not math.isfinite(self.sigma):
            return ""
        if not self._stamped:
            return f"samples carry no time; they arrive {_shown(self.sigma)} apart from evenly"
        pace = "slow" if self.skew > 0.0 else "fast"
        leaps = f", set {self.leaps} times" if self.leaps else ""
        return (
            f"clock is {1e6 * abs(self.skew):.1f} +- {1e6 * self.skew_sigma:.1f} ppm {pace}{leaps}; times "
            f"are certain to {_shown(self.sigma)} beyond the least delay; samples came later than that by "
            f"{_shown(self.delays.quantile(0.5))} (median), {_shown(self.delays.quantile(0.99))} (99 %), "
            f"{_shown(self.delays.largest)} (most)"
        )

    def host_times(self, stamps: FloatArray, arrival: float | FloatArray) -> FloatArray:
        """Adds (n,) samples, at least one, and returns their host times, (n,) s of `clock.now()`.

        `stamps` are s of the sensor, increasing; `arrival` s of `clock.now()` at which they came, one
        for all or (n,). Host times increase strictly from call to call and are no later than the arrival, but
        where earlier ones ran ahead.
        """
        # Lists: samples mostly come one by one, for which arrays take several times as long.
        times = stamps.tolist()
        before = self.sigma
        arrivals = arrival.tolist() if isinstance(arrival, np.ndarray) else [arrival] * len(times)
        self._watch_steps(times, arrivals)
        if isinstance(arrival, np.ndarray):
            begin = 0
            for place in _last_of_each(arrival):
                self._take(times[begin], times[place], arrivals[place])
                begin = place + 1
        else:
            self._take(times[0], times[-1], arrival)
        assert self._first is not None, "a sample was taken in"
        first_stamp, first_arrival = self._first
        pace, origin = 1.0 + self._line.skew, first_arrival + self._line.at(0.0)
        since = [stamp - first_stamp for stamp in times]
        wanted = [pace * each + origin for each in since]
        self.delays.add([came - taken for came, taken in zip(arrivals, wanted, strict=True)])
        host = self._never_back(since, wanted, before)
        self._left = abs(host[-1] - wanted[-1])
        self._given = since[-1], host[-1]
        return np.array(host)

    def _watch_steps(self, stamps: list[float], arrivals: list[float]) -> None:
        """Notes where stamps step unevenly: only there can the sensor's clock have been set."""
        for stamp, arrival in zip(stamps, arrivals, strict=True):
            step, came = stamp - self._stamp, arrival - self._arrival
            if abs(step - self._step) > UNEVEN * self._step:
                self._uneven_at = arrival
                if step - self._step - came > SET_FORWARD:
                    self._set_forward_at = arrival
            else:
                self._step = step
            if math.isnan(self._step):
                self._step = step
            self._stamp, self._arrival = stamp, arrival

    def _take(self, earliest: float, stamp: float, arrival: float) -> None:
        """Adds the last of the samples that arrived together: those before it had to wait for it.

        `earliest` is the stamp of the first of them.
        """
        if not self._stamped:
            if self._last_arrival is not None:
                self._steps.add(arrival - self._last_arrival)
            self._last_arrival = arrival
        if self._first is None:
            self._first = stamp, arrival
        since, delay = self._relative(stamp, arrival)
        if self._line.arrivals:
            beyond = delay - self._line.at(since)
            # The last of them may be later than all before them, though the first is not.
            is_set_back = earliest - self._first[0] <= self._newest
            if is_set_back or self._has_leapt(beyond, arrival):
                since, delay = self._begin_again(stamp, arrival)
            elif self._is_doubtful(beyond):
                return
        self._newest = since
        self._line.add(since, delay)

    def _relative(self, stamp: float, arrival: float) -> tuple[float, float]:
        """Stamps, and delay beyond the first one's, in s."""
        assert self._first is not None, "counted from the first sample"
        since = stamp - self._first[0]
        return since, arrival - self._first[1] - since

    def _has_leapt(self, beyond: float, arrival: float) -> bool:
        """Returns whether the sensor's clock was set; a stalled line, in contrast, catches up.

        Stamps that go on evenly are those of a clock that was not set, however much sooner they come.
        """
        if beyond < -SET_FORWARD and arrival - self._set_forward_at <= LEAP_ARRIVALS:
            return True
        if beyond <= LEAP:
            self._late_since = None
        elif self._late_since is None:
            self._late_since = arrival
        if self._late_since is None:
            return False
        was_set = self._uneven_at >= self._late_since - LEAP_ARRIVALS
        return arrival - self._late_since > (LEAP_ARRIVALS if was_set else LATE_FOR_GOOD)

    def _is_doubtful(self, beyond: float) -> bool:
        """Returns whether it came so much sooner than all before that its stamp may be wrong."""
        before, self._sooner = self._sooner, min(beyond, 0.0)
        return self.settled and beyond < -DOUBTED and before > 0.5 * beyond

    def _begin_again(self, stamp: float, arrival: float) -> tuple[float, float]:
        # At first, what had waited in buffers comes at once, and is no clock that was set.
        self.leaps += self.settled
        self._first, self._line, self._late_since = (stamp, arrival), LeastDelay(), None
        if self._given is not None:
            self._given = math.nan, self._given[1]
        return 0.0, 0.0

    def _never_back(self, since: list[float], wanted: list[float], sigma: float) -> list[float]:
        """Approaches the wanted times, slowly once settled, and never runs back (eq. 7).

        Before that they step ahead, but by no more than `sigma`, s, the uncertainty stated before.
        """
        if self._given is None:
            return wanted
        stamp, host = self._given
        if math.isnan(stamp):
            stamp = since[0] - STEP_AFTER_LEAP
        step = since[0] - stamp
        ahead = host - wanted[0] + (1.0 + self._line.skew) * step
        if abs(ahead) < ALMOST_THERE < 0.1 * step or (-sigma <= ahead <= 0.0 and not self.settled):
            return wanted
        pace = SLEW if self.settled else CATCH_UP
        left = [max(abs(ahead) - pace * (each - stamp), 0.0) for each in since]
        return [time + math.copysign(off, ahead) for time, off in zip(wanted, left, strict=True)]


def _last_of_each(arrivals: FloatArray) -> list[int]:
    """Places of the last of those that arrived together."""
    return [*np.flatnonzero(np.diff(arrivals)).tolist(), len(arrivals) - 1]


def _shown(seconds: float) -> str:
    return f"{1e6 * seconds:.3g} us" if seconds < 1e-3 else f"{1e3 * seconds:.3g} ms"
