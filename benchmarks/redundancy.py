"""The redundancy monitor in figures: fit models, honest sigmas, single precision, cost of a sample, state.

`python -m benchmarks.redundancy [--runs 100] [--no-save]`

Errors after adoptions, and the speed of replays, come from `redundancy_adoptions.py`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
from collections.abc import Sequence
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from rich.console import Console
from rich.progress import track

from benchmarks.redundancy_fit_models import Pair, calibrate, draw_pair
from benchmarks.results import Content, machine, save
from tumble import _core
from tumble.foundation.results import INTERVAL

BASE_SEED = 60_715
RUNS = 100
FIT_MODELS = ("offset", "affine", "affine and lever arm")
DESIGN: dict[float, tuple[float, float, float]] = {
    0.0: (0.031, 0.0007, 0.0007),
    0.02: (0.056, 0.032, 0.0010),
    0.1: (0.18, 0.17, 0.0032),
}
"""m apart: m/s^2 of the design, for each of `FIT_MODELS`."""
HONEST_DISTANCE = 0.1
"""m at which sigmas and single precision are judged."""
ROOT = Path(__file__).parent.parent
PRECISIONS = ("f32", "f64")
MOST_SECONDARIES = 7


def errors_by_fit_model(runs: int, console: Console) -> dict[str, Content]:
    """Returns the root mean square error of each fit model at each distance, and the design's."""
    found: dict[str, Content] = {}
    for number, (distance, design) in enumerate(DESIGN.items()):
        errors: dict[str, list[float]] = {fit_model: [] for fit_model in FIT_MODELS}
        for run in track(range(runs), f"{100 * distance:g} cm apart", console=console):
            pair = draw_pair(np.random.default_rng([BASE_SEED, number, run]), distance)
            for fit_model in FIT_MODELS:
                record = calibrate(pair, fit_model)
                if record is not None:
                    errors[fit_model].append(_left(pair, record))
        found[f"{distance:g}"] = {
            fit_model: {"adopted": len(of), "error": _rms(of), "design": stated}
            for (fit_model, of), stated in zip(errors.items(), design, strict=True)
        }
    return found


def honesty(runs: int, console: Console) -> Content:
    """Returns errors over stated sigmas, coverage of 95 %, and single precision, with the largest model."""
    errors: dict[str, list[float]] = {"bias": [], "matrix": [], "lever arm": []}
    apart: dict[str, list[float]] = {name: [] for name in errors}
    for run in track(range(runs), "sigmas", console=console):
        pair = draw_pair(np.random.default_rng([BASE_SEED, len(DESIGN), run]), HONEST_DISTANCE)
        records = {precision: calibrate(pair, FIT_MODELS[-1], precision) for precision in PRECISIONS}
        single, double = records["f32"], records["f64"]
        if single is None or double is None:
            raise RuntimeError(f"run {run}: a pair that is sound was not adopted")
        truths = (
            ("bias", "bias", pair.bias),
            ("matrix", "matrix", pair.matrix),
            ("lever arm", "lever_arm", pair.arm),
        )
        for name, key, true in truths:
            sigma = np.asarray(double[f"{key}_sigma"])
            errors[name] += list(((np.asarray(double[key]) - true) / sigma).ravel())
            apart[name] += list(((np.asarray(single[key]) - np.asarray(double[key])) / sigma).ravel())
    return {
        name: {
            "rmse_over_sigma": _rms(of),
            "coverage": float(np.mean(np.abs(of) < INTERVAL)),
            "single_precision_sigmas": float(np.max(np.abs(apart[name]))),
        }
        for name, of in errors.items()
    }


def _left(pair: Pair, record: dict[str, object]) -> float:
    matrix, bias, arm = (np.asarray(record[key]) for key in ("matrix", "bias", "lever_arm"))
    return pair.left(matrix, bias, arm)


def _rms(values: Sequence[float]) -> float | None:
    return float(np.sqrt(np.mean(np.square(values)))) if values else None


def push_cost() -> list[Content]:
    """Runs `push_cost.rs`: ns of a push and of a copy of its sample, for each number of secondaries."""
    command = ["cargo", "bench", "--quiet", "--locked", "--package", "tumble-core", "--bench", "push_cost"]
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def state_bytes() -> dict[str, list[int]]:
    """Returns the bytes of a monitor's state with one to seven secondaries."""
    counts = range(1, MOST_SECONDARIES + 1)
    return {
        precision: [_core.RedundancyMonitor.state_bytes(count, precision) for count in counts]
        for precision in PRECISIONS
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Measures, shows and saves."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=RUNS)
    parser.add_argument(
        "--no-save", action="store_true", help="show figures, but leave benchmarks/results alone"
    )
    parser.add_argument("--no-push", action="store_true", help="leave out the cost of a sample: builds Rust")
    options = parser.parse_args(arguments)
    console = Console()
    figures: Content = {
        "runs": options.runs,
        "seed": BASE_SEED,
        "fit_models": errors_by_fit_model(options.runs, console),
        "honesty": honesty(options.runs, console),
        "push": [] if options.no_push else push_cost(),
        "bytes": state_bytes(),
        "machine": machine(),
    }
    console.print(figures)
    if not options.no_save:
        save("redundancy", figures)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
