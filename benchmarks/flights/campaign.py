"""A campaign of flown missions by a simulator of its own, through the logs and the program a user has.

`python -m benchmarks.flights.campaign [--missions 2000] [--seed 0] [--kind "two faults"] [--jobs N]`

Each seed is one mission, and all are a job of a fleet: an interrupted campaign resumes, and a cluster may
fly it (`--engine ray`). Missions judged by another native module are judged again. `--only SEED` shows one,
and keeps its logs in `--keep FOLDER`. `benchmarks/README.md` defines the figures.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import count, islice
from pathlib import Path
from typing import Any, get_args

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.flights.missions import CYCLE, draw
from benchmarks.flights.replay import events_of, replayed
from benchmarks.flights.score import scored
from benchmarks.redundancy_fault import Kind
from benchmarks.redundancy_figures import of_kind, wide_console
from benchmarks.redundancy_judgement import OUTCOMES
from benchmarks.results import Content, machine, save
from benchmarks.seeds import computed, digest_of
from tumble import _core

MISSIONS = 2000
LEAST_KEPT = 200
"""Missions of a campaign whose figures are kept."""
JOBS = max(1, (os.cpu_count() or 2) // 2)
BENCHMARKS = Path(__file__).parent.parent
SIMULATED_BY = (
    *("flights/body", "flights/units", "flights/missions", "flights/replay", "flights/score"),
    *("redundancy_fault", "redundancy_judgement"),
)
FLOWN = Path("out") / "flights"
JUDGED = "benchmarks.flights.campaign:judged"
SETS = {"N = 2": (2,), "N >= 3": (3, 4, 5, 6, 7, 8)}
ROWS: tuple[str, ...] = (*get_args(Kind), "two faults")


def judged(seed: int) -> dict[str, Any]:
    """Flies a mission, replays it, and counts what came of it."""
    mission = draw(seed)
    return scored(mission, replayed(mission))


def chosen(missions: int, first: int, kind: str | None) -> list[int]:
    """Returns so many seeds, from the first on, of missions of a kind, or of all."""
    fitting = (seed for seed in count(first) if kind in (None, CYCLE[seed % len(CYCLE)]))
    return list(islice(fitting, missions))


def judging() -> str:
    """Returns a digest of what missions are simulated, judged and scored by."""
    return digest_of(Path(str(_core.__file__)), *(BENCHMARKS / f"{name}.py" for name in SIMULATED_BY))


def campaign(
    seeds: Sequence[int], folder: Path, console: Console, *, engine: str = "local", jobs: int = JOBS
) -> list[dict[str, Any]]:
    """Flies all missions that the folder has not, and returns all, in order of their seeds."""
    key = judging()
    console.print(f"seeds {seeds[0]} to {seeds[-1]}, judged by {key}, results in {folder}")
    return computed(JUDGED, seeds, folder / key, console, engine=engine, jobs=jobs)


def summary(missions: Sequence[Mapping[str, Any]]) -> Content:
    """Puts the figures of all missions together, by number of units and kind."""
    sets = {}
    for title, units in SETS.items():
        those = [each for each in missions if each["units"] in units]
        faulty = [each for each in those if each["outcome"] is not None]
        ready = [each for each in faulty if each["calibrated"]]
        sets[title] = {
            "kinds": {kind: _of([e for e in ready if e["kind"] == kind]) for kind in ROWS},
            "not calibrated": _of([e for e in faulty if not e["calibrated"]]),
            "all": _of(faulty),
            "health": _health(those),
        }
    return {"missions": len(missions), "sets": sets, "seeds": _seeds(missions)}


def _of(missions: Sequence[Mapping[str, Any]]) -> Content:
    ended = sum(each["on_faulty"] > 0.0 for each in missions)
    return of_kind(missions) | {"on a faulty unit": ended}


def _health(missions: Sequence[Mapping[str, Any]]) -> Content:
    hours = sum(each["health"] for each in missions) / 3600.0
    gaps = [each["missing"] for each in missions]
    return {
        "hours": hours,
        "named": sum(each["faulty_in_health"] for each in missions),
        "named in missions": sum(each["faulty_in_health"] > 0 for each in missions),
        "reasons": dict(_reasons(missions).most_common()),
        "changes": sum(each["changes_in_health"] for each in missions),
        "missing": float(np.sum(gaps)),
        "missing in missions": sum(gap > 0.0 for gap in gaps),
        "misled": sum(each["misled"] for each in missions),
        "owed": sum(each["owed"] for each in missions),
        "recalibrated": sum(each["recalibrated"] for each in missions),
    }


def _reasons(missions: Sequence[Mapping[str, Any]]) -> Counter[str]:
    """Returns how often sound units were reported unhealthy, by the reason."""
    found: Counter[str] = Counter()
    for each in missions:
        found.update(each["reasons_in_health"])
    return found


def _seeds(missions: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Returns the seeds of what did not come out right."""
    found: dict[str, list[str]] = {}
    for each in missions:
        size = "2" if each["units"] == 2 else "3 and more"
        if each["outcome"] not in (None, "right"):
            found.setdefault(f"{each['kind']}, {size} units: {each['outcome']}", []).append(str(each["seed"]))
        elif each["faulty_in_health"]:
            found.setdefault(f"{size} units: named in health", []).append(str(each["seed"]))
    return {name: " ".join(seeds) for name, seeds in sorted(found.items())}


