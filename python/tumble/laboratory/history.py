"""Parameters of units over time: history, drift and due dates from the rows of the registry."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import ValidationError
from sqlalchemy import Connection, select

from tumble.calibration.limits import Limits
from tumble.foundation.documents import mistake_in
from tumble.foundation.errors import TumbleError
from tumble.foundation.results import Row, Tabular
from tumble.foundation.words import quoted
from tumble.laboratory import tables
from tumble.laboratory.parameter_history import (
    MOST_POOLED,
    Fleet,
    Measured,
    ParameterHistory,
    parameter_history,
    years_of,
)
from tumble.laboratory.quality import Capability, Precision, capability, precision
from tumble.laboratory.registry import Registry, current_units, damaged, stored_json, units_called
from tumble.laboratory.results import ideal, limit_of


@dataclass(frozen=True, slots=True)
class UnitHistory(Tabular):
    """All parameters of a unit over time."""

    unit: Row
    parameters: tuple[ParameterHistory, ...]
    pooled: int
    """Units of the model that drift was estimated from."""

    @property
    def due(self) -> str:
        """Earliest due date; empty where there is none."""
        return min((each.due for each in self.parameters if each.due), default="")

    def rows(self) -> Iterator[Row]:
        """Yield each value, with its uncertainty."""
        for each in self.parameters:
            found = each.measured
            for date, value, u, common in zip(found.dates, found.values, found.u, found.common, strict=True):
                yield {
                    "parameter": found.name, "unit": found.unit, "date": date, "value": value, "u": u,
                    "common": common,
                }  # fmt: skip

    def due_rows(self) -> Iterator[Row]:
        """Yield what is known of each parameter that has a limit."""
        for each in self.parameters:
            if each.limit is None:
                continue
            yield {
                "parameter": each.measured.name,
                "unit": each.measured.unit,
                "value": each.measured.values[-1],
                "limit": each.limit,
                "date": each.measured.dates[-1],
                "probability": each.probability,
                "q": None if each.walk is None else each.walk.q,
                "q_low": None if each.walk is None else each.walk.low,
                "q_high": None if each.walk is None else each.walk.high,
                "due": each.due,
                "reason": each.reason,
            }


def history_of(
    registry: Registry, name: str, limits: Limits | None = None, fleets: dict[str, Fleet] | None = None
) -> UnitHistory:
    """Return a unit, by serial or name, over time; raises `TumbleError` where there is none, or are several.

    Without `limits` those hold that it was last checked against. `fleets` keeps what is known of models from
    one unit to the next.
    """
    fleets = {} if fleets is None else fleets
    with registry.database.reading() as connection:
        units = list(units_called(connection, name))
        if len(units) != 1:
            why = "no unit of the registry is called so" if not units else "several units are called so"
            raise TumbleError(f"{quoted(name)}: {why}; see tumble registry list")
        unit = dict(units[0])
        key = str(unit["unit"])
        # A unit without a model is alone.
        model = str(unit["model"]) or key
        is_first = model not in fleets
        alike = _units_of_model(connection, model) if is_first and unit["model"] else []
        found = _measured(connection, list(dict.fromkeys([key, *alike])))
        if is_first:
            fleets[model] = Fleet({each: found[each] for each in alike or [key]})
        held = limits or _last_limits(registry, connection, key)
    fleet = fleets[model]
    parameters = tuple(parameter_history(each, fleet.walk(each.name), held) for each in found[key].values())
    return UnitHistory(unit, parameters, len(fleet))


@dataclass(frozen=True, slots=True)
class Lot(Tabular):
    """Latest values of all units of a lot or model, against limits."""

    units: int
    capabilities: Mapping[str, Capability]
    precisions: Mapping[str, Precision]

    def rows(self) -> Iterator[Row]:
        """Yield each parameter with what is known of it."""
        for name in dict.fromkeys([*self.capabilities, *self.precisions]):
            c, p = self.capabilities.get(name), self.precisions.get(name)
            yield {
                "parameter": name,
                "units": None if c is None else c.units,
                "mean": None if c is None else c.mean,
                "sigma": None if c is None else c.sigma,
                "cp": None if c is None else c.cp,
                "cp_low": None if c is None else c.cp_interval[0],
                "cp_high": None if c is None else c.cp_interval[1],
                "cpk": None if c is None else c.cpk,
                "cpk_low": None if c is None else c.cpk_interval[0],
                "cpk_high": None if c is None else c.cpk_interval[1],
                "repeatability": None if p is None else p.repeatability,
                "repeatability_low": None if p is None else p.repeatability_interval[0],
                "repeatability_high": None if p is None else p.repeatability_interval[1],
                "reproducibility": None if p is None else p.reproducibility,
                "repeats": None if p is None else p.repeats,
                "stations": None if p is None else p.stations,
            }


def lot_of(registry: Registry, *, lot: str = "", model: str = "", limits: Limits | None = None) -> Lot:
    """Return the capability of a lot or model, and how well its units are measured again."""
    wanted = {column: value for column, value in (("lot", lot), ("model", model)) if value}
    units = [str(row["unit"]) for row in registry.units(**wanted)]
    found: dict[str, dict[str, Measured]] = {}
    with registry.database.reading() as connection:
        for start in range(0, len(units), MOST_POOLED):
            found |= _measured(connection, units[start : start + MOST_POOLED])
        held = limits or (_last_limits(registry, connection, units[0]) if units else None)
    by_name: dict[str, dict[str, Measured]] = {}
    for unit, parameters in found.items():
        for name, measured in parameters.items():
            by_name.setdefault(name, {})[unit] = measured
    capabilities: dict[str, Capability] = {}
    precisions: dict[str, Precision] = {}
    for name, measured_of in by_name.items():
        limit = limit_of(held, name)
        if limit is not None:
            latest = [each.values[-1] for each in measured_of.values()]
            if (capable := capability(latest, ideal(name), limit)) is not None:
                capabilities[name] = capable
        if (precise := precision(_cells(measured_of))) is not None:
            precisions[name] = precise
    return Lot(len(units), capabilities, precisions)


def _cells(measured: Mapping[str, Measured]) -> dict[tuple[str, str], list[float]]:
    cells: dict[tuple[str, str], list[float]] = {}
    for unit, each in measured.items():
        for value, station in zip(each.values, each.stations, strict=True):
            cells.setdefault((unit, station), []).append(value)
    return cells


def _units_of_model(connection: Connection, model: str) -> list[str]:
    """Return units of a model, the same ones each time."""
    u = tables.unit.c
    chosen = select(u.unit).where(u.model == model).distinct().order_by(u.unit).limit(MOST_POOLED)
    keys = [str(key) for key in connection.execute(chosen).scalars()]
    return [
        str(unit["unit"]) for unit in current_units(connection, u.unit.in_(keys)) if unit["model"] == model
    ]


def _measured(connection: Connection, units: Sequence[str]) -> dict[str, dict[str, Measured]]:
    """Return the values of units by parameter, without what was superseded, each run once."""
    c, p, s = tables.calibration.c, tables.parameter.c, tables.session.c
    superseded = select(c.supersedes).where(c.unit.in_(units), c.supersedes.is_not(None))
    gone = set(connection.execute(superseded).scalars())
    chosen = (
        select(
            c.unit.label("key"), c.calibration, p.name, p.value, p.u, p.common, p.unit, p.origin, p.measured,
            s.station,
        )
        .join(tables.parameter, p.calibration == c.calibration)
        .join(tables.session, s.session == c.session)
        .where(c.unit.in_(units), p.value.is_not(None), p.u > 0.0)
        .order_by(p.measured, c.entry)
    )  # fmt: skip
    rows: dict[str, dict[str, list[Any]]] = {unit: {} for unit in units}
    seen: set[tuple[str, str, str]] = set()
    for row in connection.execute(chosen):
        key, calibration, name, *_, origin, measured, _station = row
        if calibration in gone or (key, name, origin) in seen or np.isnan(years_of(measured)):
            continue
        seen.add((key, name, origin))
        rows[key].setdefault(name, []).append(row)
    return {
        unit: {name: _together(name, found) for name, found in sorted(parameters.items())}
        for unit, parameters in rows.items()
    }


def _together(name: str, rows: Sequence[Any]) -> Measured:
    _, _, _, values, u, common, units, _, dates, stations = zip(*rows, strict=True)
    shared = tuple(each or 0.0 for each in common)
    return Measured(name, units[0], dates, values, u, shared, stations)


def _last_limits(registry: Registry, connection: Connection, unit: str) -> Limits | None:
    c, d = tables.calibration.c, tables.decision.c
    chosen = (
        select(d.limits)
        .join(tables.calibration, c.calibration == d.calibration)
        .where(c.unit == unit)
        .order_by(c.date.desc())
        .limit(1)
    )
    digest = connection.execute(chosen).scalar()
    if digest is None:
        return None
    content = stored_json(registry.document(str(digest)), "limits")
    try:
        return Limits.model_validate(content)
    except ValidationError as error:
        raise damaged("limits", mistake_in(error, Limits)) from error
