"""Fleets of 1,000 units whose drift is known: predicted intervals and due dates against what happened.

`python -m benchmarks.drift [--units 1000] [--fleets 4]`
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.drifting_fleets import fleet
from tumble.laboratory.drift import due_time, pooled_walk, probability_below, state_after

COVERAGE = (0.93, 0.97)
"""Share of predicted intervals that are to hold the truth, on average over fleets."""
LIMIT = 8.0
"""In root mean square steps of a year."""
CASES = ((1.0, 0.1, 3), (1.0, 1.0, 5), (0.1, 1.0, 8), (0.01, 1.0, 10))
"""q, sigma of a calibration, and calibrations of a unit."""


def figures(q: float, sigma: float, calibrations: int, units: int, seed: int) -> dict[str, float]:
    """Measure one fleet."""
    made = fleet(units, calibrations, q, sigma, seed)
    walk = pooled_walk(made.series)
    assert walk is not None
    held = within = due_units = 0
    for unit, series in enumerate(made.series):
        state = state_after(series, walk)
        share = probability_below(state, walk, state.time + 2.0, made.later(unit, 2.0))
        held += 0.025 <= share <= 0.975
        limit = LIMIT * max(sigma, np.sqrt(q))
        due = due_time(state, walk, 0.0, limit)
        if due is not None and due > state.time:
            due_units += 1
            within += abs(made.later(unit, due - state.time)) <= limit
    return {
        "q": q, "sigma": sigma, "calibrations": calibrations, "seed": seed, "found": walk.q, "low": walk.low,
        "high": walk.high, "coverage": held / units, "due": due_units,
        "within": within / due_units if due_units else float("nan"),
    }  # fmt: skip


def main() -> int:
    """Measure all fleets and print the figures; 1 if intervals hold too little or too much."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--units", type=int, default=1000)
    parser.add_argument("--fleets", type=int, default=4)
    stated = parser.parse_args()
    rows = [figures(*case, stated.units, seed) for case in CASES for seed in range(stated.fleets)]
    table = Table("q", "sigma", "seed", "q found", "coverage", "due", "within at the due date")
    for row in rows:
        interval = f"{row['found']:.3g} ({row['low']:.3g} to {row['high']:.3g})"
        shares = [f"{100.0 * row[name]:.1f} %" for name in ("coverage", "within")]
        head = (f"{row['q']:g}", f"{row['sigma']:g}", f"{row['seed']:.0f}", interval)
        table.add_row(*head, shares[0], f"{row['due']:.0f}", shares[1])
    Console().print(table)
    size = stated.fleets
    means = [np.mean([row["coverage"] for row in rows[k : k + size]]) for k in range(0, len(rows), size)]
    return int(not all(COVERAGE[0] <= mean <= COVERAGE[1] for mean in means))


if __name__ == "__main__":
    sys.exit(main())
