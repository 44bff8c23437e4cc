"""JSON that `tumble fleet` prints."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import Field

from tumble.fleet.ledger import JobStatus
from tumble.fleet.reduction import MOST_NAMED, FleetSummary, LotDrift, ModelDrift
from tumble.foundation.plain import finite
from tumble.foundation.printed import Printed

RESULT: Final = "tumble-fleet-result/1"
STATUS: Final = "tumble-fleet-status/1"


class PrintedWalk(Printed):
    """Drift of one parameter as a random walk, pooled over units."""

    parameter: str
    unit: str
    q: float
    """Variance a year, in the unit of the parameter squared."""
    q_low: float
    q_high: float
    """Ends of its 95 % interval."""
    units: int
    steps: int


class PrintedDrift(PrintedWalk):
    """Drift of one parameter, pooled over the units of a model."""

    model: str


class PrintedLotDrift(PrintedWalk):
    """Drift of one parameter, pooled over the units of a lot; of the lots with the most units."""

    lot: str


class PrintedDue(Printed):
    """A unit with the date at which it is due."""

    name: str
    model: str
    parameter: str
    date: str


class PrintedMove(Printed):
    """A parameter that changed by more than chance explains."""

    name: str
    model: str
    parameter: str
    unit: str
    change: float
    sigma: float
    probability: float


class PrintedLot(Printed):
    """Capability of one parameter of a lot."""

    lot: str
    parameter: str
    units: int
    cp: float
    cpk: float


class FleetStatusDocument(Printed):
    """Progress of a job."""

    schema_: Literal["tumble-fleet-status/1"] = Field(STATUS, alias="schema")
    verdict: Literal["running", "done", "cancelled", "failed"]
    inputs: int
    done: int
    failed: int
    not_well: int
    retried: int
    rate: float
    seconds: float
    engine: str
    reason: str
    written: float
    """s since 1970; a running job that was killed writes nothing any more."""


class FleetResultDocument(Printed):
    """Summary of the results of a fleet."""

    schema_: Literal["tumble-fleet-result/1"] = Field(RESULT, alias="schema")
    verdict: Literal["all well", "not all well", "nothing done"]
    results: str
    inputs: int
    units: int
    verdicts: dict[str, int]
    not_well: int
    """Results in which something is known to be wrong or was not shown."""
    failures: dict[str, int]
    failed: list[tuple[str, str]]
    """FileStore and reason of the first hundred."""
    drift: list[PrintedDrift]
    lot_drift: list[PrintedLotDrift]
    due: list[PrintedDue]
    moved: list[PrintedMove]
    tested: int
    """Changes that were tested."""
    lots: list[PrintedLot]
    files: dict[str, Path]


def status_content(status: JobStatus) -> dict[str, Any]:
    """Returns a status without its state, which is the verdict."""
    content = status.content()
    del content["state"]
    return content


def result_content(summary: FleetSummary, results: str, files: Mapping[str, Path]) -> dict[str, Any]:
    """Returns a summary as finite numbers, text, lists and mappings."""
    drift = [{"model": each.model, **_walk(each)} for each in summary.drift]
    lot_drift = [{"lot": each.lot, **_walk(each)} for each in summary.lot_drift]
    due = [
        {"name": each.name, "model": each.model, "parameter": each.parameter, "date": each.date}
        for each in summary.due[:MOST_NAMED]
    ]
    moved = [
        {
            "name": each.name, "model": each.model, "parameter": each.parameter, "unit": each.unit,
            "change": each.change, "sigma": each.sigma, "probability": each.probability,
        }
        for each in summary.moved
    ]  # fmt: skip
    lots = [
        {
            "lot": each.lot, "parameter": each.parameter, "units": each.found.units, "cp": each.found.cp,
            "cpk": each.found.cpk,
        }
        for each in summary.lots
    ]  # fmt: skip
    content = {
        "results": results,
        "inputs": summary.inputs,
        "units": summary.units,
        "verdicts": dict(summary.verdicts),
        "not_well": summary.not_well,
        "failures": dict(summary.failures),
        "failed": [list(each) for each in summary.failed],
        "drift": drift,
        "lot_drift": lot_drift,
        "due": due,
        "moved": moved,
        "tested": summary.tested,
        "lots": lots,
        "files": {name: str(path) for name, path in files.items()},
    }
    return {key: finite(value) for key, value in content.items()}


def _walk(drift: ModelDrift | LotDrift) -> dict[str, Any]:
    walk = drift.walk
    return {
        "parameter": drift.parameter, "unit": drift.unit, "q": walk.q, "q_low": walk.low, "q_high": walk.high,
        "units": walk.units, "steps": walk.steps,
    }  # fmt: skip
