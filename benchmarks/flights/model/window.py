"""Means of readings under triangles of 0.1 s at 20 Hz, exact for lines, and close for curves of rates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from benchmarks.redundancy_set import Samples
from tumble.foundation.recording import FloatArray

HOP = 0.05
"""s from one window to the next, and half the width of a triangle."""
BLOCK = 20
"""Windows of a block, which is learnt from once the next one has ended in agreement."""
ENDS = 0.5
"""s by which logs end apart."""
LONGEST = 1.6
"""Sample interval over the usual one beyond which a window is dropped: a sample is missing."""
COUNTED, COUNTS = 0.25, 2
"""s over which samples are counted, and how often, before the interval is known: the shortest is usual."""
CURVE = 1.0 / 12.0
"""Share of the squared interval, times the second derivative, by which straight lines exceed a curve."""
USUAL = 8.0
"""Windows over which intervals are averaged."""
LATE = 0.1
"""s of silence."""
LATE_INTERVALS = 3.0
"""Sample intervals of silence, where these are longer."""
PAUSE = 0.5
"""Share of the silence after which the quickest unit is late, from which on a gap of all is a pause."""
MOST_REPEATED = 255
"""Equal readings in succession beyond which none are counted."""


UnitWindows: TypeAlias = tuple[
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    NDArray[np.bool_],
    NDArray[np.int64],
    FloatArray,
    FloatArray,
    float,
]
"""Columns of one unit, in the order of `Windows`, and its sample interval."""


@dataclass(frozen=True, slots=True)
class Windows:
    """Windows of `n` units at `t` times."""

    time: FloatArray
    """(t,) s, the middle of each triangle; its last reading comes `HOP` later."""
    reading: FloatArray
    """(t, n, 6) m/s^2 and rad/s."""
    change: FloatArray
    """(t, n, 6) derivative of the same, under the same triangle."""
    product: FloatArray
    """(t, n, 6) rad^2/s^2: products xx, yy, zz, xy, xz, yz of angular rates."""
    scatter: FloatArray
    """(t, n, 2) variance of a sample, accelerometer and gyroscope, from steps between samples."""
    is_whole: NDArray[np.bool_]
    """(t, n) no sample is missing, and none is not a number."""
    repeated: NDArray[np.int64]
    """(t, n, 6) equal readings of an axis in succession, at the end of the window."""
    silence: FloatArray
    """(t, n) s since the last sample, at the end of the window; negative before the first, and in a pause of
    all units, behind which it counts from its end."""
    resolution: FloatArray
    """(t, n, 2) smallest change of a reading so far that is none of zero, m/s^2 and rad/s; 0 before."""
    interval: FloatArray
    """(n,) s from sample to sample, usually."""


def grid(units: Sequence[Samples]) -> FloatArray:
    """Returns the middles of all windows (t,) s between the first sample and the last.

    Logs that end within `ENDS` of the last one end with the first of them: their silence is no fault.
    """
    first = round(min(float(each.time[0]) for each in units if len(each.time)), 6)
    ends = [float(each.time[-1]) for each in units if len(each.time)]
    last = min(end for end in ends if end > max(ends) - ENDS)
    return np.asarray(np.arange(np.ceil(round(first / HOP, 6)) + 1.0, np.floor(last / HOP)) * HOP)


def beside(
    units: Sequence[UnitWindows], time: FloatArray, samples: Sequence[Samples] | None = None
) -> Windows:
    """Puts the windows of units at times (t,) s beside one another; samples show where all of them pause."""
    *columns, intervals = zip(*units, strict=True)
    reading, change, product, scatter, whole, repeated, silence, resolution = (
        np.stack(each, axis=1) for each in columns
    )
    interval = np.array(intervals)
    if samples is not None:
        silence = _without_pauses(silence, time + HOP, samples, interval)
    return Windows(
        *(time, reading, change, product, scatter, whole, repeated, silence, resolution), interval=interval
    )


def late_after(interval: FloatArray) -> FloatArray:
    """Returns the silence, s, after which units of sample intervals (n,) s are late."""
    return np.maximum(LATE, LATE_INTERVALS * interval)


def _without_pauses(
    silence: FloatArray, end: FloatArray, samples: Sequence[Samples], interval: FloatArray
) -> FloatArray:
    """Counts silence (t, n) until times (t,) s from the end of the latest pause of all units."""
    stamps = np.sort(np.concatenate([each.time for each in samples]))
    gaps = np.diff(stamps) > PAUSE * late_after(interval).min()
    begins, ends = stamps[:-1][gaps], stamps[1:][gaps]
    latest = np.concatenate([[-np.inf], ends])[np.searchsorted(ends, end, side="right")]
    paused = np.searchsorted(begins, end, side="left") > np.searchsorted(ends, end, side="left")
    counted = np.where(silence >= 0.0, np.minimum(silence, (end - latest)[:, None]), silence)
    return np.asarray(np.where(paused[:, None], -1.0, counted))


def averaged(samples: Samples, time: FloatArray) -> UnitWindows:
    """Averages the samples of a unit under triangles at times (t,) s."""
    values = np.hstack([samples.specific_force, samples.angular_rate])
    finite = np.isfinite(values).all(axis=1)
    stamps, values = np.round(samples.time[finite], 6), values[finite]
    if len(stamps):
        # A sample that is no later than one before it is dropped.
        later = np.concatenate([[True], stamps[1:] > np.maximum.accumulate(stamps)[:-1]])
        stamps, values = stamps[later], values[later]
    interval, known = _interval(stamps)
    if interval is None:
        return _nothing(len(time))
    edges = np.round(np.concatenate([[time[0] - HOP], time, [time[-1] + HOP]]), 6)
    rate = values[:, 3:]
    products = np.column_stack([rate**2, rate[:, [0]] * rate[:, 1:], rate[:, 1] * rate[:, 2]])
    once, twice, at_edges = _integrals(stamps, np.hstack([values, products]), edges)
    # A triangle is the second difference of a double integral, and that of an integral is its derivative.
    means = (twice[2:] - 2.0 * twice[1:-1] + twice[:-2]) / HOP**2
    missed = _curves(stamps, edges)[1:, None] * np.diff(at_edges[:, 3:6], axis=0) / HOP**2
    means[:, 3:6] += missed[:-1] - missed[1:]
    changes = (once[2:, :6] - 2.0 * once[1:-1, :6] + once[:-2, :6]) / HOP**2
    index = np.searchsorted(stamps, edges)
    begin, end = index[:-2], index[2:]
    last = np.clip(end - 1, 0, len(stamps) - 1)
    silence = np.where(end > 0, edges[2:] - stamps[last], -1.0)
    gaps = np.concatenate([[False], np.diff(stamps) > min(LONGEST * interval, HOP)])
    halves = _scatter(values, index)
    return (
        means[:, :6],
        changes,
        means[:, 6:],
        0.5 * (halves[:-1] + halves[1:]),
        _is_whole(gaps | (np.arange(len(stamps)) < known), begin, end),
        np.minimum(_repeated(values)[last], MOST_REPEATED),
        silence,
        _resolution(values)[last],
        interval,
    )


def _interval(stamps: FloatArray) -> tuple[float | None, int]:
    """Returns the usual interval from sample to sample, s, and the sample from which on it is known."""
    since, shortest, counts = 0, np.inf, 0
    for index in range(1, len(stamps)):
        span = float(stamps[index] - stamps[since])
        if span >= COUNTED:
            shortest = min(shortest, span / (index - since))
            since, counts = index, counts + 1
            if counts == COUNTS:
                return shortest, index
    return None, len(stamps)


def _scatter(values: FloatArray, index: NDArray[np.int64]) -> FloatArray:
    """Returns the variance of an axis between indices of samples (t, 2), from steps between samples."""
    steps = np.diff(values, axis=0) ** 2 / 6.0
    squares = np.column_stack([np.sum(steps[:, :3], axis=1), np.sum(steps[:, 3:], axis=1)])
    sums = np.vstack([np.zeros((2, 2)), np.cumsum(squares, axis=0)])
    return np.asarray(np.diff(sums[index], axis=0) / np.maximum(np.diff(index), 1)[:, None])


def _is_whole(
    unusable: NDArray[np.bool_], begin: NDArray[np.int64], end: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Returns whether all samples (m,) between indices are usable, one to either side included."""
    count = len(unusable)
    missing = np.concatenate([[0], np.cumsum(unusable)])
    inside = (begin > 0) & (end < count) & (end > begin)
    after = np.minimum(end + 1, count)
    return np.asarray(inside & (missing[after] == missing[np.maximum(begin - 1, 0)]))


