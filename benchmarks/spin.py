"""Spins: the floor-tilt table of the design, error against the bound, coverage, single precision, bytes.

`python -m benchmarks.spin [--sessions 1000]`
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from multiprocessing import get_context

# One process a core: threads of the linear algebra's own would only get in each other's way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.results import Content, machine, save
from benchmarks.spin_bound import GROUPS, bound, quantities
from benchmarks.spin_session import Motion, fit, play
from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL

BASE_SEED = 30_000
BATCH = 50
CORES = 2
LARGEST_RATIO = 1.1
COVERAGE = (0.93, 0.97)
LARGEST_DIFFERENCE = 0.01
"""Largest difference of single from double precision, in sigmas."""

DESIGN: dict[float, tuple[float, float]] = {
    0.0: (0.0022, 0.0020),
    0.2: (0.034, 0.0018),
    1.0: (0.17, 0.0017),
    3.0: (0.51, 0.0019),
}
"""Error of the accelerometer bias by tilt of the floor, deg, as in the design: published, level-free."""
DIRECTIONS: dict[str, tuple[float, ...]] = {"both ways": (3.0, -3.0), "one way": (3.0,)}
SPEEDS = {"even": False, "uneven": True}
TILTS = (0.0, 1.0, 3.0)
RATES = (50.0, 200.0)
PRECISION_RATES = (50.0, 100.0, 200.0, 500.0, 1000.0)

Task = tuple[Motion, int, range]


def cells() -> dict[str, Motion]:
    """Returns all motions of the accuracy table by name."""
    return {
        f"{tilt:g} deg, {way}, {speed}, {rate:g} Hz": Motion(
            turns=DIRECTIONS[way], uneven=SPEEDS[speed], rate=rate, tilt=float(np.radians(tilt))
        )
        for tilt, way, speed, rate in product(TILTS, DIRECTIONS, SPEEDS, RATES)
    }


def seeded(number: int, session: int) -> np.random.Generator:
    """Returns the random numbers of a session."""
    return np.random.default_rng([BASE_SEED, number, session])


def estimates(figures: _core.SpinFigures) -> tuple[FloatArray, FloatArray]:
    """Value and sigma of what `spin_bound.quantities` names, (13,) each; NaN where not observed."""
    force, rate = figures["level_free"], figures["gyroscope_bias"]
    roll, pitch, tilt, scale = (figures[name] for name in ("roll", "pitch", "floor_tilt", "heading_scale"))
    value = [*force["value"], *rate["value"], roll[0], pitch[0], tilt[0], *figures["lever_arm"], scale[0]]
    sigma = [
        *force["sigma"],
        *rate["sigma"],
        roll[1],
        pitch[1],
        tilt[1],
        *figures["lever_arm_sigma"],
        scale[1],
    ]
    return np.where(np.isfinite(sigma), value, np.nan), np.where(np.isfinite(sigma), sigma, np.nan)


def tilted(task: Task) -> FloatArray:
    """(sessions, 2) squared norm of the error of the accelerometer bias: published, level-free."""
    motion, number, sessions = task
    squares = []
    for session in sessions:
        played = play(motion, seeded(number, session))
        found, true = fit(played), played.unit.accelerometer_bias
        errors = [found["published"]["value"] - true, found["level_free"]["value"] - true]
        squares.append([float(error @ error) for error in errors])
    return np.array(squares)


def judged(task: Task) -> FloatArray:
    """(sessions, 3, 13) error, sigma as stated, and bound of the quantities."""
    motion, number, sessions = task
    outcomes = []
    for session in sessions:
        played = play(motion, seeded(number, session))
        value, sigma = estimates(fit(played))
        outcomes.append([value - quantities(played.unit), sigma, bound(played)])
    return np.array(outcomes)


def rounded(task: Task) -> FloatArray:
    """(sessions, 13) single less double precision, in sigmas."""
    motion, number, sessions = task
    differences = []
    for session in sessions:
        played = play(motion, seeded(number, session))
        (double, sigma), (single, _) = estimates(fit(played)), estimates(fit(played, "f32"))
        differences.append(np.abs(single - double) / sigma)
    return np.array(differences)


def over_all(
    pool: ProcessPoolExecutor, work: Callable[[Task], FloatArray], motion: Motion, number: int, sessions: int
) -> FloatArray:
    """Runs all sessions of a cell, in batches, in the order of the seeds."""
    starts = range(0, sessions, BATCH)
    tasks = [(motion, number, range(start, min(start + BATCH, sessions))) for start in starts]
    return np.concatenate(list(pool.map(work, tasks)))


def grouped(outcomes: FloatArray) -> Content:
    """Ratio and coverage of each group that the data show."""
    figures: Content = {}
    for group, columns in GROUPS.items():
        error, sigma, least = (outcomes[:, k, columns] for k in range(3))
        # On a level floor a tilt of zero has no sigma, and little or nothing shows the scale.
        used = np.isfinite(error).all(axis=1) & np.isfinite(least).all(axis=1)
        if used.sum() < 2:
            continue
        shares = ((error / least) ** 2)[used].mean(axis=1)
        inside = (np.abs(error) <= INTERVAL * sigma)[used].mean(axis=1)
        ratio = float(np.sqrt(shares.mean()))
        figures[group] = {
            "sessions": int(used.sum()),
            "rmse": float(np.sqrt((error[used] ** 2).mean())),
            "bound": float(np.sqrt((least[used] ** 2).mean())),
            "ratio": ratio,
            "ratio_error": float(shares.std(ddof=1) / (2.0 * ratio * np.sqrt(len(shares)))),
            "coverage": float(inside.mean()),
            "coverage_error": float(inside.std(ddof=1) / np.sqrt(len(inside))),
            "stated": float(np.sqrt(((sigma / least) ** 2)[used].mean())),
        }
    return figures


def measure(sessions: int, console: Console) -> Content:
    """Runs everything."""
    with ProcessPoolExecutor(CORES, get_context("spawn")) as pool:
        tilts: Content = {}
        for number, tilt in enumerate(DESIGN):
            motion = Motion(tilt=float(np.radians(tilt)))
            published, level_free = np.sqrt(over_all(pool, tilted, motion, number, sessions).mean(axis=0))
            tilts[f"{tilt:g}"] = {"published": float(published), "level_free": float(level_free)}
        console.print(tilts)
        rows: list[Content] = []
        everything = []
        for number, (name, motion) in enumerate(cells().items(), start=100):
            outcomes = over_all(pool, judged, motion, number, sessions)
            everything.append(outcomes)
            rows.append({"cell": number, "name": name, "figures": grouped(outcomes)})
            console.print(table(rows[-1]["figures"], name))
        precision: Content = {}
        for number, rate in enumerate(PRECISION_RATES, start=200):
            motion = Motion(rate=rate, tilt=float(np.radians(1.0)))
            differences = over_all(pool, rounded, motion, number, max(2, sessions // 10))
            precision[f"{rate:g}"] = {
                group: float(np.nanmax(differences[:, columns])) for group, columns in GROUPS.items()
            }
        console.print(precision)
    return {
        "tilts": tilts,
        "cells": rows,
        "pooled": grouped(np.concatenate(everything)),
        "precision": precision,
        "precision_sessions": max(2, sessions // 10),
        "bytes": {precision: _core.SpinMachine.state_bytes(precision) for precision in ("f32", "f64")},
    }


def table(figures: Content, title: str) -> Table:
    """Figures of one cell as a table on screen."""
    shown = Table("group", "RMSE / bound", "95 % covers", "stated / bound", title=title)
    for group, of in figures.items():
        shown.add_row(
            group,
            _marked(f"{of['ratio']:.3f} +- {of['ratio_error']:.3f}", of["ratio"] <= LARGEST_RATIO),
            _marked(f"{100 * of['coverage']:.1f} %", COVERAGE[0] <= of["coverage"] <= COVERAGE[1]),
            f"{of['stated']:.2f}",
        )
    return shown


def _marked(text: str, good: bool) -> str:
    return text if good else f"[bold red]{text}[/]"


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=1000, help="simulated sessions a cell")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console()
    console.print(f"{len(cells())} cells of {options.sessions} sessions, seeds from {BASE_SEED}")
    begun = time.perf_counter()
    found = measure(options.sessions, console)
    seconds = round(time.perf_counter() - begun, 1)
    content: Content = {"machine": machine(), "sessions": options.sessions, "seconds": seconds} | found
    console.print(table(content["pooled"], "all cells"))
    if not options.no_save:
        console.print(f"written to {save('spin', content)}")
    return content


if __name__ == "__main__":
    main()
