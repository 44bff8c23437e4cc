"""A campaign of simulated missions with faults: which unit is named, how soon, and the error until then.

`python -m benchmarks.redundancy_campaign [--missions 2000] [--kinds ramp,jump] [--units 2,3] [--jobs N]`

`--aiding` flies them beside a velocity of 5 Hz and 0.3 m/s.

Missions have successive seeds, and a seed is one mission whatever else is flown: `--only SEED` flies it
alone and prints its events. Figures of a whole campaign are saved; `benchmarks/README.md` defines
them.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict
from itertools import count, islice
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from rich.console import Console

from benchmarks.redundancy_draw import UNITS, DrawnMission, draw, kinds
from benchmarks.redundancy_figures import SETS, by_kind, of_health, of_kind, show, wide_console
from benchmarks.redundancy_judgement import judge
from benchmarks.redundancy_replay import MISLED, Replay, error_of, flown, gathered, source_of
from benchmarks.redundancy_set import SENSORS, Samples, SimulatedSet
from benchmarks.results import Content, machine, save
from benchmarks.seeds import computed, digest_of
from tumble import _core

MISSIONS = 2000
JUDGED = "benchmarks.redundancy_campaign:judged"
FLOWN = Path("out") / "campaigns"
"""Folder of missions that were flown, by the judge and the simulator that they were flown with."""
SIMULATED_BY = tuple(sorted(Path(__file__).parent.glob("redundancy_*.py")))
NUMBERS = tuple(str(number) for number in sorted(set(UNITS)))
"""Numbers of units that `--units` accepts."""
AIDED = 300, ("ramp",)
"""Least missions, and kinds, whose figures beside an aiding measurement are kept."""
JOBS = max(1, (os.cpu_count() or 2) // 2)
WORSE = {"accelerometer": 0.03, "gyroscope": 0.003}
WORSE_SHARE = 1.1
CUT = ("dead", "late", "not a number")
"""Kinds that add nothing to the output, but leave it without samples, or with old ones."""


def judged(seed: int, *, with_aiding: bool = False) -> dict[str, Any]:
    """Flies a mission and counts what came of it."""
    mission = draw(seed)
    return counted(mission, *flown(mission, with_aiding=with_aiding))


def counted(
    mission: DrawnMission, simulated: SimulatedSet, said: Sequence[Samples], replayed: Replay
) -> dict[str, Any]:
    """Counts what came of a mission."""
    fault = mission.fault
    judgement = judge(
        replayed.events, None if fault is None else mission.faulty, mission.onset, mission.duration
    )
    return {
        "seed": mission.seed,
        "kind": mission.kind,
        "units": mission.units,
        "faulty": mission.faulty,
        "sensor": fault.sensor if fault else None,
        "size": fault.size if fault else None,
        "vibration": mission.vibration,
        "calibrated": _is_calibrated(mission, replayed),
        **asdict(judgement),
        **_gathered(mission, simulated, said, replayed),
        **_adoptions(mission, simulated, replayed),
    }


def _is_calibrated(mission: DrawnMission, replayed: Replay) -> bool:
    """Returns whether all was calibrated that can be; a wrong sign from the start cannot."""
    stored = replayed.stored.at(max(mission.onset, 1e-9))
    if mission.kind == "wrong sign":
        return True
    return all((number, name) in stored for number in range(1, mission.units) for name in SENSORS)


def _gathered(
    mission: DrawnMission, simulated: SimulatedSet, said: Sequence[Samples], replayed: Replay
) -> dict[str, float | None]:
    number = mission.faulty
    spans = source_of(replayed.events, number, mission.onset, mission.duration)
    if mission.fault is None or mission.kind in CUT or not spans:
        return {"velocity": None, "angle": None}
    unit = simulated.units[number]
    found = gathered(simulated.samples[number], said[number], unit, simulated.body, spans)
    return {"velocity": found["accelerometer"], "angle": float(np.degrees(found["gyroscope"]))}


def _adoptions(mission: DrawnMission, simulated: SimulatedSet, replayed: Replay) -> Content:
    """Counts what was adopted and refused while all were sound, and who was misled since."""
    found = {"adopted": 0, "wrongly adopted": 0, "refused that were right": 0, "misled": 0}
    start = mission.onset if mission.fault is None else mission.fault.start
    misled = set()
    for time, number, what, figures in replayed.events:
        if what not in ("adopted", "refused") or (number == mission.faulty and time >= start):
            continue
        name = figures["sensor"]
        before, after = (
            error_of(
                replayed.stored.at(moment).get((number, name)),
                simulated.units[number],
                simulated.units[0],
                name,
                simulated.body,
                time,
            )
            for moment in (min(time, start), np.nextafter(time, np.inf))
        )
        sound = time < start or mission.faulty != 0
        if what == "refused":
            found["refused that were right"] += sound and before > MISLED[name]
        elif sound:
            found["adopted"] += 1
            found["wrongly adopted"] += after > WORSE_SHARE * before and after - before > WORSE[name]
        elif after - before > MISLED[name]:
            misled.add(number)
    return found | {"misled": len(misled)}


def chosen(missions: int, first: int, wanted: Collection[str], units: Collection[int]) -> list[int]:
    """Returns the seeds, from the first on, of so many missions of these kinds and numbers of units."""
    drawn = map(draw, count(first))
    fitting = (each.seed for each in drawn if each.kind in wanted and each.units in units)
    return list(islice(fitting, missions))


def campaign(
    seeds: Sequence[int],
    console: Console,
    function: str = JUDGED,
    *,
    with_aiding: bool = False,
    engine: str = "local",
    jobs: int = JOBS,
) -> list[dict[str, Any]]:
    """Flies all missions that this judge has not flown yet, and returns all, in order of their seeds."""
    options = {"with_aiding": True} if with_aiding else {}
    name = function.partition(":")[0] + (".aided" if with_aiding else "")
    folder = FLOWN / digest_of(Path(str(_core.__file__)), *SIMULATED_BY) / name
    return computed(function, seeds, folder, console, options=options, engine=engine, jobs=jobs)


def summary(missions: Sequence[Mapping[str, Any]]) -> Content:
    """Puts the figures of all missions together, by number of units and kind."""
    sets = {}
    for title, units in SETS.items():
        those = [each for each in missions if each["units"] in units]
        sets[title] = {
            **by_kind([each for each in those if each["calibrated"]]),
            "not calibrated": of_kind([e for e in those if not e["calibrated"] and e["outcome"] is not None]),
            "health": of_health(those),
        }
    return {"missions": len(missions), "sets": sets, "seeds": seeds_of(missions)}


def seeds_of(missions: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Returns the seeds of what did not come out right, for whoever flies them again."""
    found: dict[str, list[str]] = defaultdict(list)
    for each in missions:
        if each["outcome"] not in (None, "right"):
            found[f"{each['kind']}, {each['units']} units: {each['outcome']}"].append(str(each["seed"]))
        elif each["faulty_in_health"]:
            found[f"{each['units']} units: named in health"].append(str(each["seed"]))
    return {name: " ".join(seeds) for name, seeds in sorted(found.items())}


