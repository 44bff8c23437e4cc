"""Turns at constant rate for the gyroscope: which axis, at which rate, how long, from which angles.

The usual test of a gyroscope (IEEE Std 1431, 12.8; IEEE Std 952, 12.9): each rate both ways, held until
its mean is known. An axis without limits of angle holds a rate as long as is asked for; one with limits
sweeps its range.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, product

import numpy as np

from tumble.foundation.errors import TableError
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import join
from tumble.tools.table.axes import Axis, level_from_table

SHORTEST_RUN = 4.0
"""s at constant rate below which a sweep of an axis with limits is left out."""
NEW_DIRECTION = 0.5
"""Sine of the angle from all directions shown so far above which a direction shows something new."""
RAMPS = 1.25
"""Angle of both ramps of a sweep over that of ramps at the stated acceleration: with a margin."""


@dataclass(frozen=True, slots=True)
class RateRun:
    """One axis at one rate; the others stand still."""

    axis: int
    """Number of the axis, from the floor up."""
    rate: float
    """rad/s, with its sign."""
    seconds: float
    """s at that rate."""
    start: FloatArray
    """(axes,) rad where it begins."""


@dataclass(frozen=True, slots=True)
class Sweep(RateRun):
    """A run of an axis with limits of angle: from rest to rest."""

    end: FloatArray
    """(axes,) rad."""


def plan_rates(axes: Sequence[Axis], rates: Sequence[float], seconds: float) -> tuple[RateRun, ...]:
    """Plans every rate, both ways, about every direction of the units that the table can turn them about.

    `rates` in rad/s, all above zero. Axes without limits of angle come first, and turn where they are nearest
    to the vertical, so that gravity stands still in the units; one with limits sweeps its range.

    Raises `TableError` where a rate is no rate, or no axis can hold it.
    """
    rates = sorted(rates)
    if any(not 0.0 < rate < math.inf for rate in rates) or len(set(rates)) < len(rates):
        raise TableError("rates: give each rate once, above zero, in deg/s; both signs are run")
    runs = [run for number, start in _starts(axes) for run in _runs_from(axes, number, start, rates, seconds)]
    held = {abs(run.rate) for run in runs}
    if lacking := [rate for rate in rates if rate not in held]:
        most = "; ".join(f"{axis.name} {math.degrees(axis.limits.rate):.6g} deg/s" for axis in axes)
        raise TableError(
            f"rates: no axis holds {join([f'{math.degrees(rate):.6g}' for rate in lacking])} deg/s for "
            f"{SHORTEST_RUN:g} s or longer (at most: {most}); take it off the list"
        )
    return tuple(runs)


def seconds_of_runs(axes: Sequence[Axis], runs: Sequence[RateRun]) -> float:
    """Returns the time that runs take with their ramps, s."""
    ramps = (2.0 * abs(run.rate) / axes[run.axis].limits.acceleration for run in runs)
    return sum(run.seconds for run in runs) + sum(ramps)


def lines_of_runs(axes: Sequence[Axis], runs: Sequence[RateRun]) -> Iterator[str]:
    """Describes the runs of each axis in one line."""
    for (number, *_), group in groupby(runs, key=lambda run: (run.axis, *_others(run))):
        own = [run for run in group if run.rate > 0.0]
        each = ", ".join(f"{math.degrees(run.rate):.6g}" for run in own)
        seconds = sorted({round(run.seconds, 1) for run in own})
        span = " to ".join(f"{each:g}" for each in sorted({seconds[0], seconds[-1]}))
        others = [
            f"{axis.name} {math.degrees(angle):.6g}"
            for axis, angle in zip(axes, own[0].start, strict=True)
            if axis is not axes[number]
        ]
        where = f" at {', '.join(others)} deg" if others else ""
        yield f"rates of {axes[number].name}{where}: {each} deg/s both ways, {span} s each"


def _starts(axes: Sequence[Axis]) -> Iterator[tuple[int, FloatArray]]:
    """Chooses axes, and angles (axes,) from which each turns the units about one more of their directions."""
    grid = _quarters(axes)
    shown: list[FloatArray] = []
    for number in sorted(range(len(axes)), key=lambda each: (axes[each].limits.angle is not None, -each)):
        upright = _uprightness(axes, number, grid)
        chosen = grid if axes[number].limits.angle is not None else grid[upright == upright.max()]
        directions = _in_units(axes, number, chosen)
        while len(shown) < 3:
            new = np.linalg.norm(
                directions - sum(np.outer(directions @ each, each) for each in shown), axis=1
            )
            best = int(np.argmax(np.round(new, 6)))
            if new[best] < NEW_DIRECTION:
                break
            left = directions[best] - sum((directions[best] @ each) * each for each in shown)
            shown.append(left / np.linalg.norm(left))
            yield number, chosen[best]


def _quarters(axes: Sequence[Axis]) -> FloatArray:
    """All angles (n, axes) in steps of a quarter turn within the limits, the nearest to zero first."""
    columns = []
    for axis in axes:
        low, high = axis.limits.angle or (-math.pi, math.pi)
        quarters = 0.5 * math.pi * np.array([0.0, 1.0, -1.0, 2.0])
        within = quarters[(quarters >= low) & (quarters <= high)]
        columns.append(within if len(within) else np.array([0.5 * (low + high)]))
    grid = np.array(list(product(*columns)))
    nearest_first: FloatArray = grid[np.argsort(np.abs(grid).sum(axis=1), kind="stable")]
    return nearest_first


def _runs_from(
    axes: Sequence[Axis], number: int, start: FloatArray, rates: Sequence[float], seconds: float
) -> Iterator[RateRun]:
    axis = axes[number]
    for rate in (each for each in rates if each <= axis.limits.rate * (1.0 + 1e-9)):
        if axis.limits.angle is None:
            yield RateRun(number, rate, seconds, start)
            yield RateRun(number, -rate, seconds, start)
            continue
        low, high = axis.limits.angle
        ramps = RAMPS * rate * rate / axis.limits.acceleration
        held = min(seconds, (high - low - ramps) / rate)
        if held >= SHORTEST_RUN:
            middle, half = 0.5 * (low + high), 0.5 * (held * rate + ramps)
            ends = [_with(start, number, middle - half), _with(start, number, middle + half)]
            yield Sweep(number, rate, held, ends[0], ends[1])
            yield Sweep(number, -rate, held, ends[1], ends[0])


def _uprightness(axes: Sequence[Axis], number: int, grid: FloatArray) -> FloatArray:
    """Returns how nearly vertical an axis stands at each angle of the grid, rounded, (n,)."""
    below = level_from_table(axes[:number], grid[:, :number])
    upright: FloatArray = np.round(np.abs(below @ np.array(axes[number].about))[:, 2], 6)
    return upright


def _in_units(axes: Sequence[Axis], number: int, grid: FloatArray) -> FloatArray:
    """Returns the direction (n, 3) of an axis in the frame of the plate at each angle of the grid."""
    above = level_from_table(axes[number + 1 :], grid[:, number + 1 :])
    directions: FloatArray = np.swapaxes(above, 1, 2) @ np.array(axes[number].about)
    return directions


def _with(angles: FloatArray, axis: int, angle: float) -> FloatArray:
    changed: FloatArray = angles.copy()
    changed[axis] = angle
    return changed


def _others(run: RateRun) -> tuple[float, ...]:
    """Angles of the axes that stand still."""
    return tuple(np.delete(run.start, run.axis).tolist())
