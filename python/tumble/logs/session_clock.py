"""Times of a recorded unit by one line from its own clock, where the session had to find the line as it went.

While a session runs, times follow a line that is not known yet, and go over to a better one at 1 ms a second:
what is integrated over them errs by as much. Afterwards all arrivals are known, and one line holds for all
(docs/theory/clocks.md, eq. 8).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from tumble.logs import parquet
from tumble.logs.track import RawSamples
from tumble.lower_hull import lower_hull
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


@dataclass(slots=True)
class _Stretch:
    """What is known between two leaps of the sensor's clock."""

    first_row: int
    quickest: list[tuple[float, float]]
    """Stamp and arrival of the sample of each second that was on its way for the least time."""


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


def lines_of(files: Iterable[Path]) -> list[Line]:
    """Find the line of each stretch of a unit; empty where no arrivals or stamps were recorded."""
    stretches: list[_Stretch] = []
    row, before = 0, np.nan
    for time, stamp, arrival in _columns(files):
        apart = time - stamp
        leaps = np.flatnonzero(np.abs(np.diff(apart, prepend=before)) > LEAP).tolist()
        if not stretches:
            stretches.append(_Stretch(0, []))
        for first, end in pairwise([0, *leaps, len(time)]):
            if first in leaps:
                stretches.append(_Stretch(row + first, []))
            for begin, stop in pairwise(_second_by_second(stamp, first, end)):
                quickest = begin + int(np.argmin((arrival - time)[begin:stop]))
                stretches[-1].quickest.append((float(stamp[quickest]), float(arrival[quickest])))
        row, before = row + len(time), float(apart[-1])
    return [_line(stretch) for stretch in stretches if stretch.quickest]


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
                if np.isfinite(arrival).all() and np.isfinite(stamp).all():
                    yield time, stamp, arrival


def _line(stretch: _Stretch) -> Line:
    """Lay the line below all arrivals with the least sum of distances (eq. 8)."""
    points = np.array(stretch.quickest)
    stamp, arrival = points.T
    if stamp[-1] - stamp[0] < LEAST_SPAN:
        return Line(stretch.first_row, float((arrival - stamp).min()), 1.0)
    corners = lower_hull(zip((stamp - stamp[0]).tolist(), (arrival - stamp).tolist(), strict=True))
    middle = float(np.mean(stamp - stamp[0]))
    (x0, y0), (x1, y1) = next(edge for edge in pairwise(corners) if edge[1][0] >= middle)
    slope = (y1 - y0) / (x1 - x0)
    return Line(stretch.first_row, float(y0 - slope * (x0 + stamp[0])), 1.0 + slope)
