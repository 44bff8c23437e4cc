"""Simulated missions through the present monitor and through the model, in one run.

`python -m benchmarks.flights.compared [--missions 40] [--seed 0]`

Missions are those of `benchmarks.flights.campaign` with no unit slower than `LEAST_RATE`.
`benchmarks/README.md` defines the outcomes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from itertools import count, islice
from typing import Any

from rich.progress import track
from rich.table import Table

from benchmarks.flights.missions import Flight, Mission, draw
from benchmarks.flights.model.error import STORED, Errors
from benchmarks.flights.model.monitor import Flown, flown
from benchmarks.flights.model.statement import Statement
from benchmarks.flights.replay import replayed
from benchmarks.flights.score import judged, scored, tells_of_stall
from benchmarks.redundancy_figures import wide_console
from benchmarks.redundancy_judgement import OUTCOMES, judge

MISSIONS = 40
LEAST_RATE = 50.0
"""Hz: windows of the model are for units that sample as fast."""
MONITORS = ("today", "model")


def fitting(first: int) -> Iterator[Mission]:
    """Returns missions from a seed on whose units are fast enough."""
    return (mission for seed in count(first) if min((mission := draw(seed)).rates_hz) >= LEAST_RATE)


def compared(mission: Mission) -> list[dict[str, Any]]:
    """Flies a mission with both monitors: a row of each."""
    replay = replayed(mission)
    row = scored(mission, replay)
    common = {"seed": mission.seed, "kind": mission.kind, "units": len(mission.rates_hz)}
    today = {"outcome": row["outcome"], "after": row["isolated"], "false": row["faulty_in_health"]}
    before, known, named = replay.before, None, 0
    if before is not None:
        first = _flown(before[0], None)
        known = first.errors.aged(STORED)
        named = judge(first.events, None, 0.0, float(before[0].body.time[-1])).faulty_in_health
    events = [each for each in _flown(replay.flight, known).events if not tells_of_stall(replay.flight, each)]
    judgement = judged(mission, events)
    model = {
        "outcome": judgement.outcome,
        "after": judgement.isolated,
        "false": judgement.faulty_in_health + named,
    }
    return [common | {"monitor": "today"} | today, common | {"monitor": "model"} | model]


def _flown(flight: Flight, known: Errors | None) -> Flown:
    statements = [
        Statement(
            unit.turn,
            unit.stated_arm,
            unit.triads["accelerometer"].range,
            unit.triads["gyroscope"].range,
        )
        for unit in flight.units
    ]
    return flown([list(flight.recorded)], known, statements=statements)[0]


def main(arguments: Sequence[str] | None = None) -> int:
    """Flies the missions and prints outcomes by number of units and kind of fault."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--missions", type=int, default=MISSIONS)
    parser.add_argument("--seed", type=int, default=0, help="of the first mission")
    options = parser.parse_args(arguments)
    console = wide_console()
    rows = []
    for mission in track(list(islice(fitting(options.seed), options.missions)), "missions", console=console):
        rows += compared(mission)
        console.print(rows[-2:], highlight=False)
    table = Table("units", "monitor", *OUTCOMES, "named in health")
    for title, those in (
        ("2", [row for row in rows if row["units"] == 2]),
        ("3 and more", [row for row in rows if row["units"] > 2]),
    ):
        for monitor in MONITORS:
            mine = [row for row in those if row["monitor"] == monitor]
            outcomes = (str(sum(row["outcome"] == name for row in mine)) for name in OUTCOMES)
            table.add_row(title, monitor, *outcomes, str(sum(row["false"] for row in mine)))
    console.print(table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
