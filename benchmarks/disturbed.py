"""Sigmas of a turntable calibration: samples are missing, the table shakes or is bumped, biases drift.

`python -m benchmarks.disturbed [--sessions 200]`
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from rich.console import Console
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

import tumble
from benchmarks.bound import GROUPS, parts
from benchmarks.results import Content, machine, save
from benchmarks.settings import design_scenario
from tumble.foundation.recording import FloatArray, Recording
from tumble.foundation.results import TriadResult
from tumble.tools.simulate import (
    SimulatedTurntable,
    SimulatedUnit,
    TriadTruth,
    TurntableScenario,
    simulate_turntable,
)

SEED = 20_260_000_000
SHARES = (0.0, 0.01, 0.03, 0.1)
UNITS = ("target", "reference", "both")
LARGEST_RATIO = 1.5
"""Largest ratio of sigma to the root mean square error, or its inverse."""
SHAKINGS: tuple[tuple[str, float, float], ...] = (
    ("none", 0.0, 200.0),
    ("tone of 17.3 Hz", 0.1, 200.0),
    ("tone of 17.3 Hz", 0.3, 200.0),
    ("tone of 30 Hz", 1.0, 200.0),
    ("tone of 48.6 Hz", 2.0, 200.0),
    ("tone of 123 Hz, aliased", 1.0, 200.0),
    ("tone of 10 Hz", 2.0, 100.0),
    ("broad about 25 Hz", 0.1, 200.0),
    ("broad about 25 Hz", 0.3, 200.0),
    ("broad about 25 Hz", 1.0, 200.0),
)
"""Sources of vibration, root mean square of each axis in m/s^2, samples a second."""
ROCKINGS: tuple[tuple[str, float, float], ...] = (
    ("none", 0.0, 200.0),
    ("tone of 17.3 Hz", 0.01, 200.0),
    ("tone of 17.3 Hz", 0.1, 200.0),
    ("tone of 30 Hz", 0.03, 200.0),
    ("tone of 48.6 Hz", 0.1, 200.0),
    ("tone of 123 Hz, aliased", 0.03, 200.0),
    ("tone of 10 Hz", 0.05, 100.0),
    ("broad about 25 Hz", 0.003, 200.0),
    ("broad about 25 Hz", 0.01, 200.0),
    ("broad about 25 Hz", 0.05, 200.0),
)
"""Sources of rocking, root mean square about each axis in rad/s, samples a second."""
BUMPS: tuple[tuple[float, float], ...] = (
    (0.0, 0.0),
    (0.01, 0.0),
    (0.0, 1.0),
    (0.005, 1.0),
    (0.01, 1.0),
    (0.05, 1.0),
    (0.2, 1.0),
    (0.05, 4.0),
)
"""Turn of the structure in the middle of a rest, deg, and drift of the target's biases over the session,
1-sigma, mm/s^2 and 0.1 mrad/s."""
BUMP_SECONDS = 0.2
SETTLED = 2000
"""Samples after which a resonance has forgotten its start."""


def session(seed: int, rate: float = 200.0) -> SimulatedTurntable:
    """Six faces, 10 s each, a turn by 90 deg in four seconds."""
    scenario: TurntableScenario = replace(
        design_scenario(),
        seed=seed,
        mounting_angle_deg=1.0,
        table_error_deg=0.05,
        rate_hz=rate,
        turn_rate_dps=45.0,
        turn_acceleration_dps2=90.0,
        turn_profile="smooth",
    )
    return simulate_turntable(scenario)


def lacking(unit: SimulatedUnit, share: float, random: np.random.Generator) -> Recording:
    """The recording of a unit that lost samples one by one."""
    samples = unit.samples
    left = random.random(len(samples)) >= share
    left[[0, -1]] = True
    return Recording.from_arrays(
        unit.name, samples.time[left], samples.accelerometer[left], samples.gyroscope[left], clock="turntable"
    )


def shaken(
    played: SimulatedTurntable, what: str, size: float, seed: int, *, rocks: bool = False
) -> list[Recording]:
    """All units of one structure that shakes, or rocks; each axis by itself, all units alike."""
    recordings = []
    for unit in played.units:
        samples = unit.samples
        shaking = size * _shaking(samples.time, what, np.random.default_rng(seed))
        recordings.append(
            Recording.from_arrays(
                unit.name,
                samples.time,
                samples.accelerometer + (0.0 if rocks else shaking @ unit.accelerometer.M.T),
                samples.gyroscope + (shaking @ unit.gyroscope.M.T if rocks else 0.0),
                clock="turntable",
            )
        )
    return recordings


def _shaking(time: FloatArray, what: str, random: np.random.Generator) -> FloatArray:
    """(n, 3) of unit root mean square."""
    if what.startswith("tone"):
        frequency = float(what.split()[2])
        phases = random.uniform(0.0, 2.0 * np.pi, 3)
        tone: FloatArray = np.sqrt(2.0) * np.sin(2.0 * np.pi * frequency * time[:, None] + phases)
        return tone
    if what == "none":
        return np.zeros((len(time), 3))
    # A resonance at 25 Hz with a tenth of critical damping, driven by white noise.
    angle = 2.0 * np.pi * 25.0 * float(np.median(np.diff(time)))
    pull = np.exp(-0.1 * angle)
    first, second = 2.0 * pull * np.cos(0.995 * angle), -pull * pull
    drive = random.normal(size=(len(time) + SETTLED, 3))
    moved = lfilter([1.0, 0.0, -1.0], [1.0, -first, -second], drive, axis=0)
    settled: FloatArray = moved[SETTLED:] / moved[SETTLED:].std(axis=0)
    return settled


def bumped(played: SimulatedTurntable, angle: float, drift: float, seed: int) -> list[Recording]:
    """All units of a structure that a bump turns by `angle` deg in a rest; the target's biases drift."""
    random = np.random.default_rng(seed)
    rest = played.rests[random.integers(len(played.rests))]
    begun = random.uniform(rest.start + 3.0, rest.end - 3.0)
    axis = random.normal(size=3)
    axis /= np.linalg.norm(axis)
    drifts = drift * random.normal(0.0, 1.0, (2, 3)) * [[1e-3], [1e-4]]
    recordings = []
    for unit in played.units:
        time = unit.samples.time
        since = np.clip((time - begun) / BUMP_SECONDS, 0.0, 1.0)
        turned = np.radians(angle) * since**2 * (3.0 - 2.0 * since)
        rate = np.radians(angle) * 6.0 * since * (1.0 - since) / BUMP_SECONDS
        back = Rotation.from_rotvec(-turned[:, None] * axis)
        force, gyroscope = (
            (back.apply((each - triad.b) @ np.linalg.inv(triad.M).T) + extra) @ triad.M.T + triad.b
            for each, triad, extra in (
                (unit.samples.accelerometer, unit.accelerometer, 0.0),
                (unit.samples.gyroscope, unit.gyroscope, rate[:, None] * axis),
            )
        )
        if unit in played.target_units:
            course = np.linspace(-0.5, 0.5, len(time))[:, None]
            force, gyroscope = force + course * drifts[0], gyroscope + course * drifts[1]
        recordings.append(Recording.from_arrays(unit.name, time, force, gyroscope, clock="turntable"))
    return recordings


