"""Real flights with faults put in: PX4's default voter, the present monitor, the model, and it in the core.

`python -m benchmarks.flights.recorded [FOLDER] [--flights 4] [--classes gyroscope] [--monitors core]`

FOLDER, by default ../shared/data/quadrotor, holds a folder a flight: `imu_1.parquet` and so on, and
`rtk.parquet`. Every second flight is held out: stored errors come from the others. `benchmarks/README.md`
defines the figures.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.flights import folder as flight_folder
from benchmarks.flights import px4_voter
from benchmarks.flights.classes import CLASSES, SHARES
from benchmarks.flights.folder import RecordedFlight
from benchmarks.flights.model.aiding import of_positions
from benchmarks.flights.model.core import flown_by_core
from benchmarks.flights.model.error import Errors
from benchmarks.flights.model.monitor import flown
from benchmarks.flights.stored_errors import Store, corrected, joined, learnt, records
from benchmarks.flights.wilson import wilson
from benchmarks.redundancy_figures import wide_console
from benchmarks.redundancy_judgement import Event, judge
from benchmarks.redundancy_set import Samples
from benchmarks.results import Content, machine, save
from tumble import _core
from tumble.logs.aiding import Aiding, NativeAiding, in_order

FOLDER = Path(__file__).parents[3] / "shared" / "data" / "quadrotor"
SIZES = (2, 3, 4)
DRAWS = 2
LONG = 60.0
"""s beyond which a flight does not teach what is stored."""
MONITORS = (
    *("PX4", "PX4, stored", "today", "today, stored", "model", "model, stored", "core", "core, stored"),
    *("today, aided", "today, stored, aided", "model, aided", "model, stored, aided"),
)
"""The core takes the steps of the model. The last four are for two units, beside a receiver's velocity."""
OUTCOMES = ("right", "wrong", "none")
TIMED = ("gyroscope step 0.2 rad/s", "accelerometer step 0.3 m/s^2", "accelerometer step 1 m/s^2")
"""Classes of which the page shows the time to the name."""
SETTINGS: dict[str, object] = {"evaluate_every": 10.0}


@dataclass(frozen=True, slots=True)
class Run:
    """A set of units of one flight, with a fault or in health."""

    flight: str
    held_out: bool
    numbers: tuple[int, ...]
    """Units of the set, primary first."""
    fault: str
    """Class of the fault; empty in health."""
    faulty: int
    """Place in the set."""
    start: float
    """s, when it begins; the end of the flight in health."""
    end: float
    samples: tuple[Samples, ...]


def drawn(flight: RecordedFlight, number: int, held_out: bool, options: Mapping[str, Any]) -> list[Run]:
    """Draws the runs of a flight: all sets of each size in health, then each class of fault."""
    found = []
    everyone = range(len(flight.units))
    for size in options["units"]:
        sets = list(combinations(everyone, size))
        for numbers in sets:
            samples = tuple(flight.units[each] for each in numbers)
            found.append(
                Run(flight.name, held_out, numbers, "", -1, flight.duration, flight.duration, samples)
            )
        for index, (name, each) in enumerate(CLASSES.items()):
            if options["classes"] not in name:
                continue
            for draw in range(options["draws"]):
                random = np.random.default_rng([options["seed"], number, size, index, draw])
                numbers = tuple(
                    int(unit) for unit in random.permutation(sets[int(random.integers(len(sets)))])
                )
                faulty = int(random.integers(size))
                start = float(random.uniform(*SHARES)) * flight.duration
                samples = tuple(
                    each.inject(flight.units[unit], start, random) if place == faulty else flight.units[unit]
                    for place, unit in enumerate(numbers)
                )
                found.append(
                    Run(flight.name, held_out, numbers, name, faulty, start, flight.duration, samples)
                )
    return found


def judged(
    runs: Sequence[Run], flight: RecordedFlight, store: Store, wanted: str = ""
) -> list[dict[str, Any]]:
    """Flies runs of one flight and size with every wanted monitor, and judges the events of each."""
    stored = [store.of_set(run.numbers) for run in runs]
    found = []
    for name, events in _flown(runs, flight, stored, wanted):
        found += [_row(run, name, each) for run, each in zip(runs, events, strict=True)]
    return found


