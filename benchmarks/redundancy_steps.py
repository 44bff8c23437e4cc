"""Step that a change of source makes in the output, and the parts that it is made of.

`python -m benchmarks.redundancy_steps [--missions 40] [--units 3] [--seconds 1]`

Simulated missions without a fault: at moments in motion, what a calibrated secondary measures beyond the
primary, less that at the rest before, which a trim takes off. Parts are known from the simulation:
drift of biases since that rest; errors of matrix and lever arm in another attitude and motion; noise,
vibration and clocks over the mean. A trim leaves to the primary that which all share across gravity.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.redundancy_draw import MOTION_SECONDS, REST_SECONDS, SETTINGS
from benchmarks.redundancy_replay import edges, reading, replay
from benchmarks.redundancy_set import SENSORS, Body, SimulatedSet, simulate_set
from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName

MISSIONS = 40
DURATION = 260.0
CALIBRATED = 3
"""Motions after which all secondaries are calibrated."""
MOMENTS = 6
"""Moments of each motion."""
PARTS = ("drift since the rest", "matrix and lever arm", "noise, vibration, clocks")
STEPS = ("without trim", "trimmed", "and what all share left")

Record = Mapping[str, object]


def beyond(
    flown: SimulatedSet, number: int, sensor: TriadName, record: Record, span: tuple[float, float]
) -> FloatArray:
    """Returns the parts (3, 3), as `PARTS`, of what a secondary measures beyond the primary in a span."""
    secondary, primary = flown.units[number], flown.units[0]
    kept = slice(*np.searchsorted(flown.body.time, span))
    body = Body(*(getattr(flown.body, each.name)[kept] for each in fields(Body)))
    matrix, bias = np.asarray(record["matrix"]), np.asarray(record["bias"])
    found = record["lever_arm"] if secondary.stated_arm is None else secondary.stated_arm
    carried = np.zeros(3)
    if sensor == "accelerometer" and found is not None:
        carried = body.carried(np.asarray(found)).mean(axis=0)
    said, wanted = (reading(unit, sensor, body).mean(axis=0) for unit in (secondary, primary))
    model = np.linalg.solve(matrix, said - bias) - carried - wanted
    means = []
    for samples in (flown.samples[number], flown.samples[0]):
        true = slice(*np.searchsorted(samples.arrival, span))
        stamped = slice(*np.searchsorted(samples.time, span))
        means.append((samples.drift[sensor][true].mean(axis=0), samples.of(sensor)[stamped].mean(axis=0)))
    (drift, mean), (drift_of_primary, mean_of_primary) = means
    drifted = np.linalg.solve(matrix, drift) - drift_of_primary
    whole = np.linalg.solve(matrix, mean - bias) - carried - mean_of_primary
    return np.array([drifted, model, whole - drifted - model])


def shared(at_rest: Sequence[FloatArray], up: FloatArray, sensor: TriadName) -> FloatArray:
    """Returns what two secondaries or more share at a rest beyond the primary, (3,), across gravity."""
    if sensor == "gyroscope" or len(at_rest) < 2:
        return np.zeros(3)
    mean = np.mean([each.sum(axis=0) for each in at_rest], axis=0)
    return np.asarray(mean - up * (up @ mean))


def steps(seed: int, units: int, seconds: float) -> Iterator[tuple[TriadName, str, float]]:
    """Flies a mission; gives sizes of steps and of their parts, m/s^2 and rad/s, by sensor and name."""
    random = np.random.default_rng([seed, *b"steps"])
    spans, end = [], 0.0
    while end < DURATION:
        start = end + random.uniform(*REST_SECONDS)
        end = start + random.uniform(*MOTION_SECONDS)
        spans.append((start, end))
    flown = simulate_set(random, units, np.array(spans), DURATION, "weak" if seed % 2 else "strong")
    told = [unit.told(number) for number, unit in enumerate(flown.units)]
    monitor = _core.RedundancyMonitor(told, SETTINGS, "f64")
    stored = replay(monitor, flown.samples, edges(DURATION, None)).stored
    for (_, rests), (moves, ends) in zip(spans[CALIBRATED - 1 :], spans[CALIBRATED:], strict=False):
        if ends > DURATION - seconds:
            continue
        rest = (rests + 2.0, moves - 0.3)
        moments = random.uniform(moves + 2.0, ends - 2.0 - seconds, MOMENTS)
        level = flown.body.specific_force[np.searchsorted(flown.body.time, rest[0])]
        for sensor in SENSORS:
            records = {n: stored.at(moves).get((n, sensor)) for n in range(1, units)}
            known = {n: record for n, record in records.items() if record is not None}
            before = {n: beyond(flown, n, sensor, record, rest) for n, record in known.items()}
            left = shared(list(before.values()), level / np.linalg.norm(level), sensor)
            for number, record in known.items():
                for moment in moments:
                    now = beyond(flown, number, sensor, record, (moment, moment + seconds))
                    parts = now - before[number]
                    whole = now.sum(axis=0), parts.sum(axis=0), parts.sum(axis=0) + left
                    named = zip((*PARTS, *STEPS), (*parts, *whole), strict=True)
                    yield from ((sensor, name, float(np.linalg.norm(each))) for name, each in named)


def main(arguments: Sequence[str] | None = None) -> int:
    """Measures and shows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--missions", type=int, default=MISSIONS)
    parser.add_argument("--units", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=1.0, help="over which the output is averaged")
    options = parser.parse_args(arguments)
    console = Console(width=100)
    found: dict[tuple[TriadName, str], list[float]] = defaultdict(list)
    for seed in track(range(options.missions), "missions", console=console):
        for sensor, name, size in steps(seed, options.units, options.seconds):
            found[sensor, name].append(1e3 * size)
    table = Table("step, mean", "accelerometer, mm/s²", "gyroscope, mrad/s")
    for name in (*PARTS, *STEPS):
        table.add_row(name, *(f"{np.mean(found[sensor, name]):.2f}" for sensor in SENSORS))
    console.print(table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
