"""Times of a recorded unit by one line from its own clock, where the session had to find the line as it went.

While a session runs, times follow a line that is not known yet, and go over to a better one at 1 ms a second:
what is integrated over them errs by as much. Afterwards all arrivals are known, and one line holds for all
(docs/theory/clocks.md, eq. 8).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tumble import _core
from tumble.foundation.clock_skew import MOST_SKEW, lower_hull
from tumble.foundation.recording import FloatArray
from tumble.logs import parquet
from tumble.logs.arrow_floats import as_floats
from tumble.logs.track import RawSamples

STAMP, ARRIVAL = "sensor_time", "arrival"
"""Columns of the sensor's own time, and of when samples came, both in s."""
LEAP = 0.05
"""s by which stamp and time come apart from one sample to the next where its clock may have been set."""
UNEVEN = 0.5
"""Deviation from the usual step between stamps, as a ratio, beyond which the sensor's clock may have been
set."""
BELIEVED = 10.0
"""s after which the live clock has accepted that the sensor's clock was set back, at the latest."""
SOONER, STRAY = 1e-3, 20.0
"""s, and times the usual distance from the median, by which the quickest sample of a second is too quick."""
FEWEST = 10
"""Seconds below which none is known to be too quick."""
LEAST_STEP = 1e-4
"""s from a sample to one after a leap, where the step of neither side is known."""
LEAST_SPAN = 20.0
"""s over which delays show a skew; over less the clock is taken to be right, as that of a crystal is."""
CRYSTAL = _core.CRYSTAL
"""1-sigma of the pace of such a clock."""
SUPPORT = 2.0
"""1-sigma of the line's end, in mean heights of the quickest of each second over the root of their number."""


@dataclass(frozen=True, slots=True)
class ClockLine:
    """`time = offset + pace stamp`, from a row on."""

    first_row: int
    offset: float
    pace: float
    pace_sigma: float


class _Arrival(NamedTuple):
    """Arrival of a sample: its stamp and arrival, s, and the delay of the latter after its time."""

    stamp: float
    arrival: float
    late: float


@dataclass(slots=True)
class _Stretch:
    """Samples between two leaps of the sensor's clock."""

    first_row: int
    quickest: list[_Arrival] = field(default_factory=list)
    """The one of each second of the sensor."""
    first: float = math.nan
    """s of the sensor, of its first sample; `last` of its last one."""
    last: float = math.nan
    samples: int = 0

    @property
    def step(self) -> float:
        """Mean s of the sensor between samples; 0 of a single one."""
        return (self.last - self.first) / max(self.samples - 1, 1)

    def extend(self, stamp: FloatArray) -> None:
        """Adds the time and delay of (n,) further samples, at least one."""
        if self.samples == 0:
            self.first = float(stamp[0])
        self.last = float(stamp[-1])
        self.samples += len(stamp)

    def add(self, one: _Arrival) -> None:
        """Adds the quickest sample of a second, or of a part of it, by wherever files or batches end."""
        last = self.quickest[-1] if self.quickest else None
        if last is None or math.floor(last.stamp) != math.floor(one.stamp):
            self.quickest.append(one)
        elif one.late < last.late:
            self.quickest[-1] = one


@dataclass(slots=True)
class _Evenness:
    """Where stamps of a sensor step unevenly: only there can its clock have been set.

    The live clock's own estimate jumps as well, where a shorter delay is seen on a busy computer.
    """

    _last: float = math.nan
    _usual: float = math.nan
    _uneven: list[float] = field(default_factory=list)
    """s of the sensor: stamps after uneven steps, of the newest rows."""

    def take(self, stamp: FloatArray) -> None:
        """Adds (n,) further stamps, s."""
        if not len(stamp):
            return
        steps = np.diff(stamp, prepend=self._last)
        if math.isnan(self._usual):
            self._usual = float(np.nanmedian(steps)) if len(stamp) > 1 else math.nan
        uneven = stamp[np.abs(steps - self._usual) > UNEVEN * self._usual]
        recent = [each for each in self._uneven if abs(stamp[0] - each) < BELIEVED]
        self._uneven = [*recent, *uneven.tolist()]
        self._last = float(stamp[-1])

    def allows_leap(self, stamp: float, *, set_back: bool) -> bool:
        """Returns whether the sensor's clock may have been set at an added stamp.

        That it was set back may show only after a while, from samples that all are late.
        """
        return any(each == stamp or (set_back and 0.0 < stamp - each < BELIEVED) for each in self._uneven)


def steady(pieces: Iterable[RawSamples], lines: list[ClockLine]) -> Iterator[RawSamples]:
    """Returns samples, whose times are stamps of the sensor, with those of the lines."""
    row = 0
    starts = np.array([line.first_row for line in lines])
    paces, offsets = np.array([line.pace for line in lines]), np.array([line.offset for line in lines])
    for piece in pieces:
        assert piece.time is not None, "recorded samples carry stamps"
        which = np.searchsorted(starts, np.arange(row, row + len(piece)), side="right") - 1
        row += len(piece)
        yield replace(piece, time=offsets[which] + paces[which] * piece.time)


