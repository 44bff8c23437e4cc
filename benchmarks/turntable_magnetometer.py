"""Magnetometers on a turntable: error against the bound, coverage, magnets near rests, fields that differ.

`python -m benchmarks.turntable_magnetometer [--sessions 3000]`
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("RAYON_NUM_THREADS", "1")

import numpy as np

import tumble
from benchmarks.magnetometer import GROUPS
from benchmarks.magnetometer_bound import jacobian, values, without
from benchmarks.results import Content, machine, save
from tumble.calibration.document import Calibration
from tumble.foundation.plain import finite
from tumble.foundation.recording import FloatArray
from tumble.tools.simulate import SimulatedTurntable, simulate_turntable

BASE_SEED = 910_000
CORES = 2
VISITS = ("Z up", "Z down", "X up", "X down", "Y up", "Y down") * 2
"""Twelve rests, between which the table turns about the vertical too."""
REST, RATE = 15.0, 50.0
DIFFERENCE = 0.6
"""uT by which the field differs at the target."""
LARGEST_RATIO = 1.05
COVERAGE = (0.93, 0.97)
MOST_ALARMS = 0.02
"""Largest share of undisturbed sessions in which a rest, or a difference, is named."""
LEAST_FOUND = 0.99


def session(seed: int, *, difference: float = 0.0, disturbed: int = 0) -> SimulatedTurntable:
    """Plays one session with white noise, without steps, so that the bound is exact."""
    return simulate_turntable(
        seed=seed,
        grades=("consumer",),
        magnetometer=True,
        perfect_reference=True,
        field_difference=difference,
        disturbed=disturbed,
        visits=VISITS,
        heading_turn_deg=55.0,
        rest_seconds=REST,
        rate_hz=RATE,
        quantisation=False,
        bias_instability=False,
        g_sensitivity=False,
    )


def calibrated_reference() -> Calibration:
    """Calibration of the reference: its axes are exact, and what is near it leaves a bias."""
    return Calibration.model_validate(
        {
            "schema": "tumble-calibration/3",
            "name": "reference",
            "magnetometer": {"M": np.eye(3), "b": np.zeros(3)},
        }
    )


def least_sigma(played: SimulatedTurntable) -> tuple[FloatArray, FloatArray]:
    """(12,) truth and least sigma of bias, scale, non-orthogonality and mounting, angles in rad.

    The field of each rest is a direction that nobody knows, of one strength; the reference has a bias.
    """
    target, reference = (unit.magnetometer for unit in (played.target_units[0], played.reference_unit))
    assert target is not None
    assert reference is not None
    strength = played.scenario.field_strength
    truth = np.concatenate([target.M.ravel(), target.b, reference.b, [strength]])
    weight = np.full(6, round(REST * RATE) / played.scenario.field_noise**2)

    def readings(x: FloatArray, direction: FloatArray, turn: FloatArray) -> FloatArray:
        field = x[15] * (direction + np.cross(turn, direction))
        return np.concatenate([field + x[12:15], x[:9].reshape(3, 3) @ field + x[9:12]])

    information = np.zeros((16, 16))
    for field in fields_at_rest(played):
        direction = field / np.linalg.norm(field)
        across = np.linalg.svd(direction[None])[2][1:].T
        by_truth = jacobian(lambda x, d=direction: readings(x, d, np.zeros(3)), truth)  # type: ignore[misc]
        by_turn = jacobian(lambda t, d=direction, a=across: readings(truth, d, a @ t), np.zeros(2))  # type: ignore[misc]
        information += without(by_truth, by_turn, weight)
    covariance = np.linalg.inv(information)[:12, :12]

    def shown(x: FloatArray) -> FloatArray:
        return values(x[:9].reshape(3, 3), x[9:])

    by_elements = jacobian(shown, truth[:12])
    return shown(truth[:12]), np.sqrt(np.diag(by_elements @ covariance @ by_elements.T))


def fields_at_rest(played: SimulatedTurntable) -> FloatArray:
    """(k, 3) uT at the target at each rest, by its mean readings freed of its errors."""
    unit = played.target_units[0]
    truth, track = unit.magnetometer, unit.recording.magnetic
    assert truth is not None
    assert track is not None
    found = []
    for rest in played.rests:
        within = (track.time > rest.start) & (track.time < rest.end)
        found.append(np.linalg.solve(truth.M, track.field[within].mean(axis=0) - truth.b))
    return np.array(found)


def trial(task: tuple[int, float, int]) -> tuple[FloatArray, FloatArray, bool, bool]:
    """Errors over the bound and over intervals; whether the magnet, and a difference, are named."""
    seed, difference, disturbed = task
    played = session(seed, difference=difference, disturbed=disturbed)
    result = tumble.turntable(
        played.reference, played.targets, poses=None, reference_calibration=calibrated_reference()
    )
    (target,) = result.targets
    assert target.magnetometer is not None, target.warnings
    assert target.field is not None
    truth, bound = least_sigma(played)
    shown = target.magnetometer.parameters
    factor = np.array([np.radians(1.0) if each.unit == "deg" else 1.0 for each in shown])
    error = factor * [each.value for each in shown] - truth
    reach = factor * [0.5 * (each.high - each.low) for each in shown]
    named = [k + 1 for k, rest in enumerate(target.field.rests) if rest.disturbance]
    return (
        error / bound,
        error / reach,
        named == ([disturbed] if disturbed else []),
        target.field.difference is not None,
    )


def summed(trials: list[tuple[FloatArray, FloatArray, bool, bool]]) -> Content:
    """Error over the bound, coverage, and what was named, over sessions."""
    over_bound, over_reach = (np.array([each[k] for each in trials]) for k in (0, 1))
    places = {name: slice(3 * k, 3 * k + 3) for k, name in enumerate(GROUPS)}
    return {
        "ratio": {name: float(np.sqrt(np.mean(over_bound[:, rows] ** 2))) for name, rows in places.items()},
        "coverage": {
            name: float(np.mean(np.abs(over_reach[:, rows]) < 1.0)) for name, rows in places.items()
        },
        "named_right": float(np.mean([each[2] for each in trials])),
        "differences": float(np.mean([each[3] for each in trials])),
        "sessions": len(trials),
    }


def measure(sessions: int) -> Content:
    """Measures undisturbed sessions, those with a magnet near a rest, and those with a field that differs."""
    content: Content = {"machine": machine(), "difference": DIFFERENCE, "rest": REST}
    few = max(sessions // 4, 20)
    tasks = {
        "even": [(BASE_SEED + k, 0.0, 0) for k in range(sessions)],
        "magnet": [(BASE_SEED + 10_000 + k, 0.0, 1 + k % len(VISITS)) for k in range(few)],
        "differing": [(BASE_SEED + 20_000 + k, DIFFERENCE, 0) for k in range(few)],
    }
    with ProcessPoolExecutor(CORES, mp_context=get_context("spawn")) as pool:
        for name, of in tasks.items():
            content[name] = summed(list(pool.map(trial, of, chunksize=4)))
    return {key: finite(value) for key, value in content.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=3000)
    parser.add_argument("--no-save", action="store_true")
    options = parser.parse_args()
    content = measure(options.sessions)
    for name in ("even", "magnet", "differing"):
        print(name, content[name])
    if not options.no_save:
        save("turntable_magnetometer", content)


if __name__ == "__main__":
    main()