def outcome(found: TriadResult, true: TriadTruth) -> FloatArray:
    """(3, 12) error, sigma, half the 95 % interval."""
    error = parts(found.M, found.b) - np.concatenate(
        [true.b + true.drift, np.diag(true.K), true.non_orthogonality, true.mounting]
    )
    sigma = np.array([p.sigma for p in found.parameters])
    reach = np.array([0.5 * (p.high - p.low) for p in found.parameters])
    sigma[6:], reach[6:] = np.radians(sigma[6:]), np.radians(reach[6:])
    return np.array([error, sigma, reach])


def figures(outcomes: Sequence[FloatArray]) -> Content:
    """Coverage of all parameters, sigma over the root mean square error by group, largest error in sigmas."""
    error, sigma, reach = np.array(outcomes).transpose(1, 0, 2)
    squares = [(sigma[:, k : k + 3] ** 2).mean() / (error[:, k : k + 3] ** 2).mean() for k in (0, 3, 6, 9)]
    return {
        "coverage": float((np.abs(error) <= reach).mean()),
        "sigma_over_error": {group: float(np.sqrt(s)) for group, s in zip(GROUPS, squares, strict=True)},
        "largest": float(np.abs(error / sigma).max()),
    }


def missing_samples(sessions: int) -> Iterator[Content]:
    """Both triads, for each share of missing samples in target, reference or both."""
    for share in SHARES:
        for where in UNITS if share else ("none",):
            found: dict[str, list[FloatArray]] = {"accelerometer": [], "gyroscope": []}
            for seed in range(SEED, SEED + sessions):
                played = session(seed)
                random = np.random.default_rng(seed)
                lost = [share if where in (unit, "both") else 0.0 for unit in ("reference", "target")]
                reference, target = (
                    lacking(unit, each, random) for unit, each in zip(played.units, lost, strict=True)
                )
                result = tumble.turntable(reference, [target], jobs=1).targets[0]
                for triad, outcomes in found.items():
                    outcomes.append(outcome(getattr(result, triad), getattr(played.target_units[0], triad)))
            yield {"share": share, "where": where} | {t: figures(o) for t, o in found.items()}


