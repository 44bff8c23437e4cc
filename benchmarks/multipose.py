"""Sessions by hand: error against the bound and coverage, then every recording of others that is at hand.

`python -m benchmarks.multipose [--sessions 1000]`
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeAlias

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("RAYON_NUM_THREADS", "1")

import numpy as np

import tumble
from benchmarks import multipose_speed
from benchmarks.results import Content, machine, save
from tumble.foundation.plain import finite
from tumble.foundation.recording import FloatArray, Recording, RecordingSource
from tumble.foundation.results import INTERVAL
from tumble.logs import ReadOptions, list_imus, open_recording
from tumble.procedures.multipose.procedure import as_counts
from tumble.procedures.multipose.sections import Section
from tumble.tools.simulate import SimulatedMultipose, simulate_multipose

BASE_SEED = 70_000
CORES = 2
LARGEST_RATIO = 1.1
COVERAGE = (0.93, 0.97)
LARGEST_SCATTER = 1.5
"""Largest root mean square of nine differences of halves in sigmas: one in 50 sets exceeds 1.5 by chance."""
GROUPS = ("bias", "scale", "non-orthogonality")
"""Three parameters each."""
PAIRS = ((0, 1), (1, 2), (2, 0))

Options: TypeAlias = dict[str, Any]
"""Options of `tumble.multipose`."""

DATA = Path(__file__).parents[2] / "shared" / "data"
XSENS_GRAVITY = 9.81744
"""m/s^2, as the authors of imu_tk state it for their recording."""
IMU_TK: Content = {
    "scale": (414.46, 412.01, 414.65),
    "bias": (33124.2, 33275.2, 32364.4),
    "rate_scale": (4777.9, 4764.2, 4773.7),
    "norm": 0.0010,
    "angle": 0.46,
}
"""Published by imu_tk for its recording: counts per m/s^2, counts, counts per rad/s, m/s^2, deg."""
MPU_9150: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "imu0": ((0.363, 0.315, 0.647), (0.103, 0.097, 0.344)),
    "imu1": ((0.471, 0.482, 0.932), (0.090, 0.070, 0.338)),
    "imu2": ((0.382, 0.355, 0.780), (0.096, 0.008, -0.045)),
}
"""Published by imu-calib: scale error in %, bias in m/s^2."""


def session(seed: int, unstable: bool = False) -> SimulatedMultipose:
    """Plays one session: white noise alone, so that the bound is exact, or bias instability too."""
    return simulate_multipose(
        seed=seed, bias_instability=unstable, quantisation=False, g_sensitivity=False, latitude_deg=48.0
    )


def force_values(matrix: FloatArray, bias: FloatArray) -> FloatArray:
    """(9,) bias, scale and non-orthogonality of an accelerometer."""
    scale = np.linalg.norm(matrix, axis=1)
    axes = matrix / scale[:, None]
    return np.concatenate([bias, scale, [np.arcsin(axes[i] @ axes[j]) for i, j in PAIRS]])


def force_bound(found: SimulatedMultipose) -> FloatArray:
    """(9,) least sigma of any unbiased estimate from |u| = g at the true rests, in numpy alone."""
    truth = found.unit.accelerometer
    rows = []
    for rest in found.session.rests:
        force = truth.Q @ rest.specific_force
        response = np.linalg.solve(found.force_matrix.T, force / np.linalg.norm(force))
        sigma = truth.noise_density / np.sqrt(rest.end - rest.start) * np.linalg.norm(response)
        rows.append(np.concatenate([-np.outer(response, force)[np.tril_indices(3)], -response]) / sigma)
    covariance = np.linalg.inv(np.array(rows).T @ np.array(rows))

    def values(x: FloatArray) -> FloatArray:
        matrix = np.zeros((3, 3))
        matrix[np.tril_indices(3)] = x[:6]
        return force_values(matrix, x[6:])

    x = np.concatenate([found.force_matrix[np.tril_indices(3)], truth.b])
    jacobian = np.array([(values(x + step) - values(x - step)) / 2e-6 for step in 1e-6 * np.eye(9)]).T
    return np.asarray(np.sqrt(np.diag(jacobian @ covariance @ jacobian.T)))


def trial(task: tuple[int, bool]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Errors of the accelerometer over the bound and over their sigma; those of the gyroscope over theirs.

    The bias is the mean over the session, drift included.
    """
    played = session(*task)
    unit = played.unit
    found = tumble.multipose(played.recording, gravity=played.session.scenario.gravity)
    force = [each for each in found.accelerometer.parameters if each.observable]
    factor = np.array([np.radians(1.0) if each.unit == "deg" else 1.0 for each in force])
    value = factor * [each.value for each in force]
    sigma = factor * [each.sigma for each in force]
    error = value - force_values(played.force_matrix, unit.accelerometer.b + unit.accelerometer.drift)
    assert found.gyroscope is not None, found.gyroscope_reason
    rate_error = np.concatenate(
        [
            found.gyroscope.b - unit.gyroscope.b - unit.gyroscope.drift,
            (found.gyroscope.M - played.rate_matrix).ravel(),
        ]
    )
    variance = np.diag(found.gyroscope.covariance)
    rate_sigma = np.sqrt(np.concatenate([variance[9:], variance[:9]]))
    return error / force_bound(played), error / sigma, rate_error / rate_sigma