def show(figures: Content, console: Console) -> None:
    """Prints the tables."""
    for title, of in figures["sets"].items():
        table = Table(
            "fault", "n", *OUTCOMES, "s", "95 %", "seen", "95 %", "on faulty", "misled", title=title
        )
        for kind, each in ({**of["kinds"], "not calibrated": of["not calibrated"], "all": of["all"]}).items():
            if each["missions"]:
                table.add_row(kind, *_cells(each))
        console.print(table)
        console.print(of["health"])


def _cells(of: Content) -> Iterator[str]:
    yield str(of["missions"])
    yield from (str(of["outcomes"][name]) for name in OUTCOMES)
    for name in ("isolated", "seen"):
        yield from (f"{of[name][key]:.3g}" if of[name]["number"] else "" for key in ("median", "high"))
    yield from (str(of["on a faulty unit"]), str(of["misled"]))


def show_one(seed: int, folder: Path | None, console: Console) -> None:
    """Flies one mission and prints all of it."""
    mission = draw(seed)
    console.print(mission)
    replay = replayed(mission, folder)
    for time, unit, what, figures in events_of(replay.result):
        console.print(f"{time:9.3f} s  unit {unit}  {what}", figures, highlight=False)
    console.print(dict(Counter(each.event for each in replay.result.events)))
    console.print(scored(mission, replay))


def main(arguments: Sequence[str] | None = None) -> int:
    """Flies the campaign."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--missions", type=int, default=MISSIONS)
    parser.add_argument("--seed", type=int, default=0, help="of the first mission")
    parser.add_argument("--kind", choices=sorted(set(CYCLE)), help="missions with this fault alone")
    parser.add_argument("--only", type=int, metavar="SEED", help="one mission, with all its events")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="of the logs of that mission")
    parser.add_argument("--jobs", type=int, default=JOBS)
    parser.add_argument("--engine", default="local", help="as of tumble fleet run: local, ray or ray:ADDRESS")
    parser.add_argument("--results", type=Path, default=FLOWN)
    options = parser.parse_args(arguments)
    console = wide_console()
    if options.only is not None:
        show_one(options.only, options.keep, console)
        return 0
    seeds = chosen(options.missions, options.seed, options.kind)
    flown = campaign(seeds, options.results, console, engine=options.engine, jobs=options.jobs)
    figures = summary(flown)
    show(figures, console)
    for name, found in figures["seeds"].items():
        console.print(f"{name}: {found}", highlight=False, soft_wrap=True)
    if options.missions >= LEAST_KEPT and options.kind is None:
        save("flight_campaign", {"seed": options.seed, **figures, "machine": machine()})
    return 0


if __name__ == "__main__":
    sys.exit(main())