def shaking(sessions: int) -> Iterator[Content]:
    """The accelerometer, for each kind of shaking."""
    for what, size, rate in SHAKINGS:
        found = []
        for seed in range(SEED, SEED + sessions):
            played = session(seed, rate)
            reference, target = shaken(played, what, size, seed)
            result = tumble.turntable(reference, [target], jobs=1).targets[0]
            if result.accelerometer is None:
                raise RuntimeError(f"{what}, seed {seed}: {result.failure}")
            found.append(outcome(result.accelerometer, played.target_units[0].accelerometer))
        yield {"what": what, "size": size, "rate": rate, "accelerometer": figures(found)}


def rocking(sessions: int) -> Iterator[Content]:
    """The gyroscope, for each kind of rocking."""
    for what, size, rate in ROCKINGS:
        found = []
        for seed in range(SEED, SEED + sessions):
            played = session(seed, rate)
            reference, target = shaken(played, what, size, seed, rocks=True)
            result = tumble.turntable(reference, [target], jobs=1).targets[0]
            if result.gyroscope is None:
                raise RuntimeError(f"{what}, seed {seed}: {result.failure}")
            found.append(outcome(result.gyroscope, played.target_units[0].gyroscope))
        yield {"what": what, "size": size, "rate": rate, "gyroscope": figures(found)}


def bumping(sessions: int) -> Iterator[Content]:
    """Both triads, for each bump and drift."""
    for angle, drift in BUMPS:
        found: dict[str, list[FloatArray]] = {"accelerometer": [], "gyroscope": []}
        for seed in range(SEED, SEED + sessions):
            played = session(seed)
            reference, target = bumped(played, angle, drift, seed)
            result = tumble.turntable(reference, [target], jobs=1).targets[0]
            for triad, outcomes in found.items():
                outcomes.append(outcome(getattr(result, triad), getattr(played.target_units[0], triad)))
        yield {"angle": angle, "drift": drift} | {triad: figures(o) for triad, o in found.items()}


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=200, help="simulated sessions a case")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console()
    content: Content = {
        "machine": machine(),
        "sessions": options.sessions,
        "missing": [],
        "shaking": [],
        "rocking": [],
        "bumping": [],
    }
    for name, cases in (
        ("rocking", rocking),
        ("shaking", shaking),
        ("missing", missing_samples),
        ("bumping", bumping),
    ):
        for case in cases(options.sessions):
            content[name].append(case)
            console.print(case)
    if not options.no_save:
        console.print(f"written to {save('disturbed', content)}")
    return content


if __name__ == "__main__":
    main()