def _nothing(count: int) -> UnitWindows:
    """Returns the windows of a unit that never sent enough."""
    six = np.zeros((count, 6))
    none, never = np.zeros(count, dtype=bool), np.full(count, -1.0)
    two = np.zeros((count, 2))
    return six, six, six, two, none, np.zeros((count, 6), dtype=np.int64), never, two, 1.0


def _resolution(values: FloatArray) -> FloatArray:
    """Returns the smallest change of each sensor up to each sample that is none of zero (m, 2)."""
    steps = np.abs(np.diff(values, axis=0, prepend=values[:1]))
    steps = np.where(steps > 0.0, steps, np.inf)
    least = np.column_stack([steps[:, :3].min(axis=1), steps[:, 3:].min(axis=1)])
    least = np.minimum.accumulate(least, axis=0)
    return np.asarray(np.where(np.isfinite(least), least, 0.0))


def _curves(stamps: FloatArray, at: FloatArray) -> FloatArray:
    """Returns by what straight lines exceed a curve at times `at` (m,) s, over its bend (m,) s^2.

    It is a share of the mean squared interval (docs/theory/redundancy.md, eq. 1a).
    """
    squares, square = np.zeros(len(stamps)), 0.0
    for index, step in enumerate(np.diff(stamps), start=1):
        # A pause begins anew.
        if step > HOP:
            square = 0.0
        elif square > 0.0:
            square += (step**2 - square) * step / (USUAL * HOP)
        else:
            square = step**2
        squares[index] = square
    return np.asarray(CURVE * squares[np.clip(np.searchsorted(stamps, at), 0, len(stamps) - 1)])


