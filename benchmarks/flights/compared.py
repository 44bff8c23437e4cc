"""Simulated missions through the present monitor and through the model in the core, in one run.

`python -m benchmarks.flights.compared [--simulator sets] [--missions 500] [--jobs N]`

`sets` are missions of `benchmarks.redundancy_campaign`, `flights` those of `benchmarks.flights.campaign` with
no unit slower than `LEAST_RATE`. Missions that were flown by this module and these sources are not flown
again. `benchmarks/README.md` defines the outcomes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import count, islice
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.flights import campaign, missions
from benchmarks.flights.missions import Flight
from benchmarks.flights.model.core import flown_by_core
from benchmarks.flights.model.error import STORED, Errors
from benchmarks.flights.model.statement import Statement, first_errors
from benchmarks.flights.replay import events_of, replayed
from benchmarks.flights.score import judged, tells_of_stall
from benchmarks.flights.wilson import wilson
from benchmarks.redundancy_campaign import JOBS, SIMULATED_BY
from benchmarks.redundancy_draw import draw
from benchmarks.redundancy_figures import percentiles, wide_console
from benchmarks.redundancy_judgement import OUTCOMES, Event, Judgement, judge
from benchmarks.redundancy_replay import simulated_with_fault, watched
from benchmarks.redundancy_set import Samples
from benchmarks.results import Content, machine, save
from benchmarks.seeds import computed, digest_of
from tumble import _core

MISSIONS = {"sets": 500, "flights": 100}
"""Missions whose figures are kept, by simulator."""
LEAST_RATE = 50.0
"""Hz: windows of the model are for units that sample as fast."""
MONITORS = ("today", "model")
FOLDER = Path("out") / "compared"


def of_sets(seed: int) -> dict[str, Any]:
    """Flies a mission of the first simulator with both monitors: what each named, and when."""
    mission = draw(seed)
    simulated, said = simulated_with_fault(mission)
    stated = [Statement(unit.turn, unit.stated_arm) for unit in simulated.units]
    # Clocks of these units are stated, but for a millisecond.
    events, _ = modelled(said, stated, None, mission.precision, find_delays=False)
    faulty = None if mission.fault is None else mission.faulty
    found = {"today": watched(mission, simulated, said).events, "model": events}
    judgements = {name: judge(each, faulty, mission.onset, mission.duration) for name, each in found.items()}
    return _row(seed, mission.kind, mission.units, judgements)


def of_flights(seed: int) -> dict[str, Any]:
    """Flies a mission of the second simulator, and the flight before, with both monitors."""
    mission = missions.draw(seed)
    replay = replayed(mission)
    found, earlier = {"today": events_of(replay.result)}, {}
    known = None
    if replay.before is not None:
        flight, result = replay.before
        events, learnt = _of_flight(flight, None, mission.precision)
        earlier = {"today": events_of(result), "model": events}
        known = None if learnt is None else learnt.aged(STORED)
    found["model"], _ = _of_flight(replay.flight, known, mission.precision)
    judgements = {}
    for name, each in found.items():
        told = [event for event in each if not tells_of_stall(replay.flight, event)]
        judgements[name] = judged(mission, told)
        if name in earlier and replay.before is not None:
            end = float(replay.before[0].body.time[-1])
            judgements[name] = _joined(judgements[name], judge(earlier[name], None, 0.0, end))
    return _row(seed, mission.kind, len(mission.rates_hz), judgements)


def modelled(
    said: Sequence[Samples],
    stated: Sequence[Statement],
    known: Errors | None,
    precision: str,
    *,
    find_delays: bool,
) -> tuple[list[Event], Errors | None]:
    """Flies samples of units that are so stated through the model: events, and the errors at the end.

    Where nothing is `known` of their errors, it is what is stated.
    """
    turned = [each.turned(samples) for each, samples in zip(stated, said, strict=True)]
    first = first_errors(stated) if known is None else known
    return flown_by_core(turned, first, find_delays=find_delays, precision=precision)


def _of_flight(flight: Flight, known: Errors | None, precision: str) -> tuple[list[Event], Errors | None]:
    stated = [
        Statement(
            unit.turn,
            unit.stated_arm,
            unit.triads["accelerometer"].range,
            unit.triads["gyroscope"].range,
        )
        for unit in flight.units
    ]
    return modelled(flight.recorded, stated, known, precision, find_delays=True)


def _joined(judgement: Judgement, before: Judgement) -> Judgement:
    """Adds the health of the flight before."""
    return replace(
        judgement,
        health=judgement.health + before.health,
        faulty_in_health=judgement.faulty_in_health + before.faulty_in_health,
    )


def _row(seed: int, kind: str, units: int, judgements: Mapping[str, Judgement]) -> dict[str, Any]:
    found = {
        name: {
            "outcome": each.outcome,
            "after": each.isolated,
            "named": each.faulty_in_health,
            "health": each.health,
        }
        for name, each in judgements.items()
    }
    return {"seed": seed, "kind": kind, "units": units, **found}


def fitting(simulator: str, first: int) -> Iterator[int]:
    """Returns seeds from one on whose missions both monitors are made for."""
    if simulator == "sets":
        return count(first)
    return (seed for seed in count(first) if min(missions.draw(seed).rates_hz) >= LEAST_RATE)


def flown(
    simulator: str, seeds: Sequence[int], console: Console, engine: str = "local", jobs: int = JOBS
) -> list[dict[str, Any]]:
    """Flies all missions that were not flown yet, and returns all, in order of their seeds."""
    of_flights = tuple(Path(str(campaign.__file__)).parent.rglob("*.py"))
    key = digest_of(Path(str(_core.__file__)), *SIMULATED_BY, *sorted(of_flights))
    function = f"benchmarks.flights.compared:of_{simulator}"
    return computed(function, seeds, FOLDER / key / simulator, console, engine=engine, jobs=jobs)


def summary(rows: Sequence[Mapping[str, Any]]) -> Content:
    """Puts the figures of all missions together, by number of units, kind and monitor."""
    found = {}
    for title, units in campaign.SETS.items():
        those = [row for row in rows if row["units"] in units]
        kinds = {kind: [row for row in those if row["kind"] == kind] for kind in campaign.ROWS}
        kinds["all"] = [row for row in those if row["kind"] != "none"]
        found[title] = {
            "kinds": {kind: _of_kind(each) for kind, each in kinds.items() if each},
            "health": {name: _health(those, name) for name in MONITORS},
        }
    return found


def _of_kind(rows: Sequence[Mapping[str, Any]]) -> Content:
    return {"missions": len(rows), **{name: _outcomes(rows, name) for name in MONITORS}}


def _outcomes(rows: Sequence[Mapping[str, Any]], monitor: str) -> Content:
    counts: dict[str, int] = {name: sum(row[monitor]["outcome"] == name for row in rows) for name in OUTCOMES}
    low, high = wilson(counts["right"], len(rows))
    return {**counts, "low": low, "high": high, "after": percentiles(row[monitor]["after"] for row in rows)}


def _health(rows: Sequence[Mapping[str, Any]], monitor: str) -> Content:
    return {
        "hours": sum(row[monitor]["health"] for row in rows) / 3600.0,
        "named": sum(row[monitor]["named"] for row in rows),
        "in missions": sum(row[monitor]["named"] > 0 for row in rows),
    }


def show(simulator: str, figures: Content, console: Console) -> None:
    """Prints outcomes by number of units and kind of fault."""
    for title, of in figures.items():
        table = Table(f"{simulator}, {title}", "missions", *header())
        for kind, each in of["kinds"].items():
            table.add_row(kind, str(each["missions"]), *cells(each))
        console.print(table)
        for name, each in of["health"].items():
            console.print(
                f"{name}: {each['named']} named in {each['in missions']} missions, {each['hours']:.1f} h"
            )


def header() -> list[str]:
    """Returns the titles of the columns of `cells`."""
    columns = ("right, 95 %", *OUTCOMES[1:], "after, s")
    return [f"{name}: {column}" for name in MONITORS for column in columns]


def cells(of: Content) -> Iterator[str]:
    """Returns a row of the table, of both monitors."""
    for name in MONITORS:
        each = of[name]
        share = f"{100.0 * each['low']:.1f} to {100.0 * each['high']:.1f}"
        yield f"{each['right']} ({share})"
        yield from (str(each[outcome]) for outcome in OUTCOMES[1:])
        after = each["after"]
        yield f"{after['median']:.2g} ({after['high']:.2g})" if after["number"] else ""


def main(arguments: Sequence[str] | None = None) -> int:
    """Flies the missions, prints outcomes, and keeps the figures of whole campaigns."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--simulator", choices=tuple(MISSIONS), help="both by default")
    parser.add_argument("--missions", type=int, help="as many as are kept by default")
    parser.add_argument("--seed", type=int, default=0, help="of the first mission")
    parser.add_argument("--only", type=int, metavar="SEED", help="one mission")
    parser.add_argument("--jobs", type=int, default=JOBS)
    parser.add_argument("--engine", default="local", help="as of tumble fleet run: local, ray or ray:ADDRESS")
    parser.add_argument("--list", action="store_true", help="seeds of what did not come out right")
    options = parser.parse_args(arguments)
    console = wide_console()
    chosen = (options.simulator,) if options.simulator else tuple(MISSIONS)
    if options.only is not None:
        for simulator in chosen:
            console.print({"sets": of_sets, "flights": of_flights}[simulator](options.only), highlight=False)
        return 0
    for simulator in chosen:
        number = options.missions or MISSIONS[simulator]
        seeds = list(islice(fitting(simulator, options.seed), number))
        rows = flown(simulator, seeds, console, options.engine, options.jobs)
        figures = summary(rows)
        show(simulator, figures, console)
        if options.list:
            _list(rows, console)
        if number >= MISSIONS[simulator]:
            kept = {"missions": number, "seed": options.seed, "sets": figures, "machine": machine()}
            save(f"compared_{simulator}", kept)
    return 0


def _list(rows: Sequence[Mapping[str, Any]], console: Console) -> None:
    for row in rows:
        if row["model"]["outcome"] not in (None, "right") or row["model"]["named"]:
            console.print(row, highlight=False)


if __name__ == "__main__":
    sys.exit(main())
