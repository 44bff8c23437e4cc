"""Times of a recorded unit by one line from its own clock, where the session had to find the line as it went.

While a session runs, times follow a line that is not known yet, and go over to a better one at 1 ms a second:
what is integrated over them errs by as much. Afterwards all arrivals are known, and one line holds for all
(docs/theory/clocks.md, eq. 8).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tumble.clock_line import MOST_SKEW, lower_hull
from tumble.logs import parquet
from tumble.logs.track import RawSamples
from tumble.recording import FloatArray

STAMP, ARRIVAL = "sensor_time", "arrival"
"""Columns of the sensor's own time, and of when samples came, both in s."""
LEAP = 0.05
"""s by which stamp and time come apart from one sample to the next where the sensor's clock was set."""
LEAST_SPAN = 20.0
"""s over which delays show a skew; over less the clock is taken to be right."""


@dataclass(frozen=True, slots=True)
class Line:
    """`time = offset + pace stamp`, from a row on."""

    first_row: int
    offset: float
    pace: float


class _Arrival(NamedTuple):
    """How a sample came: its stamp and arrival, s, and by how much the latter is after its time."""

    stamp: float
    arrival: float
    late: float


@dataclass(slots=True)
class _Stretch:
    """What is known between two leaps of the sensor's clock."""

    first_row: int
    quickest: list[_Arrival]
    """The one of each second of the sensor."""

    def add(self, one: _Arrival) -> None:
        """Take in the quickest sample of a second, or of a part of it, by wherever files or batches end."""
        last = self.quickest[-1] if self.quickest else None
        if last is None or math.floor(last.stamp) != math.floor(one.stamp):
            self.quickest.append(one)
        elif one.late < last.late:
            self.quickest[-1] = one


def steady(pieces: Iterable[RawSamples], lines: list[Line]) -> Iterator[RawSamples]:
    """Give samples, whose times are stamps of the sensor, with those of the lines."""
    row = 0
    starts = np.array([line.first_row for line in lines])
    paces, offsets = np.array([line.pace for line in lines]), np.array([line.offset for line in lines])
    for piece in pieces:
        assert piece.time is not None, "recorded samples carry stamps"
        which = np.searchsorted(starts, np.arange(row, row + len(piece)), side="right") - 1
        row += len(piece)
        yield replace(piece, time=offsets[which] + paces[which] * piece.time)


def lines_of(files: Iterable[Path], clock_rate: float = 1.0) -> list[Line]:
    """Find the line of each stretch of a unit; `clock_rate` is s of its clock in a second of arrivals.

    Empty where no arrivals or stamps were recorded, or where these are not of clocks that go alike.
    """
    stretches: list[_Stretch] = []
    row, before = 0, np.nan
    for time, stamp, came in _columns(files):
        if not (np.isfinite(came).all() and np.isfinite(stamp).all()):
            return []
        arrival = clock_rate * came
        apart, late = time - stamp, arrival - time
        leaps = np.flatnonzero(np.abs(np.diff(apart, prepend=before)) > LEAP).tolist()
        if not stretches:
            stretches.append(_Stretch(0, []))
        for first, end in pairwise([*sorted({0, *leaps}), len(time)]):
            if first in leaps:
                stretches.append(_Stretch(row + first, []))
            for begin, stop in pairwise(_second_by_second(stamp, first, end)):
                at = begin + int(np.argmin(late[begin:stop]))
                stretches[-1].add(_Arrival(float(stamp[at]), float(arrival[at]), float(late[at])))
        row, before = row + len(time), float(apart[-1])
    lines = [_line(stretch) for stretch in stretches if stretch.quickest]
    return lines if all(abs(line.pace - 1.0) <= MOST_SKEW for line in lines) else []


def _second_by_second(stamp: FloatArray, first: int, end: int) -> list[int]:
    """Give where each second begins among some rows, and where they end."""
    begins = np.flatnonzero(np.diff(np.floor(stamp[first:end]))) + 1
    return [first, *(first + begins).tolist(), end] if end > first else []


def _columns(files: Iterable[Path]) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    names = ["time", STAMP, ARRIVAL]
    for path in files:
        with parquet.opened(path) as file:
            if not set(names) <= set(file.schema_arrow.names):
                return
            for batch in file.iter_batches(columns=names, use_threads=False):
                time, stamp, arrival = (batch.column(name).to_numpy(zero_copy_only=False) for name in names)
                yield time, stamp, arrival


def _line(stretch: _Stretch) -> Line:
    """Lay the line below all arrivals with the least sum of distances (eq. 8)."""
    stamp = np.array([one.stamp for one in stretch.quickest])
    arrival = np.array([one.arrival for one in stretch.quickest])
    if stamp[-1] - stamp[0] < LEAST_SPAN:
        return Line(stretch.first_row, float((arrival - stamp).min()), 1.0)
    corners = lower_hull(zip((stamp - stamp[0]).tolist(), (arrival - stamp).tolist(), strict=True))
    middle = float(np.mean(stamp - stamp[0]))
    (x0, y0), (x1, y1) = next(edge for edge in pairwise(corners) if edge[1][0] >= middle)
    slope = (y1 - y0) / (x1 - x0)
    return Line(stretch.first_row, float(y0 - slope * (x0 + stamp[0])), 1.0 + slope)
