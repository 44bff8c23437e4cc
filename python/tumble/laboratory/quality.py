"""Statistics of a laboratory: control charts of check standards, capability of lots, precision by ISO 5725.

docs/theory/drift.md derives the equations that are cited.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL

FEWEST_OF_A_CHART = 5
"""Values from which a control chart is drawn."""
FEWEST_OF_A_LOT = 5
"""Units from which the capability of a lot is stated."""
_MOVING_RANGE = 2.0 / math.sqrt(math.pi)
"""Mean distance of two values of a normal variable, in sigmas: d2 of two, 1.128."""
_RULES = (
    ("beyond three sigmas", 3.0, 1, 1),
    ("two of three beyond two sigmas", 2.0, 2, 3),
    ("four of five beyond one sigma", 1.0, 4, 5),
    ("eight in a row on one side", 0.0, 8, 8),
)
"""Western Electric rules: name, sigmas, how many, of how many in a row."""
_TAIL = 0.025


@dataclass(frozen=True, slots=True)
class ControlChart:
    """Individual values of a check standard, with limits from their moving range."""

    centre: float
    sigma: float
    signals: tuple[tuple[int, str], ...]
    """Place of the value at which a rule is broken, and the rule."""


@dataclass(frozen=True, slots=True)
class Capability:
    """Width of the limits over that of a lot."""

    units: int
    mean: float
    sigma: float
    cp: float
    cp_interval: tuple[float, float]
    cpk: float
    cpk_interval: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Precision:
    """Repeatability and reproducibility, as standard deviations."""

    repeatability: float
    repeatability_interval: tuple[float, float]
    reproducibility: float
    repeats: int
    """Degrees of freedom of the repeatability."""
    stations: int


def control_chart(values: Sequence[float]) -> ControlChart | None:
    """Make a chart of individuals and moving range, eq. 10; None of fewer than five values."""
    if len(values) < FEWEST_OF_A_CHART:
        return None
    centre = float(np.mean(values))
    sigma = float(np.mean([abs(b - a) for a, b in pairwise(values)])) / _MOVING_RANGE
    return ControlChart(centre, sigma, tuple(_signals(values, centre, sigma)))


def _signals(values: Sequence[float], centre: float, sigma: float) -> Iterator[tuple[int, str]]:
    if sigma <= 0.0:
        return
    distances = [(value - centre) / sigma for value in values]
    for place, distance in enumerate(distances):
        side = math.copysign(1.0, distance)
        for name, sigmas, needed, of in _RULES:
            last = distances[max(0, place - of + 1) : place + 1]
            beyond = sum(side * each > sigmas for each in last)
            if beyond >= needed and side * distance > sigmas:
                yield place, name
                break


def capability(values: Sequence[float], centre: float, limit: float) -> Capability | None:
    """Return Cp and Cpk of a lot for limits centre ± limit, eq. 11 and 12; None of fewer than five units."""
    count = len(values)
    if count < FEWEST_OF_A_LOT:
        return None
    mean, sigma = float(np.mean(values)), float(np.std(values, ddof=1))
    if sigma <= 0.0:
        return None
    cp = limit / (3.0 * sigma)
    cpk = (limit - abs(mean - centre)) / (3.0 * sigma)
    freedom = count - 1.0
    ends = [
        cp * math.sqrt(_core.chi_square_quantile(tail, freedom) / freedom) for tail in (1.0 - _TAIL, _TAIL)
    ]
    reach = INTERVAL * math.sqrt(1.0 / (9.0 * count) + cpk**2 / (2.0 * freedom))
    return Capability(count, mean, sigma, cp, (ends[0], ends[1]), cpk, (cpk - reach, cpk + reach))


def precision(values: Mapping[tuple[str, str], Sequence[float]]) -> Precision | None:
    """Return repeatability and reproducibility of values by unit and station, eq. 13 and 14.

    None where no unit was measured twice at one station.
    """
    cells = {place: np.array(found, dtype=float) for place, found in values.items()}
    repeats = sum(len(found) - 1 for found in cells.values())
    if repeats < 1:
        return None
    within = sum(float(((found - found.mean()) ** 2).sum()) for found in cells.values()) / repeats
    between = _between(cells, within)
    ends = [
        math.sqrt(within * repeats / _core.chi_square_quantile(tail, float(repeats)))
        for tail in (_TAIL, 1.0 - _TAIL)
    ]
    return Precision(
        repeatability=math.sqrt(within),
        repeatability_interval=(ends[0], ends[1]),
        reproducibility=math.sqrt(within + between),
        repeats=repeats,
        stations=len({station for _, station in cells}),
    )


def _between(cells: Mapping[tuple[str, str], FloatArray], within: float) -> float:
    """Variance between stations of one unit, eq. 14; zero where no unit was at two stations."""
    squares = weight = 0.0
    for unit in {unit for unit, _ in cells}:
        found = [cell for (own, _), cell in cells.items() if own == unit]
        if len(found) < 2:
            continue
        sizes = np.array([len(cell) for cell in found], dtype=float)
        means = np.array([cell.mean() for cell in found])
        squares += float(sizes @ (means - sizes @ means / sizes.sum()) ** 2) - (len(found) - 1) * within
        weight += sizes.sum() - float(sizes @ sizes) / sizes.sum()
    return max(0.0, squares / weight) if weight else 0.0
