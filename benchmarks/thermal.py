"""Drift over temperature: error against the bound, coverage, and how often the order is right.

`python -m benchmarks.thermal [--sessions 2000]`

A session is one axis that warms from -20 to 70 degC and cools again within an hour, with white noise and
bias instability that the fit is not given. The highest power of each drift is ten sigmas of the bound.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
from rich.console import Console

from benchmarks.noise import covariance_of_means
from benchmarks.results import Content, machine, save
from benchmarks.spin import CORES
from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL

BASE_SEED = 80_000
AXES = 6
LARGEST_RATIO = 1.1
COVERAGE = (0.93, 0.97)
RIGHT = 0.95

RATE_HZ, SECONDS = 2.0, 3600.0
LOW, HIGH, REFERENCE = -20.0, 70.0, 25.0
WHITE, FLICKER = 2e-3, 3e-4
"""N and B, unit/sqrt(Hz) and unit."""
HIGHEST, LOWER = 10.0, 20.0
"""Sigmas of the bound that the highest power of a drift has, and those below it."""
ORDERS = (0, 1, 2, 3)
HYSTERESIS = 5e-4


def session() -> tuple[FloatArray, FloatArray]:
    """Time (n,), s, and temperature (n,), degC."""
    time = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    return time, HIGH - (HIGH - LOW) * np.abs(2.0 * time / SECONDS - 1.0)


def conclusion(order: int, truth: FloatArray, seed: int) -> _core.ThermalFigures:
    """Plays a session of six axes and returns what is found of it."""
    time, temperature = session()
    terms = np.array([0.0, WHITE, FLICKER, 0.0, 0.0])
    noise = _core.StillNoise(seed, np.array([terms] * AXES), RATE_HZ, len(time)).draw(len(time))
    leg = np.where(time < 0.5 * SECONDS, 0.5, -0.5)
    drift = powers(temperature, order) @ truth[:order] + truth[order] * leg
    values = np.ascontiguousarray(noise + drift[:, None])
    recorder = _core.ThermalRecorder()
    recorder.push(time, np.ascontiguousarray(values[:, :3]), np.ascontiguousarray(values[:, 3:]), temperature)
    return recorder.conclude(list(range(AXES)), reference=REFERENCE)


def powers(temperature: FloatArray, order: int) -> FloatArray:
    """(n, order) t, t^2 ..."""
    return np.asarray((temperature - REFERENCE)[:, None] ** np.arange(1, order + 1))


def bound(order: int, found: _core.ThermalFigures) -> FloatArray:
    """(order + 1, order + 1) least covariance of powers and hysteresis, in numpy alone, the noise known."""
    places = np.rint(found["time"] * RATE_HZ).astype(np.int64)
    samples = round(SECONDS * RATE_HZ)
    covariance = covariance_of_means(places[:, 0], places[:, 1] + 1, samples, WHITE**2 * RATE_HZ, FLICKER)
    # The true temperature: that of a lag which is found of noise alone is another.
    sums = np.append(0.0, np.cumsum(session()[1]))
    temperature = (sums[places[:, 1] + 1] - sums[places[:, 0]]) / (places[:, 1] + 1 - places[:, 0])
    columns = np.column_stack([np.ones(len(places)), powers(temperature, order), 0.5 * found["leg"]])
    scale = np.abs(columns).max(axis=0)
    scaled = columns / scale
    inverse = np.linalg.inv(scaled.T @ np.linalg.solve(covariance, scaled))
    return np.asarray((inverse / np.outer(scale, scale))[1:, 1:])


def truth_of(order: int) -> FloatArray:
    """Returns powers so many sigmas of the bound, and hysteresis."""
    none = np.zeros(order + 1)
    sigma = np.sqrt(np.diag(bound(order, conclusion(order, none, BASE_SEED))))
    sizes = np.array([LOWER] * (order - 1) + [HIGHEST]) if order else np.zeros(0)
    return np.append(sizes * sigma[:order], HYSTERESIS)


def trial(task: tuple[int, tuple[float, ...], int]) -> list[Content]:
    """Returns, for each axis of a session: the order chosen, errors over the bound and over their sigma."""
    order, given, seed = task
    truth = np.array(given)
    found = conclusion(order, truth, seed)
    covariance = bound(order, found)
    grid = np.linspace(LOW, HIGH, 31)
    true_curve, at_bound = powers(grid, order) @ truth[:order], powers(grid, order)
    least = np.einsum("nk,kl,nl->n", at_bound, covariance[:order, :order], at_bound)
    rows: list[Content] = []
    for axis in found["axes"]:
        count = len(axis["bias"])
        row: Content = {"order": count}
        curve = powers(grid, count) @ axis["bias"]
        row["curve"] = float(np.sum((curve - true_curve) ** 2))
        row["least"] = float(np.sum(least))
        if count == order:
            assert axis["hysteresis"] is not None
            error = np.append(axis["bias"], axis["hysteresis"]["mean"][0]) - truth
            row["over_bound"] = (error / np.sqrt(np.diag(covariance))).tolist()
            sigma = np.append(np.sqrt(np.diag(axis["covariance"]))[:count], axis["hysteresis"]["mean"][1])
            row["over_sigma"] = (error / sigma).tolist()
        rows.append(row)
    return rows


def statistics(order: int, sessions: int) -> Content:
    """Error against the bound, coverage and orders of one kind of drift."""
    truth = truth_of(order)
    seeds = range(BASE_SEED + 1000 * order, BASE_SEED + 1000 * order + -(-sessions // AXES))
    tasks = [(order, tuple(truth.tolist()), seed) for seed in seeds]
    with ProcessPoolExecutor(CORES, get_context("spawn")) as pool:
        rows = [row for found in pool.map(trial, tasks) for row in found]
    right = [row for row in rows if row["order"] == order]
    over_bound = np.array([row["over_bound"] for row in right])
    over_sigma = np.array([row["over_sigma"] for row in right])
    return {
        "order": order,
        "sessions": len(rows),
        "seeds": [seeds[0], seeds[-1]],
        "right": len(right) / len(rows),
        "orders": [sum(row["order"] == each for row in rows) for each in range(4)],
        "ratio": float(np.sqrt(np.mean(over_bound**2))),
        "coverage": float(np.mean(np.abs(over_sigma) < INTERVAL)),
        "curve_ratio": _ratio(rows),
    }


def _ratio(rows: Sequence[Content]) -> float | None:
    """Root mean square error of the curve over the bound, wrong orders among them."""
    least = sum(row["least"] for row in rows)
    return float(np.sqrt(sum(row["curve"] for row in rows) / least)) if least else None


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=2000, help="simulated sessions, of all orders")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console()
    drifts: list[Any] = [statistics(order, options.sessions // len(ORDERS)) for order in ORDERS]
    content: Content = {"machine": machine(), "drifts": drifts}
    console.print(content)
    if not options.no_save:
        console.print(f"written to {save('thermal', content)}")
    return content


if __name__ == "__main__":
    main()
