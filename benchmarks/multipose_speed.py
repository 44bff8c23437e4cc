"""Ten minutes by hand at 100 Hz: all of `tumble multipose` beside SciPy's `least_squares`, same problem.

SciPy is given what Tumble has to find first: rests, their means and sigmas, the samples of each turn, and a
start near the truth. Residuals and analytic Jacobian are those of docs/theory/multipose.md in numpy, all
turns of one step at once; no robust weights, no covariance, no choice of rests, no poses left out.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import least_squares

from benchmarks.results import Content
from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.tools.simulate import SimulatedMultipose, simulate_multipose

SEED = 70_500
ORIENTATIONS = 95
"""With rests of 4 s and turns between them a little more than ten minutes."""
FASTER = 20.0
REPEATS = 5
LOWER = np.tril_indices(3)


@dataclass(frozen=True)
class Problem:
    """Problem that SciPy solves."""

    means: FloatArray
    """(k, 3) of the accelerometer, m/s^2."""
    sigma: FloatArray
    """(k,) of |u|, m/s^2."""
    rate_means: FloatArray
    """(k, 3) rad/s."""
    rate_sigma: FloatArray
    """(k,) rad/s."""
    rates: FloatArray
    """(n, turns, 3) rad/s, all turns side by side, zero steps at the end of short ones."""
    steps: FloatArray
    """(n - 1, turns) s."""
    gravity: float


def problem_of(played: SimulatedMultipose) -> Problem:
    """Cuts a session at its true rests."""
    samples, rests, unit = played.unit.samples, played.session.rests, played.unit
    spans = [tuple(np.searchsorted(samples.time, (rest.start, rest.end))) for rest in rests]
    duration = np.array([rest.end - rest.start for rest in rests])
    turns = [slice(before[1] - 1, after[0] + 1) for before, after in pairwise(spans)]
    longest = max(turn.stop - turn.start for turn in turns)
    rates, steps = np.zeros((longest, len(turns), 3)), np.zeros((longest - 1, len(turns)))
    for k, turn in enumerate(turns):
        count = turn.stop - turn.start
        rates[:count, k] = samples.gyroscope[turn]
        rates[count:, k] = samples.gyroscope[turn.stop - 1]
        steps[: count - 1, k] = np.diff(samples.time[turn])
    return Problem(
        means=np.array([samples.accelerometer[slice(*span)].mean(axis=0) for span in spans]),
        sigma=unit.accelerometer.noise_density / np.sqrt(duration),
        rate_means=np.array([samples.gyroscope[slice(*span)].mean(axis=0) for span in spans]),
        rate_sigma=unit.gyroscope.noise_density / np.sqrt(duration),
        rates=rates,
        steps=steps,
        gravity=played.session.scenario.gravity,
    )


def fit(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """Fits both sensors with SciPy; returns M of each."""
    force = least_squares(
        force_residuals, [1, 0, 1, 0, 0, 1, 0, 0, 0], force_jacobian, method="lm", args=(problem,)
    ).x
    matrix = np.zeros((3, 3))
    matrix[LOWER] = force[:6]
    true = (problem.means - force[6:]) @ np.linalg.inv(matrix).T
    ups = true / np.linalg.norm(true, axis=1)[:, None]
    start = np.concatenate([np.eye(3).ravel(), problem.rate_means.mean(axis=0)])
    rate = least_squares(rate_residuals, start, rate_jacobian, method="lm", args=(problem, ups)).x
    return matrix, rate[:9].reshape(3, 3)


def force_residuals(x: FloatArray, problem: Problem) -> FloatArray:
    """(k,) eq. 2 over its sigma."""
    matrix = np.zeros((3, 3))
    matrix[LOWER] = x[:6]
    true = (problem.means - x[6:]) @ np.linalg.inv(matrix).T
    return np.asarray((np.linalg.norm(true, axis=1) - problem.gravity) / problem.sigma)


def force_jacobian(x: FloatArray, problem: Problem) -> FloatArray:
    """(k, 9) eq. 3."""
    matrix = np.zeros((3, 3))
    matrix[LOWER] = x[:6]
    inverse = np.linalg.inv(matrix)
    true = (problem.means - x[6:]) @ inverse.T
    response = true / np.linalg.norm(true, axis=1)[:, None] @ inverse
    by_matrix = -(response[:, :, None] * true[:, None, :])[:, LOWER[0], LOWER[1]]
    return np.concatenate([by_matrix, -response], axis=1) / problem.sigma[:, None]


def rate_residuals(x: FloatArray, problem: Problem, ups: FloatArray) -> FloatArray:
    """(3 turns + 3 rests,) eq. 15 and 17."""
    inverse = np.linalg.inv(x[:9].reshape(3, 3))
    true = (problem.rates - x[9:]) @ inverse.T
    carried = ups[:-1]
    for k, step in enumerate(problem.steps):
        carried = turned(carried, -angle(true[k], true[k + 1], step))
    at_rest = (problem.rate_means - x[9:]) / problem.rate_sigma[:, None]
    return np.concatenate([((carried - ups[1:]) / turn_sigma(problem)).ravel(), at_rest.ravel()])


def rate_jacobian(x: FloatArray, problem: Problem, ups: FloatArray) -> FloatArray:
    """(3 turns + 3 rests, 12) eq. 13 and 14."""
    inverse = np.linalg.inv(x[:9].reshape(3, 3))
    true = (problem.rates - x[9:]) @ inverse.T
    turns = true.shape[1]
    carried = ups[:-1]
    response = np.zeros((turns, 3, 12))
    # Angle by [M row by row, b]: -C[:, i] u_j, -C[:, i].
    by_rate = -np.einsum("ai,ntj->ntaij", inverse, true).reshape(len(true), turns, 3, 9)
    for k, step in enumerate(problem.steps):
        phi = angle(true[k], true[k + 1], step)
        middle = 0.5 * (by_rate[k] + by_rate[k + 1])
        added = (
            np.concatenate([middle, np.broadcast_to(-inverse, (turns, 3, 3))], axis=2) * step[:, None, None]
        )
        carried = turned(carried, -phi)
        response = turned_columns(response, -phi) + added
    by_turn = np.cross(carried[:, None, :], response.transpose(0, 2, 1)).transpose(0, 2, 1)
    rests = len(problem.rate_means)
    by_rest = np.zeros((rests, 3, 12))
    by_rest[:, range(3), range(9, 12)] = -1.0 / problem.rate_sigma[:, None]
    return np.concatenate([(by_turn / turn_sigma(problem)).reshape(-1, 12), by_rest.reshape(-1, 12)])


def angle(first: FloatArray, second: FloatArray, step: FloatArray) -> FloatArray:
    """(turns, 3) eq. 11."""
    return np.asarray(
        0.5 * step[:, None] * (first + second) + (step**2 / 12.0)[:, None] * np.cross(first, second)
    )


def turned(vectors: FloatArray, phi: FloatArray) -> FloatArray:
    """(turns, 3) vectors, each rotated by its own rotation vector."""
    return np.asarray(np.einsum("tij,tj->ti", rotations(phi), vectors))


def turned_columns(columns: FloatArray, phi: FloatArray) -> FloatArray:
    """(turns, 3, n) columns, rotated alike."""
    return np.asarray(rotations(phi) @ columns)


def rotations(phi: FloatArray) -> FloatArray:
    """(turns, 3, 3) by Rodrigues."""
    size = np.linalg.norm(phi, axis=1)
    safe = np.maximum(size, 1e-12)
    hat = np.zeros((len(phi), 3, 3))
    hat[:, 0, 1], hat[:, 0, 2], hat[:, 1, 2] = -phi[:, 2], phi[:, 1], -phi[:, 0]
    hat -= hat.transpose(0, 2, 1)
    first = (np.sin(safe) / safe)[:, None, None]
    second = ((1.0 - np.cos(safe)) / safe**2)[:, None, None]
    return np.asarray(np.eye(3) + first * hat + second * (hat @ hat))


def turn_sigma(problem: Problem) -> float:
    """Sigma of the direction after a turn, rad: one for all, of the rests before and after."""
    return float(np.sqrt(2.0) * np.median(problem.sigma) / problem.gravity)


def measured() -> Content:
    """Time both in turn, best of a few, and compare their results."""
    played = simulate_multipose(
        seed=SEED,
        orientations=ORIENTATIONS,
        bias_instability=False,
        quantisation=False,
        g_sensitivity=False,
        latitude_deg=None,
        rate_hz=100.0,
    )
    samples = played.unit.samples
    arrays = (samples.time, samples.accelerometer, samples.gyroscope)
    stamps, force, rate = (np.ascontiguousarray(each) for each in arrays)
    problem = problem_of(played)
    own, peer = [], []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        found = _core.multipose_of(stamps, force, rate, problem.gravity)
        own.append(time.perf_counter() - begun)
        begun = time.perf_counter()
        matrices = fit(problem)
        peer.append(time.perf_counter() - begun)
    gyroscope = found["gyroscope"]
    assert gyroscope is not None
    both = (found["accelerometer"]["M"], gyroscope["calibration"]["M"])
    return {
        "minutes": float(samples.time[-1] / 60.0),
        "rests": len(problem.means),
        "seconds": min(own),
        "peer_seconds": min(peer),
        "ratio": min(peer) / min(own),
        "apart": [float(np.abs(a - b).max()) for a, b in zip(both, matrices, strict=True)],
    }
