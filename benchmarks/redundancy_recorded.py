"""Eight real IMUs on one board: reports in health, and on faults put into their samples.

`python -m benchmarks.redundancy_recorded [--draws 20] [--no-save]`

`benchmarks/README.md` describes the replays and defines the figures.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cache
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks import redundancy_board as board
from benchmarks.redundancy_fault import InjectedFault, Kind, draw_fault
from benchmarks.redundancy_figures import SETS, by_kind, cells, flown, header, wide_console
from benchmarks.redundancy_judgement import INVALID, Event, judge, without_source
from benchmarks.redundancy_replay import MISLED, edges, replay, spoilt
from benchmarks.redundancy_set import Samples
from benchmarks.redundancy_stored import Stored
from benchmarks.results import Content, machine, save
from tumble import _core

DRAWS = 20
KINDS: tuple[Kind, ...] = ("jump", "ramp", "scale", "noise", "stuck", "wrong sign")
SIZES = (2, 3, 4)
LEAST = 0.3
"""m/s^2 of a jump or a ramp, and a tenth of it in rad/s."""
FAULT_SECONDS = (60.0, 360.0)
END = 600.0
SPARSE = 20
"""Samples from one to the next at which records are compared."""
SPANS = {"before": (0.0, board.SHAKING), "settled": (200.0, board.SHAKING), "shaken": (board.SHAKING, END)}
"""s of the recording: before it is shaken, of that what comes when all is learnt, and shaken."""


def members(random: np.random.Generator, number: int, size: int) -> tuple[int, ...]:
    """Draws a set in which a unit is; any of them is the primary."""
    others = [each for each in board.NUMBERS if each != number]
    drawn = [number, *random.choice(others, size - 1, replace=False)]
    return tuple(int(each) for each in random.permutation(drawn))


@cache
def _recorded() -> dict[int, Samples]:
    return board.recorded()


def replayed(
    numbers: Sequence[int], end: float, stored: Stored | None, faulty: int, fault: InjectedFault | None
) -> tuple[list[Event], Stored]:
    """Replays a set up to a time, s: its events, and what it stored."""
    monitor = _core.RedundancyMonitor(board.told(numbers), board.SETTINGS)
    for record in (stored or {}).values():
        why = monitor.restore(record)
        if why is not None:
            raise RuntimeError(f"a record that was adopted is not restored: {why}")
    said = spoilt([_recorded()[number].part(-np.inf, end) for number in numbers], faulty, fault)
    found = replay(monitor, said, edges(end, fault))
    return found.events, found.stored.at(end)


@cache
def stored_by(numbers: tuple[int, ...]) -> Stored:
    """Returns what a set adopts before the shaking."""
    return replayed(numbers, board.SHAKING, None, 0, None)[1]


def health() -> list[dict[str, Any]]:
    """Replays each unit as primary of a set of each size, to the end."""
    random = np.random.default_rng(0)
    found = []
    for size in SIZES:
        for number in board.NUMBERS:
            others = [each for each in board.NUMBERS if each != number]
            numbers = (number, *(int(each) for each in random.choice(others, size - 1, replace=False)))
            events, _ = replayed(numbers, END, None, 0, None)
            found.append(told_in_health(events) | {"units": size})
    return found


def told_in_health(events: Sequence[Event]) -> dict[str, Any]:
    """Counts the reports before the shaking, of that once settled, and from then on."""
    return {name: _counted(events, *span) for name, span in SPANS.items()}


def _counted(events: Sequence[Event], start: float, end: float) -> Content:
    those = [event for event in events if start <= event[0] < end]
    named = [e for e in those if e[2] == "unhealthy" and e[3]["reason"] not in INVALID]
    return {
        "hours": (end - start) / 3600.0,
        "faulty": len(named),
        "disagree": sum(event[2] == "disagree" for event in those),
        "changes": sum(event[2] == "selected" and event[3]["reason"] != "start" for event in those),
        "without_source": without_source(events, start, end),
    }


def faulted(kind: Kind, number: int, draw: int) -> dict[str, Any]:
    """Replays a set with a fault in one unit, and counts what came of it."""
    seed = [KINDS.index(kind), number, draw]
    random = np.random.default_rng(seed)
    numbers = members(random, number, SIZES[draw % len(SIZES)])
    fault = draw_fault(random, kind, float(random.uniform(*FAULT_SECONDS)), LEAST)
    faulty = numbers.index(number)
    restored = stored_by(numbers)
    events, stored = replayed(numbers, board.SHAKING, restored, faulty, fault)
    judgement = judge(events, faulty, fault.start, board.SHAKING)
    return {
        "kind": kind,
        "units": len(numbers),
        "faulty": faulty,
        "sensor": fault.sensor,
        "velocity": None,
        "angle": None,
        "misled": 0 if faulty else misled(numbers, restored, stored),
        **asdict(judgement),
    }


def misled(numbers: Sequence[int], before: Stored, after: Stored) -> int:
    """Counts secondaries whose calibration left that of health; where nothing was adopted, it is the same."""
    left = {
        unit
        for (unit, sensor), record in after.items()
        if (unit, sensor) in before
        and apart(_recorded()[numbers[unit]], sensor, before[unit, sensor], record) > MISLED[sensor]
    }
    return len(left)


def apart(said: Samples, sensor: str, *records: Mapping[str, object]) -> float:
    """Root mean square of what two records make differ of what was recorded before the shaking."""
    readings = said.specific_force if sensor == "accelerometer" else said.angular_rate
    readings = readings[said.time < board.SHAKING][::SPARSE]
    first, second = (
        np.linalg.solve(np.asarray(each["matrix"]), (readings - np.asarray(each["bias"])).T).T
        for each in records
    )
    return float(np.sqrt(np.mean(np.sum((first - second) ** 2, axis=1))))


def summary(healthy: Sequence[Mapping[str, Any]], faults: Sequence[Mapping[str, Any]]) -> Content:
    """Puts all figures together, by number of units."""
    return {
        title: {
            "health": {
                span: _total([each[span] for each in healthy if each["units"] in units]) for span in SPANS
            },
            **by_kind([each for each in faults if each["units"] in units], {"all": KINDS}),
        }
        for title, units in SETS.items()
    }


def _total(counted: Sequence[Mapping[str, float]]) -> Content:
    return {name: sum(each[name] for each in counted) for name in counted[0]}


def show(figures: Content, console: Console) -> None:
    """Prints the tables."""
    for title, of in figures.items():
        table = Table(*header(), title=f"recorded, {title}")
        for kind, each in flown(of["kinds"]).items():
            table.add_row(*cells(kind, each))
        console.print(table)
        for span, each in of["health"].items():
            console.print(f"{span}: {each}", highlight=False)


def main(arguments: Sequence[str] | None = None) -> int:
    """Replays the recording in health, then with faults."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--draws", type=int, default=DRAWS, help="of each kind in each unit")
    parser.add_argument("--no-save", action="store_true")
    options = parser.parse_args(arguments)
    console = wide_console()
    if not board.is_here():
        console.print(f"not run: {board.ABSENT}")
        return 0
    drawn = [(k, n, d) for k in KINDS for n in board.NUMBERS for d in range(options.draws)]
    faults = [faulted(*each) for each in track(drawn, "faults", console=console)]
    figures = summary(health(), faults)
    show(figures, console)
    if not options.no_save:
        save("redundancy_recorded", {"draws": options.draws, "sets": figures, "machine": machine()})
    return 0


if __name__ == "__main__":
    sys.exit(main())
