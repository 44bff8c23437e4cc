"""Live spins: whether chi-square is its degrees of freedom on average, and intervals hold as often as stated.

`python -m benchmarks.spin_live [--sessions 400]`

The simulation is that of the README's robot on a floor of 2 deg, whose noise has bias instability unknown
to the procedure. The same sessions are then solved as logs.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

# One process a core: threads of the linear algebra's own would only get in each other's way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from rich.console import Console

from benchmarks.results import Content, machine, save
from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.results import INTERVAL
from tumble.live import LiveChunk, PolledSource
from tumble.procedures.spin.live import LiveSpin
from tumble.procedures.spin.procedure import spin
from tumble.procedures.spin.result import Spin
from tumble.tools.simulate import SimulatedSpin, Step, simulate_spin

SESSIONS = 400
BASE_SEED = 1
CORES = 2
PIECE = 50
"""Samples that come together."""
FLOOR_TILT = 2.0
"""deg."""
PLAN = (Step("rest", 6.0), Step("turn", turns=3.0), Step("turn", turns=-3.0), Step("rest", 2.0))
"""Plan of the steps, as in `tumble simulate spin`; a live spin is done after two of the turns."""
LARGEST_REDUCED = 0.03
"""By which the mean of chi-square over its degrees of freedom may differ from one."""
COVERAGE = (0.93, 0.97)
WAYS = ("live", "log")


class Fed(PolledSource):
    """A live source of samples that are there already."""

    name = "robot"
    remarks: tuple[str, ...] = ()
    gyroscope_unit_is_assumed = False

    def __init__(self, samples: Chunk) -> None:
        self._samples = samples
        self._read = 0

    def __enter__(self) -> Fed:
        return self

    def __exit__(self, *error: object) -> None: ...

    def fileno(self) -> None: ...

    def wait(self, longest: float) -> None: ...

    def read(self) -> LiveChunk:
        samples, part = self._samples, slice(self._read, self._read + PIECE)
        if self._read >= len(samples):
            raise EOFError
        self._read += PIECE
        return LiveChunk(samples.time[part], samples.accelerometer[part], samples.gyroscope[part])


def simulated(seed: int) -> SimulatedSpin:
    """Plays one session."""
    return simulate_spin(seed=seed, plan=PLAN, floor_tilt_deg=FLOOR_TILT)


def live(session: SimulatedSpin) -> Spin:
    """Solves a session as it comes."""
    with Fed(session.samples) as source:
        procedure = LiveSpin(source)
        for _ in procedure.steps():
            pass
    return procedure.result().spins[0]


def judged(spin: Spin, session: SimulatedSpin) -> FloatArray:
    """(8,) chi-square, its degrees of freedom, and errors of accelerometer and gyroscope bias in sigmas."""
    pairs = (
        (spin.accelerometer_bias, session.accelerometer_bias),
        (spin.gyroscope_bias, session.gyroscope_bias),
    )
    errors = [(found.value - true) / found.sigma for found, true in pairs]
    return np.concatenate([[spin.chi_square, spin.degrees_of_freedom], *errors])


def both_ways(seed: int) -> FloatArray:
    """(2, 8) of one session, live and as a log."""
    session = simulated(seed)
    return np.array([judged(live(session), session), judged(spin(session.recording).spins[0], session)])


def figures(outcomes: FloatArray) -> Content:
    """Statistics of (n, 8)."""
    reduced = outcomes[:, 0] / outcomes[:, 1]
    inside = np.abs(outcomes[:, 2:]) <= INTERVAL
    return {
        "reduced_chi_square": float(reduced.mean()),
        "reduced_chi_square_error": float(reduced.std(ddof=1) / np.sqrt(len(reduced))),
        "coverage": {
            "accelerometer bias": float(inside[:, :3].mean()),
            "gyroscope bias": float(inside[:, 3:].mean()),
        },
    }


def measure(sessions: int) -> Content:
    """Runs everything."""
    seeds = range(BASE_SEED, BASE_SEED + sessions)
    with ProcessPoolExecutor(CORES, get_context("spawn")) as pool:
        outcomes = np.array(list(pool.map(both_ways, seeds, chunksize=20)))
    return {way: figures(outcomes[:, k]) for k, way in enumerate(WAYS)}


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=SESSIONS, help="simulated sessions")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    begun = time.perf_counter()
    found = measure(options.sessions)
    seconds = round(time.perf_counter() - begun, 1)
    content: Content = {"machine": machine(), "sessions": options.sessions, "seconds": seconds} | found
    console = Console()
    console.print(content)
    if not options.no_save:
        console.print(f"written to {save('spin_live', content)}")
    return content


if __name__ == "__main__":
    main()