def statistics(sessions: int, unstable: bool) -> Content:
    """Error against the bound of white noise, and coverage, of both sensors."""
    seeds = range(BASE_SEED, BASE_SEED + sessions)
    with ProcessPoolExecutor(CORES, mp_context=get_context("spawn")) as pool:
        done = list(pool.map(trial, [(seed, unstable) for seed in seeds], chunksize=10))
    over_bound, over_sigma, rate_over_sigma = (np.array(column) for column in zip(*done, strict=True))
    content: Content = {"sessions": sessions, "seeds": [seeds[0], seeds[-1]], "accelerometer": {}}
    for k, group in enumerate(GROUPS):
        rows = slice(3 * k, 3 * k + 3)
        content["accelerometer"][group] = {
            "ratio": float(np.sqrt(np.mean(over_bound[:, rows] ** 2))),
            "coverage": float(np.mean(np.abs(over_sigma[:, rows]) < INTERVAL)),
        }
    content["gyroscope"] = {
        name: {
            "error_over_sigma": float(np.sqrt(np.mean(rate_over_sigma[:, rows] ** 2))),
            "coverage": float(np.mean(np.abs(rate_over_sigma[:, rows]) < INTERVAL)),
        }
        for name, rows in (("bias", slice(0, 3)), ("matrix", slice(3, 12)))
    }
    return content


def recordings() -> Iterator[tuple[str, RecordingSource, Options]]:
    """Returns every recording that is at hand by name, with the options it is calibrated with."""
    yield "xsens", DATA / "xsens" / "xsens_acc.mat", {"raw": True, "gravity": XSENS_GRAVITY}
    yield (
        "xsens, g-sensitivity",
        DATA / "xsens" / "xsens_acc.mat",
        {"raw": True, "gravity": XSENS_GRAVITY, "g_sensitivity": True},
    )
    for unit in MPU_9150:
        columns = np.loadtxt(DATA / "mpu9150" / f"{unit}.log")
        yield f"mpu9150 {unit}", from_columns(unit, columns, 100.0), {"gravity": 9.81}
    board = ReadOptions(accelerometer_unit="m/s^2", gyroscope_unit="rad/s")
    for number in range(1, 9):
        yield f"mimu4444 imu{number}", f"{DATA / 'mimu4444' / 'exp_3.parquet'}:imu{number}", {"read": board}
    counts = ReadOptions(
        rate=100.0,
        accelerometer_scale=16384,
        accelerometer_unit="g",
        gyroscope_scale=131,
        gyroscope_unit="deg/s",
    )
    for name in ("calibration", "static_449s", "turn_90_x"):
        yield f"mpu6050 {name}", DATA / "mpu6050" / f"{name}.csv", {"read": counts}
    faces = ReadOptions(rate=102.4, accelerometer_unit="m/s^2", gyroscope_unit="deg/s")
    yield "imucal", DATA / "imucal" / "example_ferraris_session.csv", {"read": faces}
    for path in sorted((DATA / "px4").glob("*.ulg")):
        for imu in list_imus(path):
            yield f"px4 {path.stem}:{imu}", f"{path}:{imu}", {}
    for name in ("test1", "test2"):
        yield f"husky {name}", DATA / "husky" / f"{name}.bag", {}


