"""The four truths held against each other, and the bias with and without a reference.

`python -m benchmarks.truths [--sessions 1000]`
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from typing import get_args

# One process a core: threads of the simulator's own would only get in each other's way.
os.environ.setdefault("RAYON_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

import tumble
from benchmarks.bound import parts
from benchmarks.results import Content, machine, save
from benchmarks.settings import design_scenario
from tumble.foundation.recording import FloatArray
from tumble.procedures.turntable.result import TruthSource
from tumble.tools.simulate import TurntableScenario, simulate_turntable

TRUTHS: tuple[TruthSource, ...] = ("ideal", "rotate-measurement", "rotate-truth", "reference")
# Commanded rates are no truth of accelerometers, which poses are compared by here.
assert set(TRUTHS) == set(get_args(TruthSource)) - {"table"}

DESIGN_MRAD = {
    "ideal": (0.080, 1.47),
    "rotate-measurement": (0.54, 1.56),
    "rotate-truth": (0.080, 1.47),
    "reference": (0.081, 0.079),
}
"""Non-orthogonality error that the design states: table repeatable, table errs 0.05 deg a pose."""
PLAIN = "plain"
"""Bias by unweighted least squares of the readings on the ideal poses, in numpy."""
BIASES: dict[str, tuple[str, float | None]] = {
    PLAIN: ("ideal poses, plain least squares", 19e-3),
    "rotate-truth": ("`rotate-truth`: ideal poses, weighted", None),
    "reference": ("`reference`", 0.3e-3),
}
"""Where the target's bias comes from, in words; m/s^2 that the design states for a table erring 0.2 deg."""

MOUNTING_DEG = 1.0
TABLE_ERRORS_DEG = (0.0, 0.05, 0.2)
BASE_SEED = 20_251_000_000
SEEDS_A_COLUMN = 1_000_000
BATCH = 25
CORES = 2


def scenario(table_error_deg: float, seed: int) -> TurntableScenario:
    """Target and reference sit square on one structure, which is turned by 1 deg on the table."""
    return replace(
        design_scenario(),
        seed=seed,
        mounting_angle_deg=MOUNTING_DEG,
        target_mounting_deg=(0.0, 0.0, 0.0),
        table_error_deg=table_error_deg,
    )


def errors(table_error_deg: float, seed: int) -> FloatArray:
    """(5, 3) of one session: norms of the errors of non-orthogonality, rad, bias, m/s^2, and M.

    A row a truth, and one for plain least squares on the ideal poses.
    """
    played = simulate_turntable(scenario(table_error_deg, seed))
    true = played.target_units[0].accelerometer

    def norms(matrix: FloatArray, bias: FloatArray) -> list[float]:
        angles = parts(matrix, bias)[6:9] - true.non_orthogonality
        apart = (angles, bias - true.b - true.drift, (matrix - true.M).ravel())
        return [float(np.linalg.norm(difference)) for difference in apart]

    rows = []
    for truth in TRUTHS:
        target = tumble.turntable(played.reference, played.targets, truth=truth, jobs=1).targets[0]
        if target.accelerometer is None:
            raise RuntimeError(f"truth {truth}, table {table_error_deg} deg, seed {seed}: {target.failure}")
        rows.append(norms(target.accelerometer.M, target.accelerometer.b))
    ups = {pose.name: pose.up for pose in played.scenario.poses}
    ideal = np.array([[*ups[rest.pose] * played.scenario.gravity, 1.0] for rest in target.rests])
    plain = np.linalg.lstsq(ideal, np.array([rest.specific_force for rest in target.rests]))[0].T
    rows.append(norms(plain[:, :3], plain[:, 3]))
    return np.array(rows)


def _batch(table_error_deg: float, seeds: range) -> FloatArray:
    return np.array([errors(table_error_deg, seed) for seed in seeds])


def _root_mean(values: FloatArray) -> Content:
    """Root mean square and its Monte Carlo standard error."""
    squares = values**2
    root = float(np.sqrt(squares.mean()))
    return {"rms": root, "error": float(squares.std(ddof=1) / (2.0 * root * np.sqrt(len(squares))))}


def figures(norms: FloatArray) -> Content:
    """Figures of one column of the table; `norms` is (n, 5, 3)."""
    names = ("non_orthogonality", "bias", "matrix")
    return {
        truth: {name: _root_mean(norms[:, row, column]) for column, name in enumerate(names)}
        for row, truth in enumerate((*TRUTHS, PLAIN))
    }


def tables(content: Content) -> list[Table]:
    """Figures as tables on screen."""
    shown = Table(
        "truth",
        "table repeatable",
        "design",
        "table errs 0.05 deg",
        "design",
        title="non-orthogonality, mrad",
    )
    repeatable, erring = content["columns"]["0"], content["columns"]["0.05"]
    for truth in TRUTHS:
        cells = []
        for column, design in zip((repeatable, erring), DESIGN_MRAD[truth], strict=True):
            found = column[truth]["non_orthogonality"]
            cells += [f"{1e3 * found['rms']:.3f} +- {1e3 * found['error']:.3f}", f"{design:g}"]
        shown.add_row(truth, *cells)
    bias = Table("bias from", "mm/s^2", "design", title="target bias, table errs 0.2 deg")
    for source, (words, stated) in BIASES.items():
        found = content["columns"]["0.2"][source]["bias"]
        shown_design = "" if stated is None else f"{1e3 * stated:g}"
        bias.add_row(words, f"{1e3 * found['rms']:.2f} +- {1e3 * found['error']:.2f}", shown_design)
    return [shown, bias]


def measure(sessions: int, console: Console) -> Content:
    """Runs all sessions."""
    columns: Content = {}
    with ProcessPoolExecutor(CORES, get_context("spawn")) as pool:
        for number, table_error in enumerate(TABLE_ERRORS_DEG):
            first = BASE_SEED + SEEDS_A_COLUMN * number
            batches = [
                range(s, min(s + BATCH, first + sessions)) for s in range(first, first + sessions, BATCH)
            ]
            work = pool.map(_batch, [table_error] * len(batches), batches)
            steps = track(
                work,
                f"table {table_error:g} deg",
                total=len(batches),
                console=console,
                disable=not console.is_terminal,
            )
            columns[f"{table_error:g}"] = figures(np.vstack(list(steps)))
    return columns


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=1000, help="simulated sessions a column")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console()
    console.print(f"{len(TABLE_ERRORS_DEG)} columns of {options.sessions} sessions, seeds from {BASE_SEED}")
    begun = time.perf_counter()
    content: Content = {
        "machine": machine(),
        "sessions": options.sessions,
        "columns": measure(options.sessions, console),
        "seconds": round(time.perf_counter() - begun, 1),
    }
    for shown in tables(content):
        console.print(shown)
    if not options.no_save:
        console.print(f"written to {save('truths', content)}")
    return content


if __name__ == "__main__":
    main()
