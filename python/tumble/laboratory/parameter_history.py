"""Parameters of units over time, drift of their model and due dates, wherever their values come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from functools import lru_cache

import numpy as np

from tumble.calibration.limits import Limits
from tumble.laboratory.drift import (
    HORIZON,
    Series,
    Walk,
    due_time,
    interval,
    pooled_walk,
    probability_within,
    state_after,
)
from tumble.laboratory.quality import ControlChart, control_chart
from tumble.laboratory.results import ideal, limit_of

MOST_POOLED = 100
"""Units of a model that the walk is estimated from: more add little, and take long."""
YEAR = 365.25 * 86400.0
"""s."""
_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
LAST_DAY = "9999-12-31"
"""Last day that a date can state."""
_NO_DRIFT_SHOWN = "the units of its model show too few changes"


@dataclass(frozen=True, slots=True)
class Measured:
    """Values of one parameter of one unit, in the order of time; each run counts once."""

    name: str
    unit: str
    dates: tuple[str, ...]
    values: tuple[float, ...]
    u: tuple[float, ...]
    common: tuple[float, ...]
    stations: tuple[str, ...]

    @property
    def series(self) -> Series:
        """The same as drift is computed from: the part of u that the reference leaves is apart."""
        u, common = np.array(self.u), np.array(self.common)
        own = np.maximum(u**2 - common**2, 1e-6 * u**2)
        return Series(
            np.array([years_of(date) for date in self.dates]),
            np.array(self.values),
            own,
            float(np.max(common**2)),
        )


@dataclass(frozen=True, slots=True)
class ParameterHistory:
    """One parameter of a unit over time, with the drift of its model."""

    measured: Measured
    walk: Walk | None
    """None where the units of the model show too few changes."""
    chart: ControlChart | None
    """None of fewer than five values."""
    limit: float | None
    """Largest distance from the ideal value; None where nobody states one."""
    due: str
    """Date, or empty where the unit is not due within the horizon or nothing shows when."""
    reason: str
    """Why there is no due date; empty where there is one."""
    probability: float | None
    """Probability of being within the limit at the last calibration; None where it is not known."""

    def predicted(self, years: float) -> tuple[float, float] | None:
        """Return the 95 % interval of the true value so many years after 1970; None without a walk."""
        if self.walk is None:
            return None
        return interval(state_after(self.measured.series, self.walk), self.walk, years)


class Fleet:
    """Units of a model whose drift is estimated together; each parameter's walk is computed once."""

    def __init__(self, units: Mapping[str, Mapping[str, Measured]]) -> None:
        self._units = [parameters for parameters in units.values() if parameters]
        self._walks: dict[str, Walk | None] = {}

    def __len__(self) -> int:
        return len(self._units)

    def walk(self, parameter: str) -> Walk | None:
        """Return the walk of a parameter; None where the units show too few changes."""
        if parameter not in self._walks:
            found = [each[parameter].series for each in self._units if parameter in each]
            self._walks[parameter] = pooled_walk(found)
        return self._walks[parameter]


def parameter_history(measured: Measured, walk: Walk | None, limits: Limits | None) -> ParameterHistory:
    """Returns a parameter over time with its due date, as far as a limit is stated and drift is known."""
    limit = limit_of(limits, measured.name)
    due, reason, probability = "", "no limit is stated", None
    if limit is not None and walk is None:
        reason = _NO_DRIFT_SHOWN
    elif limit is not None and walk is not None:
        state, centre = state_after(measured.series, walk), ideal(measured.name)
        probability = probability_within(state, walk, state.time, centre, limit)
        time = due_time(state, walk, centre, limit)
        due, reason = ("", f"not within {HORIZON:.0f} years") if time is None else (date_of(time), "")
    return ParameterHistory(
        measured=measured,
        walk=walk,
        chart=control_chart(measured.values),
        limit=limit,
        due=due,
        reason=reason,
        probability=probability,
    )


@lru_cache(1 << 14)
def years_of(date: str) -> float:
    """Return the years from 1970 to a date of ISO 8601; NaN where it is none."""
    try:
        moment = datetime.fromisoformat(date.replace("Z", "+00:00"))
    except ValueError:
        return np.nan
    known = moment if moment.tzinfo else moment.replace(tzinfo=timezone.utc)
    return (known - _EPOCH).total_seconds() / YEAR


def date_of(years: float) -> str:
    """Return the day that lies so many years after the beginning of 1970."""
    try:
        return (_EPOCH + timedelta(seconds=years * YEAR)).strftime("%Y-%m-%d")
    except OverflowError:  # a date that a damaged registry holds
        return LAST_DAY
