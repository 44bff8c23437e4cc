"""Decisions in single precision, as on a device, against double: the missions of the campaign in both.

`python -m benchmarks.redundancy_precision [--missions 2000] [--seed N] [--jobs N] [--only SEED]`

A decision is an event with all of it that is no measured figure: which unit, why, on what ground. Both
precisions decide alike where they take the same decisions, each within two windows of the other's.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest
from typing import Any, TypeAlias

from rich.console import Console
from rich.table import Table

from benchmarks.redundancy_campaign import JOBS, MISSIONS, campaign
from benchmarks.redundancy_draw import DrawnMission, draw, kinds
from benchmarks.redundancy_figures import wide_console
from benchmarks.redundancy_judgement import Event
from benchmarks.redundancy_replay import simulated_with_fault, watched
from benchmarks.results import Content, machine, save
from tumble.foundation.results import Precision

TOLERANCE = 0.101
"""s, two windows, by which the times of one decision may differ."""
COMPARED = "benchmarks.redundancy_precision:compared"
PRECISIONS: tuple[Precision, Precision] = ("f64", "f32")
Decision: TypeAlias = tuple[int, str, tuple[tuple[str, object], ...]]
"""Unit, event, and what of it is no measured figure."""
Difference: TypeAlias = tuple[Decision, float | None, float | None]
"""When each precision took a decision, s; None where it did not."""


def decision(event: Event) -> Decision:
    """Returns what of an event is decided, not measured."""
    _, unit, what, figures = event
    return (
        unit,
        what,
        tuple((name, _hashable(figures[name])) for name in sorted(figures) if _decided(figures[name])),
    )


def _decided(value: object) -> bool:
    return isinstance(value, str | bool | list)


def _hashable(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def differences(double: Sequence[Event], single: Sequence[Event]) -> list[Difference]:
    """Decisions of one precision alone, or not within two windows of the other; in order of time."""
    times = [_times(events) for events in (double, single)]
    found = [
        (each, *pair)
        for each in {**times[0], **times[1]}
        for pair in _paired(*(of.get(each, []) for of in times))
        if None in pair
    ]
    return sorted(found, key=_when)


def _times(events: Sequence[Event]) -> Mapping[Decision, list[float]]:
    times: dict[Decision, list[float]] = defaultdict(list)
    for event in events:
        times[decision(event)].append(event[0])
    return times


def _paired(double: Sequence[float], single: Sequence[float]) -> Iterator[tuple[float | None, float | None]]:
    """Pair ascending times that are close; what has no partner stands alone."""
    left = list(single)
    for time in double:
        while left and left[0] < time - TOLERANCE:
            yield None, left.pop(0)
        yield time, left.pop(0) if left and left[0] <= time + TOLERANCE else None
    yield from zip_longest((), left)


def _when(difference: Difference) -> float:
    return min(time for time in difference[1:] if time is not None)


def compared(seed: int) -> dict[str, Any]:
    """Flies a mission, puts it through the monitor in both precisions, and compares what these decide."""
    mission = draw(seed)
    events = decided(mission)
    return {
        "seed": seed,
        "kind": mission.kind,
        "units": mission.units,
        "decisions": len(events["f64"]),
        "differences": differences(events["f64"], events["f32"]),
    }


def decided(mission: DrawnMission) -> dict[Precision, list[Event]]:
    """Returns the events of a mission in each precision."""
    simulated, said = simulated_with_fault(mission)
    return {
        precision: watched(replace(mission, precision=precision), simulated, said).events
        for precision in PRECISIONS
    }


def summary(missions: Sequence[Mapping[str, Any]]) -> Content:
    """Counts missions and those that were decided differently, by kind of fault."""
    by_kind = {}
    for kind in kinds():
        those = [each for each in missions if each["kind"] == kind]
        by_kind[kind] = {
            "missions": len(those),
            "decisions": sum(each["decisions"] for each in those),
            "different": sum(bool(each["differences"]) for each in those),
        }
    different = {str(each["seed"]): said(each["differences"][0]) for each in missions if each["differences"]}
    return {"missions": len(missions), "kinds": by_kind, "different": different}


def said(difference: Difference) -> str:
    """Puts a difference in words."""
    (unit, what, figures), *times = difference
    words = " ".join((f"unit {unit} {what}", *(str(value) for _, value in figures)))
    when = (
        f"{name} {'never' if time is None else f'{time:.3f} s'}"
        for name, time in zip(PRECISIONS, times, strict=True)
    )
    return f"{words}: {', '.join(when)}"


def show(figures: Content, console: Console) -> None:
    """Prints the table, and what was decided differently first in each mission."""
    table = Table("fault", "missions", "decisions", "decided differently")
    for kind, of in figures["kinds"].items():
        table.add_row(kind, str(of["missions"]), str(of["decisions"]), str(of["different"]))
    console.print(table)
    for seed, words in figures["different"].items():
        console.print(f"seed {seed}: {words}", highlight=False, soft_wrap=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Compares all missions."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--missions", type=int, default=MISSIONS)
    parser.add_argument("--seed", type=int, default=0, help="of the first mission")
    parser.add_argument("--only", type=int, metavar="SEED", help="one mission, with all its differences")
    parser.add_argument("--jobs", type=int, default=JOBS)
    parser.add_argument("--engine", default="local", help="as of tumble fleet run: local, ray or ray:ADDRESS")
    options = parser.parse_args(arguments)
    console = wide_console()
    if options.only is not None:
        for difference in compared(options.only)["differences"]:
            console.print(said(difference), highlight=False, soft_wrap=True)
        return 0
    seeds = range(options.seed, options.seed + options.missions)
    missions = campaign(seeds, console, COMPARED, engine=options.engine, jobs=options.jobs)
    figures = summary(missions)
    show(figures, console)
    if options.missions >= MISSIONS:
        save("redundancy_precision", {"seed": options.seed, **figures, "machine": machine()})
    return 0


if __name__ == "__main__":
    sys.exit(main())