def _integrals(
    stamps: FloatArray, values: FloatArray, at: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Integrates straight lines between samples once and twice, up to times `at` (m,): two of (m, k).

    Returns beside these the lines at those times (m, k).
    """
    middle = values.mean(axis=0)
    values = values - middle
    step = np.diff(stamps)[:, None]
    once = np.vstack([np.zeros(values.shape[1]), np.cumsum(0.5 * step * (values[1:] + values[:-1]), axis=0)])
    pieces = once[:-1] * step + (2.0 * values[:-1] + values[1:]) * step**2 / 6.0
    twice = np.vstack([np.zeros(values.shape[1]), np.cumsum(pieces, axis=0)])
    index = np.clip(np.searchsorted(stamps, at, side="right") - 1, 0, len(stamps) - 2)
    since = (at - stamps[index])[:, None]
    slope = (values[index + 1] - values[index]) / np.maximum(step[index], 1e-9)
    # Beyond the samples the line is level: no slope of two samples is followed for seconds.
    slope = np.where((at < stamps[0])[:, None] | (at > stamps[-1])[:, None], 0.0, slope)
    start = values[index]
    after = (at - stamps[0])[:, None]
    return (
        once[index] + since * (start + 0.5 * since * slope) + middle * after,
        twice[index]
        + since * (once[index] + since * (0.5 * start + since * slope / 6.0))
        + 0.5 * middle * after**2,
        start + since * slope,
    )


def _repeated(values: FloatArray) -> NDArray[np.int64]:
    """Counts at each sample the readings of an axis before it that equal it without a break (m, 6)."""
    same = np.vstack([np.zeros(6, dtype=bool), values[1:] == values[:-1]])
    place = np.arange(len(values))[:, None]
    return np.asarray(place - np.maximum.accumulate(np.where(same, 0, place), axis=0))
