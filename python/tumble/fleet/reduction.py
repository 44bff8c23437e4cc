"""Summaries over all units of a fleet: drift of models, due dates, lots, units that moved beyond chance."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tumble.calibration.limits import Limits
from tumble.fleet.job import REDUCTIONS, Reduction
from tumble.fleet.parts import rows
from tumble.fleet.places import FileStore
from tumble.foundation.days import day_of
from tumble.foundation.documents import LARGEST_NUMBER
from tumble.foundation.words import plain
from tumble.laboratory.drift import Walk
from tumble.laboratory.parameter_history import (
    MOST_POOLED,
    Fleet,
    Measured,
    parameter_history,
)
from tumble.laboratory.quality import Capability, capability
from tumble.laboratory.results import ideal, limit_of

FALSE_DISCOVERIES = 0.05
"""Share of the units that are named which may not have moved."""
MOST_NAMED = 100
"""Failures, due units and outliers that are listed one by one."""
MOST_LOTS = 50
"""Lots whose drift is estimated, those with the most units."""


@dataclass(frozen=True, slots=True)
class ModelDrift:
    """Drift of one parameter, pooled over units of a model."""

    model: str
    parameter: str
    unit: str
    """Unit of the parameter."""
    walk: Walk


@dataclass(frozen=True, slots=True)
class LotDrift:
    """Drift of one parameter, pooled over units of a lot."""

    lot: str
    parameter: str
    unit: str
    """Unit of the parameter."""
    walk: Walk


@dataclass(frozen=True, slots=True)
class Due:
    """A unit that is due for calibration."""

    name: str
    model: str
    parameter: str
    date: str
    """YYYY-MM-DD."""


@dataclass(frozen=True, slots=True)
class Moved:
    """A parameter of a unit that changed by more than chance explains."""

    name: str
    model: str
    parameter: str
    unit: str
    change: float
    """From the first to the last calibration."""
    sigma: float
    """Standard deviation of that change by measurement and the drift of the model."""
    probability: float
    """Probability of as large a change by chance."""


@dataclass(frozen=True, slots=True)
class LotCapability:
    """Latest values of one parameter of a lot, against its limit."""

    lot: str
    parameter: str
    found: Capability


@dataclass(frozen=True, slots=True)
class FleetSummary:
    """Summary of the results of a fleet."""

    inputs: int
    units: int
    verdicts: Mapping[str, int]
    not_well: int
    """Results in which something is known to be wrong or was not shown."""
    failures: Mapping[str, int]
    """Number of inputs by the reason of their failure."""
    failed: tuple[tuple[str, str], ...]
    """FileStore and reason of the first of them."""
    drift: tuple[ModelDrift, ...]
    lot_drift: tuple[LotDrift, ...]
    due: tuple[Due, ...]
    moved: tuple[Moved, ...]
    tested: int
    """Changes of a parameter that were tested."""
    lots: tuple[LotCapability, ...]
    latest: Mapping[str, tuple[float, ...]]
    """Latest values of all units by parameter, in its unit."""
    units_of: Mapping[str, str]
    """Unit of each parameter."""


@dataclass(frozen=True, slots=True)
class _Unit:
    name: str
    model: str
    lot: str
    parameters: Mapping[str, Measured]


def summarize(
    results: FileStore, limits: Limits | None = None, wanted: Collection[Reduction] = REDUCTIONS
) -> FleetSummary:
    """Gathers all results, with the reductions that are wanted.

    Raises `StoreError` where a part cannot be read.
    """
    gathered = _Gathered()
    gathered.add(rows(results, _COLUMNS))
    units = gathered.units()
    fleets = _fleets(units, _model_of)
    lots = _fleets(_of_largest_lots(units), _lot_of) if "drift" in wanted else {}
    moved, tested = moved_beyond_chance(units, fleets) if "outliers" in wanted else ((), 0)
    due = _due(units, fleets, limits) if "due" in wanted else ()
    return FleetSummary(
        inputs=gathered.inputs,
        units=len(units),
        verdicts=dict(gathered.verdicts.most_common()),
        not_well=gathered.not_well,
        failures=dict(gathered.failures.most_common(MOST_NAMED)),
        failed=tuple(gathered.failed),
        drift=tuple(ModelDrift(*each) for each in _drift(units, fleets, _model_of) if "drift" in wanted),
        lot_drift=tuple(LotDrift(*each) for each in _drift(units, lots, _lot_of)),
        due=tuple(sorted(due, key=lambda each: (each.date, each.name))),
        moved=moved,
        tested=tested,
        lots=tuple(_lots(units, limits)) if "lots" in wanted else (),
        latest=_latest(units),
        units_of={name: each.unit for unit in units for name, each in unit.parameters.items()},
    )


_COLUMNS = (
    "place",
    "unit",
    "serial",
    "model",
    "lot",
    "day",
    "station",
    "verdict",
    "exit_code",
    "failure",
    "parameters",
)


def _in_lines(stored: Any) -> Any:  # noqa: ANN401 - plain data
    """Returns a row with each text on one line, as whoever wrote it may end lines to begin others."""
    if isinstance(stored, dict):
        return {name: _in_lines(each) for name, each in stored.items()}
    if isinstance(stored, list):
        return [_in_lines(each) for each in stored]
    return plain(stored) if isinstance(stored, str) else stored


class _Gathered:
    """Values of each unit by parameter, and how inputs ended."""

    def __init__(self) -> None:
        self.inputs = 0
        self.not_well = 0
        self.verdicts: Counter[str] = Counter()
        self.failures: Counter[str] = Counter()
        self.failed: list[tuple[str, str]] = []
        self._facts: dict[str, tuple[str, str]] = {}
        self._values: dict[str, dict[str, list[_Value]]] = {}

    def add(self, found: Iterable[Mapping[str, object]]) -> None:
        """Adds rows of results."""
        for row in map(_in_lines, found):
            self.inputs += 1
            if failure := str(row["failure"] or ""):
                self.failures[failure] += 1
                if len(self.failed) < MOST_NAMED:
                    self.failed.append((str(row["place"]), failure))
                continue
            self.verdicts[str(row["verdict"])] += 1
            self.not_well += row["exit_code"] != 0
            self._add_values(row)

    def _add_values(self, row: Mapping[str, object]) -> None:
        name = str(row["serial"] or row["unit"])
        self._facts[name] = str(row["model"] or ""), str(row["lot"] or "")
        own = self._values.setdefault(name, {})
        parameters = row["parameters"]
        assert isinstance(parameters, list)
        for each in parameters:
            if _is_usable(each["value"]) and _is_usable(each["u"]) and each["u"] > 1.0 / LARGEST_NUMBER:
                own.setdefault(each["name"], []).append(
                    (
                        str(row["day"]),
                        each["value"],
                        each["u"],
                        each["common"] if _is_usable(each["common"]) else 0.0,
                        each["unit"],
                        row["station"],
                    )
                )

    def units(self) -> list[_Unit]:
        """Returns the units, each with its values in the order of time."""
        return [
            _Unit(name, *self._facts[name], {key: _measured(key, found) for key, found in values.items()})
            for name, values in sorted(self._values.items())
        ]


_Value = tuple[str, float, float, float, str, object]


def _is_usable(value: float | None) -> bool:
    return value is not None and abs(value) <= LARGEST_NUMBER


def _measured(name: str, values: Sequence[_Value]) -> Measured:
    days, numbers, u, common, units, stations = zip(*sorted(values, key=lambda each: each[0]), strict=True)
    return Measured(name, units[0], days, numbers, u, common, tuple(str(each or "") for each in stations))


def _is_dated(measured: Measured) -> bool:
    return all(day_of(date) for date in measured.dates)


def _model_of(unit: _Unit) -> str:
    return unit.model


def _lot_of(unit: _Unit) -> str:
    return unit.lot


def _of_largest_lots(units: Sequence[_Unit]) -> list[_Unit]:
    largest = Counter(unit.lot for unit in units if unit.lot).most_common(MOST_LOTS)
    wanted = {lot for lot, _ in largest}
    return [unit for unit in units if unit.lot in wanted]


def _fleets(units: Sequence[_Unit], group_of: Callable[[_Unit], str]) -> dict[str, Fleet]:
    """Pools units by model or lot; those without a model are a model of their own together."""
    by_group: dict[str, dict[str, Mapping[str, Measured]]] = {}
    for each in units:
        pool = by_group.setdefault(group_of(each), {})
        dated = {name: found for name, found in each.parameters.items() if _is_dated(found)}
        # Units with one calibration show no drift.
        if len(pool) < MOST_POOLED and any(len(found.values) > 1 for found in dated.values()):
            pool[each.name] = dated
    return {group: Fleet(pool) for group, pool in by_group.items()}


def _drift(
    units: Sequence[_Unit], fleets: Mapping[str, Fleet], group_of: Callable[[_Unit], str]
) -> Iterator[tuple[str, str, str, Walk]]:
    """Yields group, parameter, its unit and its walk, where the units of the group show one."""
    known: dict[tuple[str, str], str] = {}
    for unit in units:
        for name, each in unit.parameters.items():
            known.setdefault((group_of(unit), name), each.unit)
    for (group, name), unit_of in sorted(known.items()):
        if group in fleets and (walk := fleets[group].walk(name)) is not None:
            yield group, name, unit_of, walk


def _due(units: Sequence[_Unit], fleets: Mapping[str, Fleet], limits: Limits | None) -> Iterator[Due]:
    for unit in units:
        for name, each in unit.parameters.items():
            if not _is_dated(each):
                continue
            history = parameter_history(each, fleets[unit.model].walk(name), limits)
            if history.due:
                yield Due(unit.name, unit.model, name, history.due)


def moved_beyond_chance(
    units: Sequence[_Unit], fleets: Mapping[str, Fleet], rate: float = FALSE_DISCOVERIES
) -> tuple[tuple[Moved, ...], int]:
    """Returns the biases that changed by more than chance explains, and the number of those tested.

    A share of `rate` of the named units is expected not to have moved. Source: Benjamini and
    Hochberg, Controlling the false discovery rate, J. R. Statist. Soc. B 57 (1995), section 3.1.
    """
    tested = sorted(
        (each for unit in units for each in _changes(unit, fleets[unit.model])),
        key=lambda each: each.probability,
    )
    bounds = rate * np.arange(1, len(tested) + 1) / max(1, len(tested))  # eq. 16
    below = np.flatnonzero([each.probability <= bound for each, bound in zip(tested, bounds, strict=True)])
    named = int(below[-1]) + 1 if len(below) else 0
    return tuple(tested[:named]), len(tested)


def _changes(unit: _Unit, fleet: Fleet) -> Iterator[Moved]:
    for name, each in unit.parameters.items():
        if " bias " not in name or len(each.values) < 2:
            continue
        series = each.series
        walk = fleet.walk(name) if _is_dated(each) else None
        drift = walk.q * float(series.times[-1] - series.times[0]) if walk is not None else 0.0
        sigma = math.sqrt(float(series.variances[0] + series.variances[-1]) + drift)  # eq. 15
        change = each.values[-1] - each.values[0]
        chance = math.erfc(abs(change) / sigma / math.sqrt(2.0))
        yield Moved(unit.name, unit.model, name, each.unit, change, sigma, chance)


def _lots(units: Sequence[_Unit], limits: Limits | None) -> Iterator[LotCapability]:
    values: dict[tuple[str, str], list[float]] = {}
    for unit in units:
        for name, each in unit.parameters.items() if unit.lot else ():
            values.setdefault((unit.lot, name), []).append(each.values[-1])
    for (lot, name), latest in sorted(values.items()):
        limit = limit_of(limits, name)
        if limit is not None and (found := capability(latest, ideal(name), limit)) is not None:
            yield LotCapability(lot, name, found)


def _latest(units: Sequence[_Unit]) -> dict[str, tuple[float, ...]]:
    found: dict[str, list[float]] = {}
    for unit in units:
        for name, each in unit.parameters.items():
            found.setdefault(name, []).append(each.values[-1])
    return {name: tuple(values) for name, values in sorted(found.items())}
