"""Gyroscopes on a rate table: error against the bound, coverage, and a rate that was not fitted.

`python -m benchmarks.constant_rates [--sessions 24]`

Sessions are made by numpy alone: cubic ramps, stamps of whole milliseconds, a target 2 ms late, the Earth.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.console import Console

import tumble
from benchmarks.rate_tables import Session, Unit, usual
from benchmarks.results import Content, machine, save
from tumble.foundation.recording import FloatArray, Recording
from tumble.foundation.results import INTERVAL

BASE_SEED = 90_000
SAMPLE_RATE = 100.0
PLAN: dict[str, dict[str, Any]] = {
    "30 deg/s, rests before and after": {"rates": (30.0, -30.0)},
    "10 to 200 deg/s without rests between, axis 0.5 deg off": {
        "rates": (10.0, 60.0, 200.0, -200.0, -60.0, -10.0),
        "tilt": np.radians(0.5),
    },
    "10 and 60 deg/s, rests between, axis 0.3 deg off": {
        "rates": (10.0, None, -10.0, None, 60.0, None, -60.0),
        "tilt": np.radians(0.3),
    },
    "30 deg/s, axis 0.1 deg off": {"rates": (30.0, -30.0), "tilt": np.radians(0.1)},
}
LARGEST_RATIO = 1.1
COVERAGE = (0.93, 0.97)
"""Error over the bound, and share of 95 % intervals that hold the truth, to be reached."""
FORETOLD = np.radians(60.0)


def bound(session: Session, unit: Unit) -> FloatArray:
    """(4,) least sigma of an element of M of each column, and of the bias: every sample, the truth known."""
    time = np.arange(int(session.length * SAMPLE_RATE)) / SAMPLE_RATE
    _, rate = session.truth(time)
    rows = np.column_stack([rate, np.ones(len(rate))])
    return np.asarray(unit.rate_noise * np.sqrt(np.diag(np.linalg.inv(rows.T @ rows))))


def plain_fit(reference: Recording, target: Recording, session: Session) -> tuple[FloatArray, FloatArray]:
    """M and b by least squares without weights, on means over the middle of each hold and rest."""
    (seen,), (felt,) = (list(unit.chunks()) for unit in (reference, target))
    means: list[tuple[FloatArray, FloatArray]] = []
    for begun, _, _, knots in session.pieces():
        level = np.flatnonzero((np.diff(knots[:, 1]) == 0.0) & (np.diff(knots[:, 0]) > 3.0))
        for start, end in ((knots[k, 0] + 1.0, knots[k + 1, 0] - 1.0) for k in level):
            inside = (seen.time >= begun + start) & (seen.time < begun + end)
            means.append((seen.gyroscope[inside].mean(axis=0), felt.gyroscope[inside].mean(axis=0)))
    truth = np.array([one for one, _ in means])
    solution = np.linalg.lstsq(
        np.column_stack([truth, np.ones(len(truth))]), np.array([other for _, other in means]), rcond=None
    )[0]
    return solution[:3].T, solution[3]


def predicted(unit: Unit, M: FloatArray, b: FloatArray) -> float:
    """Largest error, deg/s, of what is corrected at 60 deg/s about each axis."""
    rate = FORETOLD * np.eye(3)
    error = (rate @ unit.M.T + unit.b - b) @ np.linalg.inv(M).T - rate
    return float(np.degrees(np.abs(error).max()))


def trial(plan: dict[str, Any], seed: int) -> Content:
    """Plays a session: errors over the bound and their sigmas, at 60 deg/s beside plain least squares."""
    random = np.random.default_rng(seed)
    session, unit = Session(**plan), usual(random)
    best = Unit(b=random.normal(0.0, 1e-4, 3), force_b=random.normal(0.0, 0.01, 3))
    recordings = [session.recorded("reference", best, random), session.recorded("target", unit, random)]
    found = tumble.turntable(recordings[0], recordings[1]).targets[0].gyroscope
    assert found is not None, seed
    errors = np.column_stack([found.M - unit.M, found.b - unit.b])
    covariance = np.diag(found.covariance)
    sigmas = np.sqrt(np.column_stack([covariance[:9].reshape(3, 3), covariance[9:]]))
    return {
        "ratios": (errors / bound(session, unit)).ravel().tolist(),
        "held": (np.abs(errors) <= INTERVAL * sigmas).ravel().tolist(),
        "predicted": predicted(unit, found.M, found.b),
        "plain": predicted(unit, *plain_fit(recordings[0], recordings[1], session)),
    }


def statistics(name: str, sessions: int) -> Content:
    """Returns the figures of one plan."""
    trials = [trial(PLAN[name], BASE_SEED + seed) for seed in range(sessions)]
    return {
        "plan": name,
        "sessions": sessions,
        "ratio": float(np.sqrt(np.mean(np.square([each["ratios"] for each in trials])))),
        "coverage": float(np.mean([each["held"] for each in trials])),
        "predicted": float(np.sqrt(np.mean(np.square([each["predicted"] for each in trials])))),
        "plain": float(np.sqrt(np.mean(np.square([each["plain"] for each in trials])))),
    }


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=24, help="simulated sessions of each plan")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console()
    plans: list[Any] = [statistics(name, options.sessions) for name in PLAN]
    content: Content = {"machine": machine(), "plans": plans}
    console.print(content)
    if not options.no_save:
        console.print(f"written to {save('constant_rates', content)}")
    return content


if __name__ == "__main__":
    main()