def lines_of(files: Iterable[Path], clock_rate: float = 1.0) -> list[ClockLine]:
    """Finds the line of each stretch of a unit; `clock_rate` is s of its clock in a second of arrivals.

    Empty where no arrivals or stamps were recorded, where these are not of clocks that go alike, and where
    times are the stamps, as of sources that share a clock.
    """
    stretches: list[_Stretch] = []
    row, before, are_stamps, evenness = 0, np.nan, True, _Evenness()
    for time, stamp, came in _columns(files):
        if not (np.isfinite(came).all() and np.isfinite(stamp).all()):
            return []
        arrival = clock_rate * came
        apart, late = time - stamp, arrival - time
        are_stamps = are_stamps and not apart.any()
        jumps = np.diff(apart, prepend=before)
        evenness.take(stamp)
        leaps = [
            at
            for at in np.flatnonzero(np.abs(jumps) > LEAP).tolist()
            if evenness.allows_leap(float(stamp[at]), set_back=bool(jumps[at] > 0.0))
        ]
        if not stretches:
            stretches.append(_Stretch(0))
        for first, end in pairwise([*sorted({0, *leaps}), len(time)]):
            if first in leaps:
                stretches.append(_Stretch(row + first))
            if end > first:
                stretches[-1].extend(stamp[first:end])
            for begin, stop in pairwise(_second_by_second(stamp, first, end)):
                at = begin + int(np.argmin(late[begin:stop]))
                stretches[-1].add(_Arrival(float(stamp[at]), float(arrival[at]), float(late[at])))
        row, before = row + len(time), float(apart[-1])
    lines = [] if are_stamps else _in_order([stretch for stretch in stretches if stretch.quickest])
    return lines if all(abs(line.pace - 1.0) <= MOST_SKEW for line in lines) else []


def _second_by_second(stamp: FloatArray, first: int, end: int) -> list[int]:
    """Returns where each second begins among some rows, and where they end."""
    begins = np.flatnonzero(np.diff(np.floor(stamp[first:end]))) + 1
    return [first, *(first + begins).tolist(), end] if end > first else []


def _columns(files: Iterable[Path]) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    names = ["time", STAMP, ARRIVAL]
    for path in files:
        with parquet.opened(path) as file:
            if not set(names) <= set(file.schema_arrow.names):
                return
            for batch in file.iter_batches(columns=names, use_threads=False):
                time, stamp, arrival = (as_floats(batch.column(name)) for name in names)
                yield time, stamp, arrival


def _sound(stamp: FloatArray, arrival: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Omits samples that came far sooner than the quickest of other seconds: their stamps are wrong."""
    if len(stamp) < FEWEST:
        return stamp, arrival
    delay = arrival - stamp
    slope = np.median(np.diff(delay) / np.diff(stamp))
    off = delay - slope * (stamp - stamp[0])
    usual = np.median(off)
    sound = off > usual - max(SOONER, STRAY * float(np.median(np.abs(off - usual))))
    return stamp[sound], arrival[sound]


def _in_order(stretches: list[_Stretch]) -> list[ClockLine]:
    """Fits the line of each; one that would end after the next begins had longer delays, and yields."""
    lines: list[ClockLine] = []
    begins, step = math.inf, LEAST_STEP
    for stretch in reversed(stretches):
        line, step = _line(stretch), stretch.step or step
        ends = line.offset + line.pace * (stretch.last + step)
        line = replace(line, offset=line.offset - max(ends - begins, 0.0))
        begins = line.offset + line.pace * stretch.first
        lines.insert(0, line)
    return lines


def _line(stretch: _Stretch) -> ClockLine:
    """Fits the line below all arrivals with the least sum of distances (eq. 8)."""
    stamp, arrival = _sound(
        np.array([one.stamp for one in stretch.quickest]),
        np.array([one.arrival for one in stretch.quickest]),
    )
    if stamp[-1] - stamp[0] < LEAST_SPAN:
        return ClockLine(stretch.first_row, float((arrival - stamp).min()), 1.0, CRYSTAL)
    corners = lower_hull(zip((stamp - stamp[0]).tolist(), (arrival - stamp).tolist(), strict=True))
    middle = float(np.mean(stamp - stamp[0]))
    (x0, y0), (x1, y1) = next(edge for edge in pairwise(corners) if edge[1][0] >= middle)
    slope = (y1 - y0) / (x1 - x0)
    heights = np.sort(arrival - stamp - slope * (stamp - stamp[0] - x0) - y0)[2:]
    usual = float(np.median(heights)) / math.log(2.0)  # eq. 4
    sigma = SUPPORT * usual / math.sqrt(len(heights)) / (x1 - x0)  # eq. 5
    return ClockLine(stretch.first_row, float(y0 - slope * (x0 + stamp[0])), 1.0 + slope, sigma)
