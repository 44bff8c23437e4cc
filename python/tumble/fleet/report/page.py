"""The page of a fleet: verdicts, distributions, due units, drift, units that moved beyond chance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tumble import _core
from tumble.fleet.reduction import FALSE_DISCOVERIES, MOST_NAMED, FleetSummary, LotDrift, ModelDrift
from tumble.fleet.report.figures import distribution_figure
from tumble.foundation.provenance import provenance_now
from tumble.foundation.words import count_of
from tumble.report.groups import group_of
from tumble.report.identity import Identity
from tumble.report.page import Picture, ResultPage

_FEWEST_DRAWN = 5
"""Units from which a distribution is drawn."""
_DRIFT_COLUMNS = ("parameter", "per root of a year", "95 % interval", "unit", "units")


@dataclass(frozen=True, slots=True)
class FleetTable:
    """Rows under columns, with a title."""

    key: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class FleetPage:
    """Content of the page, as the template shows it."""

    headline: str
    tables: tuple[FleetTable, ...]
    pictures: tuple[Picture, ...]
    method: tuple[tuple[str, str], ...]


def fleet_page(summary: FleetSummary) -> FleetPage:
    """Gathers the page."""
    failed = sum(summary.failures.values())
    headline = (
        f"{count_of('unit', summary.units)}, {count_of('input', summary.inputs)}: {failed} failed, "
        f"{summary.not_well} not all well, {len(summary.moved)} parameters moved beyond chance"
    )
    return FleetPage(
        headline=headline,
        tables=fleet_tables(summary),
        pictures=tuple(_pictures(summary)),
        method=tuple(_method(summary)),
    )


def fleet_tables(summary: FleetSummary) -> tuple[FleetTable, ...]:
    """Returns the tables that have rows, failures and what is due before drift and lots."""
    return tuple(table for table in _tables(summary) if table.rows)


def _tables(summary: FleetSummary) -> Iterator[FleetTable]:
    verdicts = tuple((verdict, str(count)) for verdict, count in summary.verdicts.items())
    yield FleetTable("verdicts", "Verdicts", ("verdict", "inputs"), verdicts)
    yield FleetTable("failed", "Failed", ("input", "reason"), summary.failed)
    moved = tuple(
        (
            each.name,
            each.model,
            each.parameter,
            f"{each.change:+.4g} {each.unit}",
            f"{each.sigma:.2g}",
            f"{each.probability:.1e}",
        )
        for each in summary.moved[:MOST_NAMED]
    )
    yield FleetTable(
        "moved",
        "Moved beyond chance",
        ("unit", "model", "parameter", "change", "sigma", "probability"),
        moved,
    )
    due = tuple((each.name, each.model, each.parameter, each.date) for each in summary.due[:MOST_NAMED])
    yield FleetTable("due", "Due", ("unit", "model", "parameter", "due"), due)
    drift = tuple(_drift_row(each.model or "no model", each) for each in summary.drift)
    yield FleetTable("drift", "Drift", ("model", *_DRIFT_COLUMNS), drift)
    lot_drift = tuple(_drift_row(each.lot, each) for each in summary.lot_drift)
    yield FleetTable("lot-drift", "Drift of lots", ("lot", *_DRIFT_COLUMNS), lot_drift)
    lots = tuple(
        (each.lot, each.parameter, str(each.found.units), f"{each.found.cp:.2f}", f"{each.found.cpk:.2f}")
        for each in summary.lots
    )
    yield FleetTable("lots", "Lots", ("lot", "parameter", "units", "Cp", "Cpk"), lots)


def _drift_row(group: str, drift: ModelDrift | LotDrift) -> tuple[str, ...]:
    walk = drift.walk
    interval = f"{walk.low**0.5:.3g} to {walk.high**0.5:.3g}"
    return group, drift.parameter, f"{walk.q**0.5:.3g}", interval, drift.unit, str(walk.units)


def _pictures(summary: FleetSummary) -> Iterator[Picture]:
    groups: dict[str, dict[str, tuple[float, ...]]] = {}
    for name, values in summary.latest.items():
        if len(values) >= _FEWEST_DRAWN:
            groups.setdefault(group_of(name), {})[name] = values
    for group, found in groups.items():
        unit = summary.units_of[next(iter(found))]
        units = len(next(iter(found.values())))
        yield Picture(
            distribution_figure(found, unit, group),
            f"{group.capitalize()} of {units} units, the latest of each.",
        )


def _method(summary: FleetSummary) -> Iterator[tuple[str, str]]:
    yield "drift", "random walk; q by restricted maximum likelihood, pooled over the units of a model"
    yield "due", "when the probability of being within the limit falls below 95 %"
    yield (
        "moved beyond chance",
        f"{summary.tested} changes of a bias, from the first to the last calibration, against measurement "
        f"and drift; by Benjamini and Hochberg at a false discovery rate of {100 * FALSE_DISCOVERIES:.0f} %",
    )


def _identity(_: FleetSummary) -> Identity:
    return Identity("Fleet", "fleet", "", provenance_now(), f"tumble {_core.__version__}")


FLEET_REPORT = ResultPage("tumble.fleet.report", "fleet.html.j2", fleet_page, _identity)
