"""Amount of spinning that is enough: sigma of both biases over turns, speeds, rests and rates.

`python -m benchmarks.spin_enough [--sessions 11]`
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import product
from multiprocessing import get_context

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from rich.console import Console
from rich.progress import track

from benchmarks.results import Content, machine, save
from benchmarks.spin import BASE_SEED, CORES
from benchmarks.spin_bound import GROUPS, bound
from benchmarks.spin_session import Motion, fit, play
from tumble import _core

TURNS = (0.5, 1.0, 2.0, 3.0, 5.0, 10.0)
SPEEDS = (0.2, 0.5, 1.0, 2.0, 3.0)
RESTS = (1.0, 2.0, 5.0, 10.0, 20.0, 60.0)
RATES = (50.0, 100.0, 200.0, 500.0, 1000.0)
DENSITY = (0.002, 0.0002)
"""White noise, m/s^2/sqrt(Hz) and rad/s/sqrt(Hz): the same at every rate."""
USUAL = Motion(turns=(3.0,), tilt=float(np.radians(1.0)))
"""One way at 1 rad/s, 5 s of rest, 100 Hz, a floor that tilts by 1 deg."""

Task = tuple[Motion, int, int]


def motions() -> list[tuple[str, Motion]]:
    """Returns every motion with the series it belongs to."""
    turning = [
        ("turning", replace(USUAL, turns=(turns,), speed=speed)) for turns, speed in product(TURNS, SPEEDS)
    ]
    resting = [("resting", replace(USUAL, rest=rest)) for rest in RESTS]
    sampling = [
        ("sampling", replace(USUAL, rate=rate, speed=speed)) for rate, speed in product(RATES, SPEEDS)
    ]
    return turning + resting + sampling


def sigmas(task: Task) -> Content:
    """Root mean square over the axes of both sigmas, median over the sessions; or why it was refused."""
    motion, number, sessions = task
    stated, least = [], []
    noise = (DENSITY[0] * np.sqrt(motion.rate), DENSITY[1] * np.sqrt(motion.rate))
    for session in range(sessions):
        played = play(motion, np.random.default_rng([BASE_SEED, number, session]), noise)
        try:
            found = fit(played)
        except _core.CoreError as refused:
            return {"refused": str(refused.args[0])}
        limit = bound(played)
        stated.append([_size(found["level_free"]["sigma"]), _size(found["gyroscope_bias"]["sigma"])])
        least.append([_size(limit[GROUPS[f"{name} bias"]]) for name in ("accelerometer", "gyroscope")])
    return {"stated": np.median(stated, axis=0).tolist(), "bound": np.median(least, axis=0).tolist()}


def _size(sigma: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.mean(sigma**2)))


def measure(sessions: int, console: Console) -> list[Content]:
    """Runs all motions."""
    named = motions()
    with ProcessPoolExecutor(CORES, get_context("spawn")) as pool:
        tasks = [(motion, 300 + number, sessions) for number, (_, motion) in enumerate(named)]
        results = track(
            pool.map(sigmas, tasks), "motions", len(tasks), console=console, disable=not console.is_terminal
        )
        return [
            {
                "series": series,
                "turns": motion.turns[0],
                "speed": motion.speed,
                "rest": motion.rest,
                "rate": motion.rate,
            }
            | found
            for (series, motion), found in zip(named, results, strict=True)
        ]


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=11, help="simulated sessions a motion")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console()
    content: Content = {
        "machine": machine(),
        "sessions": options.sessions,
        "motions": measure(options.sessions, console),
    }
    for row in content["motions"]:
        console.print(row)
    if not options.no_save:
        console.print(f"written to {save('spin_enough', content)}")
    return content


if __name__ == "__main__":
    main()
