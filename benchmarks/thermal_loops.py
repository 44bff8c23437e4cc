"""Loops of a bias over temperature: largest and mean difference of warming and cooling, and lags.

`python -m benchmarks.thermal_loops [--sessions 24]`
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
from rich.console import Console

import tumble
from benchmarks.ovens import LOOPS, oven
from benchmarks.results import Content, machine, save
from tumble.foundation.results import INTERVAL, Parameter

BASE_SEED = 27_700
AXIS = "accelerometer z"
LAG = 60.0
"""s."""
WANDERS = (0.15, 0.6)
"""Bias instability over white noise density, 1/sqrt(s)."""
COVERAGE = (0.93, 1.0)
MOST_FALSE_LAGS = 0.05


def against(found: Sequence[Parameter], truth: float) -> Content:
    """Error and coverage of estimates of one truth."""
    errors = np.array([each.value for each in found]) - truth
    sigmas = np.array([each.sigma for each in found])
    return {
        "truth": truth,
        "mean": float(np.mean([each.value for each in found])),
        "error": float(np.sqrt(np.mean(errors**2))),
        "sigma": float(np.sqrt(np.mean(sigmas**2))),
        "coverage": float(np.mean(np.abs(errors) <= INTERVAL * sigmas)),
    }


def loops(shape: str, sessions: int) -> Content:
    """Figures of the loop of one shape, without a lag."""
    results = [tumble.thermal(oven(BASE_SEED + k, shape)) for k in range(sessions)]
    axes = [result[AXIS] for result in results]
    largest, mean = LOOPS[shape]
    return {
        "loop": shape,
        "sessions": sessions,
        "largest": against([axis.hysteresis for axis in axes], largest),
        "mean": against([axis.mean_hysteresis for axis in axes], mean),
        "found": sum(axis.has_hysteresis for axis in axes),
        "lags": sum(result.lag.observable for result in results),
    }


def lags(shape: str, lag: float, sessions: int) -> Content:
    """Share of sessions in which a lag is found beside a loop, and its error there."""
    found = [tumble.thermal(oven(BASE_SEED + k, shape, lag=lag)).lag for k in range(sessions)]
    observable = [each for each in found if each.observable]
    row: Content = {"loop": shape, "lag": lag, "sessions": sessions, "found": len(observable)}
    return row | (against(observable, lag) if observable else {})


def wandering(wander: float, sessions: int) -> Content:
    """Counts lags found where there is none and biases wander."""
    found = [tumble.thermal(oven(BASE_SEED + k, wander=wander)) for k in range(sessions)]
    observable = [each.lag for each in found if each.lag.observable]
    return {
        "wander": wander,
        "sessions": sessions,
        "lags": len(observable),
        "largest": max((abs(lag.value) for lag in observable), default=0.0),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=24, help="simulated sessions of each loop")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    content: Content = {
        "machine": machine(),
        "seeds": [BASE_SEED, BASE_SEED + options.sessions - 1],
        "loops": [loops(shape, options.sessions) for shape in LOOPS],
        "lags": [lags(shape, LAG, options.sessions) for shape in ("none", "lens", "constant")],
        "wandering": [wandering(each, options.sessions) for each in WANDERS],
    }
    console = Console()
    console.print(content)
    if not options.no_save:
        console.print(f"written to {save('thermal_loops', content)}")


if __name__ == "__main__":
    main()
