"""Secondary minus primary, raw and compensated: over time, and as root mean squares."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.procedures.redundancy.report.timeline import inside, rests
from tumble.procedures.redundancy.result import RedundancyResult, Sensor, UnitTrace
from tumble.procedures.redundancy.spans import unhealthy_spans

SENSORS: tuple[Sensor, ...] = ("accelerometer", "gyroscope")
QUANTITIES: dict[Sensor, str] = {"accelerometer": "specific force", "gyroscope": "angular rate"}


@dataclass(frozen=True, slots=True)
class DifferenceTrace:
    """|secondary - primary| over windows, on axes that both have; NaN where either has no usable reading."""

    time: FloatArray
    """(n,) s."""
    before: FloatArray
    """(n,) raw, m/s^2 or rad/s."""
    after: FloatArray
    """(n,) compensated with what was stored at the time, at the primary's place."""
    axes: int = 3
    """Number of axes that both have."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Root mean square a channel of secondary minus primary since the last adoption, SI; NaN for none."""

    unit: str
    sensor: Sensor
    condition: str
    """`at rest` or `in motion`."""
    windows: int
    before: float
    after: float


def difference(result: RedundancyResult, unit: str, sensor: Sensor) -> DifferenceTrace:
    """Compares a secondary with the primary, window by window."""
    primary, secondary = (_trace(result, name) for name in (result.primary, unit))
    if primary is None or secondary is None:
        nothing = np.empty(0)
        return DifferenceTrace(nothing, nothing, nothing)
    values = zip(_values(primary, sensor), _values(secondary, sensor), strict=True)
    apart = [theirs - ours for ours, theirs in values]
    # An axis that one of them lacks has no number in any window.
    both = ~np.isnan(apart[0]).all(axis=0)
    both = both if both.any() else np.ones(3, dtype=np.bool_)
    before, after = (_lengths(np.where(both, vectors, 0.0)) for vectors in apart)
    return DifferenceTrace(result.window_time, before, after, int(both.sum()))


def agreements(result: RedundancyResult) -> tuple[Agreement, ...]:
    """Returns the differences since each sensor was calibrated last, as numbers, at rest and in motion.

    Windows in which either unit was unhealthy are left out, and so are those the error was fitted to, which
    lie before its adoption. A sensor with no stored error has none.
    """
    found = []
    resting = inside(result.window_time, rests(result.events, result.end))
    for error in sorted(result.errors, key=lambda error: result.secondaries.index(error.unit)):
        compared = difference(result, error.unit, error.sensor)
        since = result.start if error.adopted is None else error.adopted
        usable = np.isfinite(compared.before) & np.isfinite(compared.after) & (compared.time > since)
        for unit in (result.primary, error.unit):
            usable &= ~inside(compared.time, unhealthy_spans(result.events, unit, result.end))
        for condition, chosen in (("at rest", usable & resting), ("in motion", usable & ~resting)):
            found.append(
                Agreement(
                    error.unit,
                    error.sensor,
                    condition,
                    int(chosen.sum()),
                    _a_channel(compared.before[chosen], compared.axes),
                    _a_channel(compared.after[chosen], compared.axes),
                )
            )
    return tuple(found)


def thinned(time: FloatArray, values: FloatArray, most: int) -> tuple[FloatArray, FloatArray]:
    """Replaces many windows by at most `most` root mean squares of neighbours; NaN where none is finite."""
    if len(time) <= most:
        return time, values
    edges = np.linspace(0, len(time), most + 1).astype(int)
    finite = np.isfinite(values)
    counts = np.add.reduceat(finite, edges[:-1]).astype(float)
    kept = np.where(finite, values, 0.0)
    size = _size(kept)
    squares = np.add.reduceat((kept / size) ** 2, edges[:-1])
    means = size * np.sqrt(np.divide(squares, counts, out=np.full(most, np.nan), where=counts > 0))
    return time[(edges[:-1] + edges[1:]) // 2], means


def _a_channel(norms: FloatArray, axes: int) -> float:
    if not len(norms):
        return math.nan
    size = _size(norms)
    return size * float(np.sqrt(np.mean((norms / size) ** 2) / axes))


def _size(values: FloatArray) -> float:
    """Largest of values without sign, by which they can be divided: squares of 1e300 exceed all numbers."""
    return float(values.max(initial=0.0)) or 1.0


def _trace(result: RedundancyResult, unit: str) -> UnitTrace | None:
    return next((trace for trace in result.traces if trace.name == unit), None)


def _values(trace: UnitTrace, sensor: Sensor) -> tuple[FloatArray, FloatArray]:
    if sensor == "accelerometer":
        return trace.specific_force, trace.specific_force_compensated
    return trace.angular_rate, trace.angular_rate_compensated


def _lengths(vectors: FloatArray) -> FloatArray:
    """Lengths of (n, 3) vectors, without squares: those of 1e300 exceed the largest number."""
    lengths: FloatArray = np.hypot(np.hypot(vectors[:, 0], vectors[:, 1]), vectors[:, 2])
    return lengths