def _flown(
    runs: Sequence[Run], flight: RecordedFlight, stored: Sequence[Errors], wanted: str
) -> Iterator[tuple[str, list[list[Event]]]]:
    """Returns the events of all runs, by monitor, of those that are wanted."""
    samples, known = [run.samples for run in runs], joined(stored)
    plain: dict[str, Callable[[], list[list[Event]]]] = {
        "PX4": lambda: [px4_voter.events(each) for each in samples],
        "PX4, stored": lambda: [
            px4_voter.events(corrected(each, of)) for each, of in zip(samples, stored, strict=True)
        ],
        "today": lambda: [today(each, None) for each in samples],
        "today, stored": lambda: [today(each, of) for each, of in zip(samples, stored, strict=True)],
        "model": lambda: [each.events for each in flown(samples)],
        "model, stored": lambda: [each.events for each in flown(samples, known)],
        "core": lambda: [flown_by_core(each)[0] for each in samples],
        "core, stored": lambda: [
            flown_by_core(each, of)[0] for each, of in zip(samples, stored, strict=True)
        ],
    }
    if len(samples[0]) == 2 and len(flight.position_time):
        velocities = of_positions(flight.position_time, flight.position)
        time, value = flight.velocity
        aided = in_order([Aiding.velocity(time, value, flight_folder.SIGMA)], ())
        plain |= {
            "today, aided": lambda: [today(each, None, aided) for each in samples],
            "today, stored, aided": lambda: [
                today(each, of, aided) for each, of in zip(samples, stored, strict=True)
            ],
            "model, aided": lambda: [each.events for each in flown(samples, None, velocities)],
            "model, stored, aided": lambda: [each.events for each in flown(samples, known, velocities)],
        }
    for name, fly in plain.items():
        if wanted in name:
            yield name, fly()


def today(
    samples: Sequence[Samples], errors: Errors | None, aided: Sequence[NativeAiding] = ()
) -> list[Event]:
    """Returns the events of the present monitor, which is given what is stored and what aids, if anything."""
    monitor = _core.RedundancyMonitor([_core.RedundancyUnit(n + 1) for n in range(len(samples))], SETTINGS)
    for record in records(errors) if errors is not None else ():
        if (why := monitor.restore(record)) is not None:
            raise RuntimeError(f"a stored error is refused: {why}")
    replayed = monitor.replay(
        [each.time for each in samples],
        [np.ascontiguousarray(each.specific_force) for each in samples],
        [np.ascontiguousarray(each.angular_rate) for each in samples],
        measurements=aided,
    )
    return [(float(t), int(unit), what, dict(figures)) for t, unit, what, figures in replayed["events"]]


def _row(run: Run, monitor: str, events: Sequence[Event]) -> dict[str, Any]:
    judgement = judge(events, run.faulty if run.fault else None, run.start, run.end)
    outcome = {"right": "right", "wrong": "wrong", "too early": "wrong", None: None}.get(
        judgement.outcome, "none"
    )
    named = [event for event in events if event[2] == "unhealthy"]
    return {
        "monitor": monitor,
        "flight": run.flight,
        "held out": run.held_out,
        "units": len(run.numbers),
        "numbers": run.numbers,
        "fault": run.fault,
        "faulty": run.faulty,
        "start": run.start,
        "outcome": outcome,
        "after": judgement.isolated,
        "false": judgement.faulty_in_health,
        "disagree": judgement.disagree_in_health,
        "seconds": judgement.health,
        "named": [(round(event[0], 2), event[1], event[3]["reason"]) for event in named[:3]],
    }


def summary(rows: Sequence[Mapping[str, Any]]) -> Content:
    """Puts the figures together: monitor, number of units, class."""
    found: Content = {}
    for monitor in MONITORS:
        for units in SIZES:
            those = [row for row in rows if row["monitor"] == monitor and row["units"] == units]
            faulty = [row for row in those if row["fault"]]
            if not those:
                continue
            groups = {name: [row for row in faulty if row["fault"] == name] for name in CLASSES}
            found[f"{monitor}, N = {units}"] = {
                "all": _counted(faulty),
                "classes": {name: _counted(each) for name, each in groups.items() if each},
                "health": _health([row for row in those if not row["fault"]]),
            }
    return found


def _counted(rows: Sequence[Mapping[str, Any]]) -> Content:
    counts = {name: sum(row["outcome"] == name for row in rows) for name in OUTCOMES}
    times = [row["after"] for row in rows if row["after"] is not None]
    median, high = np.percentile(times, [50.0, 95.0]) if times else (None, None)
    return {
        "runs": len(rows),
        **counts,
        "right interval": wilson(counts["right"], len(rows)),
        "wrong interval": wilson(counts["wrong"], len(rows)),
        "median": None if median is None else float(median),
        "high": None if high is None else float(high),
    }


def _health(rows: Sequence[Mapping[str, Any]]) -> Content:
    return {
        "sets": len(rows),
        "hours": sum(row["seconds"] for row in rows) / 3600.0,
        "false exclusions": sum(row["false"] for row in rows),
        "sets with one": sum(row["false"] > 0 for row in rows),
        "disagreements": sum(row["disagree"] for row in rows),
    }


