"""Flown missions in which the clock of one unit of three or more drifts, and nothing else is wrong.

`python -m benchmarks.flights.clocks [--missions 64] [--seed 0]`

Each seed is a mission of `benchmarks.flights.missions` without a fault, whose samples of one unit are
stamped by a clock that is fast or slow by 30 to 300 ppm.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import count, islice, pairwise
from typing import Any

import numpy as np
from rich.progress import track

from benchmarks.flights.missions import CYCLE, Flight, Mission, draw
from benchmarks.flights.replay import events_of, replayed
from benchmarks.redundancy_figures import wide_console
from benchmarks.results import Content, machine, save

MISSIONS = 64
FEWEST = 3
"""Units among which the faulty clock can be isolated."""
PPM = (30.0, 300.0)
SPANS_PPM = (30.0, 100.0, 300.0)
SOUND_NAMED = "a sound unit named"


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftingClock(Mission):
    """A mission in which one clock drifts from its start on."""

    unit: int
    ppm: float
    """Excess of its pace."""

    def fly(self) -> tuple[Flight | None, Flight]:
        """Simulates the flight before, where there is one, and the flight with that clock."""
        before, flight = Mission.fly(self)
        recorded = list(flight.recorded)
        samples = recorded[self.unit]
        recorded[self.unit] = replace(samples, time=samples.time * (1.0 + 1e-6 * self.ppm))
        return before, replace(flight, recorded=tuple(recorded))


def drawn(seed: int) -> DriftingClock:
    """Draws a mission; the same for the same seed."""
    mission = draw(seed)
    random = np.random.default_rng([seed, 5])
    ppm = float(np.exp(random.uniform(*np.log(PPM))) * random.choice([-1.0, 1.0]))
    unit = int(random.integers(len(mission.rates_hz)))
    return DriftingClock(
        **{name: getattr(mission, name) for name in Mission.__dataclass_fields__}, unit=unit, ppm=ppm
    )


def seeds(missions: int, first: int) -> list[int]:
    """Returns so many seeds of faultless missions of three and more units, from the first on."""
    fitting = (
        seed
        for seed in count(first)
        if CYCLE[seed % len(CYCLE)] == "none" and len(draw(seed).rates_hz) >= FEWEST
    )
    return list(islice(fitting, missions))


def flown(seed: int) -> Content:
    """Flies a mission, and returns what was reported of which unit."""
    mission = drawn(seed)
    named = []
    for time, unit, what, figures in events_of(replayed(mission).result):
        if what == "unhealthy":
            named.append({"time": time, "unit": unit, "reason": figures["reason"]})
    return {
        "seed": seed,
        "units": len(mission.rates_hz),
        "unit": mission.unit,
        "ppm": mission.ppm,
        "rate": min(mission.rates_hz),
        "vibration": float(max(np.max(line.size[0]) for line in mission.shaking.lines)),
        "outcome": outcome(mission.unit, named),
        "after": next((e["time"] for e in named if e["unit"] == mission.unit), None),
        "named": named,
    }


def outcome(unit: int, named: Sequence[dict[str, Any]]) -> str:
    """Returns what became of the unit with the faulty clock: that of its first fault, if any."""
    of_clock = [each for each in named if each["reason"] != "late"]
    if any(each["unit"] != unit for each in of_clock):
        return SOUND_NAMED
    return next((each["reason"] for each in of_clock), "nothing")


def summary(missions: Sequence[Content], first: int) -> Content:
    """Counts what was reported, by the pace of the clock."""
    spans = {}
    for low, high in pairwise(SPANS_PPM):
        those = [each for each in missions if low <= abs(each["ppm"]) < high]
        spans[f"{low:.0f} to {high:.0f} ppm"] = {
            "missions": len(those),
            "outcomes": dict(Counter(each["outcome"] for each in those).most_common()),
            "seeds": [each["seed"] for each in those if each["outcome"] == SOUND_NAMED],
        }
    return {"missions": len(missions), "seed": first, "spans": spans}


def main(arguments: Sequence[str] | None = None) -> int:
    """Flies the missions and prints what was reported."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--missions", type=int, default=MISSIONS)
    parser.add_argument("--seed", type=int, default=0, help="of the first mission")
    options = parser.parse_args(arguments)
    console = wide_console()
    found = [flown(seed) for seed in track(seeds(options.missions, options.seed), console=console)]
    for each in found:
        console.print({name: value for name, value in each.items() if name != "named"}, highlight=False)
        console.print("   ", each["named"], highlight=False)
    figures = summary(found, options.seed)
    console.print(figures)
    if options.missions >= MISSIONS:
        save("flight_clocks", {**figures, "machine": machine()})
    return 0


if __name__ == "__main__":
    sys.exit(main())