def from_columns(name: str, columns: FloatArray, rate: float) -> Recording:
    """Wraps six columns, m/s^2 and rad/s, without time."""
    return Recording.from_arrays(name, np.arange(len(columns)) / rate, columns[:, :3], columns[:, 3:])


def split_halves() -> Content:
    """Calibrates every second rest of the recording of imu_tk and the others: their difference in sigmas.

    Rests are labelled as a calibration of the whole finds them.
    """
    options: Options = {"raw": True, "gravity": XSENS_GRAVITY}
    source = DATA / "xsens" / "xsens_acc.mat"
    time = np.concatenate([chunk.time for chunk in open_recording(source, as_counts(None)).chunks()])
    whole = tumble.multipose(source, **options)
    spans = [np.searchsorted(time, (rest.start, rest.end)) for rest in whole.rests if rest.used]
    sections = [Section("rest", int(first), int(end)) for first, end in spans]
    halves = [tumble.multipose(source, sections=sections[k::2], **options) for k in (0, 1)]
    scale = [half.nominal_scale.accelerometer for half in halves if half.nominal_scale]
    apart, sigmas = [], []
    for own, other in zip(*(half.accelerometer.parameters for half in halves), strict=True):
        if own.observable:
            # Counts of both halves are taken for units of their own.
            factors = scale if not own.unit.startswith("deg") else [1.0, 1.0]
            apart.append(factors[0] * own.value - factors[1] * other.value)
            sigmas.append(math.hypot(factors[0] * own.sigma, factors[1] * other.sigma))
    normalised = np.array(apart) / np.array(sigmas)
    return {"rms": float(np.sqrt(np.mean(normalised**2))), "largest": float(np.abs(normalised).max())}


def recorded() -> Content:
    """Calibrates every recording, or gives the reason against it."""
    return {name: outcome(source, options) for name, source, options in recordings()}


def outcome(source: RecordingSource, options: Options) -> Content:
    """Returns the figures of a calibration, or the refusal."""
    begun = time.perf_counter()
    try:
        found = tumble.multipose(source, **options)
    except tumble.TumbleError as error:
        return {"refused": error.why.replace(f"{DATA.resolve()}/", "").replace(f"{DATA}/", "")}
    counts = found.nominal_scale
    factors = (1.0, 1.0) if counts is None else (counts.accelerometer, counts.gyroscope or 1.0)
    return {
        "seconds": time.perf_counter() - begun,
        "rests": len(found.poses),
        "directions": found.directions,
        "norm": finite([found.norm_before, found.norm_after, found.norm_held_out]),
        "angle": [math.degrees(found.angle_before), math.degrees(found.angle_after)] if found.turns else None,
        "scale": (factors[0] * np.diag(found.accelerometer.K)).tolist(),
        "bias": (factors[0] * found.accelerometer.b).tolist(),
        "rate_scale": (factors[1] * np.diag(found.gyroscope.K)).tolist() if found.gyroscope else None,
        "gyroscope_reason": found.gyroscope_reason,
    }


def main() -> None:
    """Runs, prints and saves."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=1000)
    parser.add_argument("--no-save", action="store_true")
    arguments = parser.parse_args()
    content = statistics(arguments.sessions, unstable=False) | {"machine": machine()}
    content["with bias instability"] = statistics(arguments.sessions, unstable=True)
    content["speed"] = multipose_speed.measured()
    if DATA.is_dir():
        content["recorded"] = recorded()
        content["halves"] = split_halves()
    for key, value in content.items():
        print(key, value)
    if not arguments.no_save:
        save("multipose", content)


if __name__ == "__main__":
    main()
