"""Two calibrations of one unit, by hand: how often they are reported to differ, and changes found.

`python -m benchmarks.compare [--pairs 400]`

A pair is two simulated multi-pose sessions of one unit, each with noise of its own; a change is one of the
unit between them, in sigmas of the difference.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("RAYON_NUM_THREADS", "1")

import numpy as np
from rich.console import Console

import tumble
from benchmarks.results import Content, machine, save
from benchmarks.spin import CORES
from tumble.calibration.document import Calibration
from tumble.foundation.recording import FloatArray, Recording
from tumble.tools.compare.result import LEVEL, Pair
from tumble.tools.simulate import SimulatedMultipose

BASE_SEED = 90_000
COVERAGE = (0.93, 0.97)
FOUND = 0.95
"""Share of changes of `LARGE` sigmas that are to be found."""
CHANGES = (0.0, 3.0, 5.0, 8.0)
"""Changes of one bias, in sigmas of its difference."""
LARGE = 8.0
_QUIET: dict[str, Any] = {
    "bias_instability": False,
    "g_sensitivity": False,
    "quantisation": False,
    "latitude_deg": 48.0,
}


def session(seed: int) -> SimulatedMultipose:
    """Plays a session with white noise alone, on an Earth that turns, as sigmas of multi-pose allow for."""
    return tumble.simulate_multipose(seed=seed, **_QUIET)


def session_of(unit: SimulatedMultipose, seed: int, shift: FloatArray | None = None) -> Recording:
    """Returns what a unit would have recorded in another session, its bias moved by `shift` (3,), m/s^2."""
    other = session(seed)
    chunk, read = other.unit.samples, []
    for triad in ("accelerometer", "gyroscope"):
        ours, theirs = getattr(unit.unit, triad), getattr(other.unit, triad)
        felt = np.linalg.solve(theirs.M, (getattr(chunk, triad) - theirs.b).T).T
        read.append(felt @ ours.M.T + ours.b)
    if shift is not None:
        read[0] = read[0] + shift
    return Recording.from_arrays("again", chunk.time, *read)


def calibrated(recording: Recording) -> Calibration:
    """Calibrates a session."""
    return tumble.multipose(recording).calibration


def trial(seed: int) -> list[tuple[float, float, int, str]]:
    """Returns, for each change: probability, statistic, its degrees of freedom, and what differs most."""
    unit = session(seed)
    first = calibrated(unit.recording)
    assert first.accelerometer is not None
    assert first.accelerometer.covariance is not None
    sigma = np.sqrt(2.0 * first.accelerometer.covariance[9, 9])
    found: list[Pair] = []
    for change in CHANGES:
        shift = change * sigma * np.array([1.0, 0.0, 0.0])
        second = calibrated(session_of(unit, seed + BASE_SEED, shift))
        found.append(tumble.compare([first, second]).pairs[0])
    return [
        (each.probability, each.joint.statistic, each.joint.degrees_of_freedom, each.farthest.name)
        for each in found
        if each.joint is not None and each.farthest is not None
    ]


def statistics(pairs: int) -> Content:
    """Returns the share of pairs reported to differ, for each change, and the mean statistic without one."""
    seeds = range(BASE_SEED, BASE_SEED + pairs)
    with ProcessPoolExecutor(CORES, get_context("spawn")) as pool:
        rows = list(pool.map(trial, seeds, chunksize=4))
    freedom = rows[0][0][2]
    unchanged = [row[0] for row in rows]
    return {
        "pairs": pairs,
        "seeds": [seeds[0], seeds[-1]],
        "degrees_of_freedom": freedom,
        "statistic": float(np.mean([each[1] for each in unchanged])),
        "same": float(np.mean([each[0] >= LEVEL for each in unchanged])),
        "found": {
            f"{change:g}": {
                "share": float(np.mean([row[k][0] < LEVEL for row in rows])),
                "named": float(np.mean([row[k][3] == "accelerometer bias x" for row in rows])),
            }
            for k, change in enumerate(CHANGES)
            if change
        },
    }


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=400, help="simulated pairs of sessions")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console()
    content: Content = {"machine": machine(), **statistics(options.pairs)}
    console.print(content)
    if not options.no_save:
        console.print(f"written to {save('compare', content)}")
    return content


if __name__ == "__main__":
    main()
