"""Parameters over the dates of several calibrations, and straight lines (docs/theory/compare.md, eq. 12)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime, timezone

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL
from tumble.foundation.units import CALIBRATED_TRIADS
from tumble.tools.compare.common import ACCELEROMETER
from tumble.tools.compare.parameters import parameter_names, parameter_variance, parameters_of
from tumble.tools.compare.result import History
from tumble.tools.compare.unit import PLACES, UnitModel

FEWEST = 3
"""Calibrations that a line is drawn through: two are a pair."""
_YEAR = 365.25 * 86400.0
"""s."""


def years_of(dates: Sequence[str]) -> FloatArray:
    """(n,) years since the earliest of UTC dates; NaN for those that are none."""
    seconds = np.array([_seconds(date) for date in dates])
    known = seconds[np.isfinite(seconds)]
    return (seconds - known.min(initial=np.inf)) / _YEAR if len(known) else seconds


def _seconds(date: str) -> float:
    try:
        moment = datetime.fromisoformat(date.replace("Z", "+00:00"))
    except ValueError:
        return np.nan
    return (moment if moment.tzinfo else moment.replace(tzinfo=timezone.utc)).timestamp()


def histories(units: Sequence[UnitModel], years: FloatArray, own_axes: bool) -> Iterator[History]:
    """Arranges each parameter of three or more calibrations over time; all in one frame."""
    variances = [parameter_variance(unit) for unit in units]
    for triad in CALIBRATED_TRIADS:
        for k, (name, unit) in enumerate(parameter_names(triad)):
            if own_axes and triad == ACCELEROMETER and "mounting" in name:
                continue
            place = PLACES[triad].start + k
            chosen = [
                n
                for n, each in enumerate(units)
                if triad in each.triads and np.isfinite(variances[n][place]) and np.isfinite(years[n])
            ]
            if len(chosen) < FEWEST or not np.ptp(years[chosen]):
                continue
            values = np.array([parameters_of(units[n], triad)[k] for n in chosen])
            sigmas = np.sqrt([variances[n][place] for n in chosen])
            yield line_through(name, unit, years[chosen], values, sigmas)


def line_through(name: str, unit: str, years: FloatArray, values: FloatArray, sigmas: FloatArray) -> History:
    """Fits a straight line, by the sigmas or, where one is not stated, alike, eq. 12."""
    stated = bool((sigmas <= 0.0).any())
    weights = np.ones(len(values)) if stated else sigmas**-2.0
    middle = float(weights @ years / weights.sum())
    level = float(weights @ values / weights.sum())
    spread = float(weights @ (years - middle) ** 2)
    rate = float(weights @ ((years - middle) * (values - level)) / spread)
    left = values - level - rate * (years - middle)
    scatter = float(np.sqrt(weights @ left**2 / (len(values) - 2)))
    widening = scatter if stated else max(1.0, scatter)
    return History(
        name=name,
        unit=unit,
        years=years,
        values=values,
        sigmas=sigmas,
        rate=rate,
        rate_sigma=widening / float(np.sqrt(spread)),
        middle=middle,
        level=level,
        level_sigma=widening / float(np.sqrt(weights.sum())),
        widening=1.0 if stated else widening,
        reach=INTERVAL if widening == 1.0 else _core.student_quantile(0.975, len(values) - 2.0),
    )