def kept(figures: Content) -> Content:
    """Returns the figures that the page shows: of all classes together, and of those that are timed."""
    return {
        half: {
            name: {**of, "classes": {each: of["classes"][each] for each in TIMED if each in of["classes"]}}
            for name, of in sets.items()
        }
        for half, sets in figures.items()
    }


def show(figures: Content, console: Console) -> None:
    """Prints a table for each number of units, then a line a monitor of health."""
    for units in SIZES:
        of = {name: figures[f"{name}, N = {units}"] for name in MONITORS if f"{name}, N = {units}" in figures}
        if not of:
            continue
        table = Table(
            "fault", *of, title=f"N = {units}: right / wrong / none; time to alert, s, median / 95 %"
        )
        for name in CLASSES:
            cells = [each["classes"].get(name) for each in of.values()]
            if any(cells):
                table.add_row(name, *(_cell(each) for each in cells))
        table.add_row("all", *(_cell(each["all"]) for each in of.values()))
        table.add_row("right, %", *(_percent(each["all"]["right interval"]) for each in of.values()))
        table.add_row("wrong, %", *(_percent(each["all"]["wrong interval"]) for each in of.values()))
        table.add_row("false exclusions", *(_false(each["health"]) for each in of.values()))
        console.print(table)


def _cell(of: Mapping[str, Any] | None) -> str:
    if of is None or not of["runs"]:
        return ""
    counts = "/".join(str(of[name]) for name in OUTCOMES)
    return counts if of["median"] is None else f"{counts}; {of['median']:.2f}/{of['high']:.2f}"


def _percent(interval: tuple[float, float]) -> str:
    return f"{100.0 * interval[0]:.1f} to {100.0 * interval[1]:.1f}"


def _false(of: Mapping[str, Any]) -> str:
    return f"{of['false exclusions']} in {of['sets with one']} of {of['sets']} sets, {of['hours']:.2f} h"


def _failures(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for row in rows:
        if row["monitor"].startswith(("model", "core")) and (
            row["outcome"] in ("wrong", "none") or row["false"]
        ):
            yield str(
                {
                    name: row[name]
                    for name in ("monitor", "flight", "numbers", "fault", "faulty", "start", "named")
                }
            )


def main(arguments: Sequence[str] | None = None) -> int:
    """Flies all, prints the tables, and keeps the figures of a whole run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=FOLDER)
    parser.add_argument("--flights", type=int, help="number of them, from the first by name")
    parser.add_argument("--classes", default="", metavar="TEXT", help="in the names of the classes of fault")
    parser.add_argument("--monitors", default="", metavar="TEXT", help="in the names of the monitors")
    parser.add_argument("--units", type=int, action="append", choices=SIZES, help="in a set; all by default")
    parser.add_argument("--draws", type=int, default=DRAWS, help="of each class in each flight and size")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--held-out", action="store_true", help="the flights alone that were held out")
    parser.add_argument("--failures", action="store_true", help="list what the model did not get right")
    parser.add_argument("--no-save", action="store_true")
    stated = parser.parse_args(arguments)
    console = wide_console()
    if not stated.folder.is_dir() or not (paths := flight_folder.flights(stated.folder)):
        console.print(f"not run: {stated.folder} holds no folder with imu_1.parquet")
        return 0
    options = {
        "units": stated.units or SIZES,
        "classes": stated.classes,
        "draws": stated.draws,
        "seed": stated.seed,
    }
    flights = [flight_folder.read(path) for path in paths[: stated.flights]]
    store = learnt([flight for flight in flights[::2] if flight.duration < LONG])
    rows = []
    for number, flight in enumerate(track(flights, "flights", console=console)):
        if stated.held_out and not number % 2:
            continue
        runs = drawn(flight, number, bool(number % 2), options)
        for size in options["units"]:
            rows += judged([run for run in runs if len(run.numbers) == size], flight, store, stated.monitors)
    figures = {
        title: summary([row for row in rows if row["held out"] == held_out])
        for title, held_out in (("looked at", False), ("held out", True))
    }
    for title, each in figures.items():
        if each:
            console.print(f"{title}, seed {stated.seed}")
            show(each, console)
    if stated.failures:
        for line in _failures(rows):
            console.print(line, highlight=False)
    is_whole = stated.flights is None and stated.units is None
    is_whole = is_whole and not (stated.classes or stated.held_out or stated.monitors)
    if is_whole and not stated.no_save:
        save("flight_recorded", {**options, "figures": kept(figures), "machine": machine()})
    return 0


if __name__ == "__main__":
    sys.exit(main())