def show_one(seed: int, console: Console, *, with_aiding: bool) -> None:
    """Flies one mission and prints all of it."""
    mission = draw(seed)
    console.print(mission)
    simulated, said, replayed = flown(mission, with_aiding=with_aiding)
    for time, unit, what, figures in replayed.events:
        console.print(f"{time:9.3f} s  unit {unit}  {what}", dict(figures), highlight=False)
    console.print(counted(mission, simulated, said, replayed))


def main(arguments: Sequence[str] | None = None) -> int:
    """Flies the campaign."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--missions", type=int, default=MISSIONS)
    parser.add_argument("--seed", type=int, default=0, help="of the first mission")
    parser.add_argument("--only", type=int, metavar="SEED", help="one mission, with all its events")
    parser.add_argument("--kinds", type=_some_of(kinds()), default=kinds(), help=", ".join(kinds()))
    parser.add_argument("--units", type=_some_of(NUMBERS), default=NUMBERS, help=", ".join(NUMBERS))
    parser.add_argument("--jobs", type=int, default=JOBS)
    parser.add_argument("--engine", default="local", help="as of tumble fleet run: local, ray or ray:ADDRESS")
    parser.add_argument("--aiding", action="store_true", help="with a velocity of 5 Hz and 0.3 m/s")
    parser.add_argument("--list", action="store_true", help="seeds of what did not come out right")
    options = parser.parse_args(arguments)
    console = wide_console()
    if options.only is not None:
        show_one(options.only, console, with_aiding=options.aiding)
        return 0
    seeds = chosen(options.missions, options.seed, options.kinds, tuple(map(int, options.units)))
    missions = campaign(seeds, console, with_aiding=options.aiding, engine=options.engine, jobs=options.jobs)
    figures = summary(missions)
    show(figures, console)
    if options.list:
        for name, seeds in figures["seeds"].items():
            console.print(f"{name}: {seeds}", highlight=False, soft_wrap=True)
    name = "redundancy_campaign_aiding" if options.aiding else "redundancy_campaign"
    least, wanted = AIDED if options.aiding else (MISSIONS, kinds())
    if options.missions >= least and (options.kinds, options.units) == (wanted, NUMBERS):
        save(name, {"seed": options.seed, **figures, "machine": machine()})
    return 0


def _some_of(known: tuple[str, ...]) -> Callable[[str], tuple[str, ...]]:
    """Reads words with commas between them."""

    def read(text: str) -> tuple[str, ...]:
        words = tuple(each.strip() for each in text.split(","))
        for word in words:
            if word not in known:
                raise argparse.ArgumentTypeError(f"{word!r} is none of {', '.join(known)}")
        return words

    return read


if __name__ == "__main__":
    sys.exit(main())
