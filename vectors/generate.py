"""Conformance vectors: inputs and what every implementation has to make of them.

    python vectors/generate.py

Expected values come from numpy and scipy by ways of their own (QR, nonlinear least squares over all
unknowns, plain sums), never from the core.
"""

from __future__ import annotations

import json
import struct
import sys
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

HERE = Path(__file__).parent
GRAVITY = 9.80665
FACES: Array = np.array(
    [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64
)


def skewed(rng: np.random.Generator, mounting: Array) -> Array:
    """(3, 3) M: scale within 3 %, axes within 1 deg of square, mounted by a rotation vector in rad."""
    scale = np.diag(1.0 + rng.uniform(-0.03, 0.03, 3))
    lower = np.eye(3) + np.tril(rng.uniform(-0.017, 0.017, (3, 3)), -1)
    lower /= np.linalg.norm(lower, axis=1, keepdims=True)
    matrix: Array = scale @ lower @ Rotation.from_rotvec(mounting).as_matrix()
    return matrix


def model() -> list[dict[str, Any]]:
    """M = K L Q by QR of the transposed rows; corrections by a linear solver."""
    rng = np.random.default_rng(1)
    mountings = np.array(
        [[0, 0, 0], [0.01, -0.02, 0.03], [0, 0, np.pi / 2], [1.2, -2.0, 0.7], [3.0, 0.4, 0.5]]
    )
    cases = []
    for mounting in mountings:
        m, b, u = skewed(rng, mounting), rng.normal(0, 0.2, 3), rng.normal(0, 6, 3)
        k = np.linalg.norm(m, axis=1)
        q, r = np.linalg.qr((m / k[:, None]).T)
        signs = np.sign(np.diag(r))
        gram = (m / k[:, None]) @ (m / k[:, None]).T
        cases.append(
            {
                "M": m,
                "b": b,
                "scale": k,
                "L": (r * signs[:, None]).T,
                "Q": (q * signs).T,
                "non_orthogonality": np.arcsin([gram[0, 1], gram[1, 2], gram[2, 0]]),
                "mounting": Rotation.from_matrix((q * signs).T).as_rotvec(),
                "u": u,
                "y": m @ u + b,
                "corrected": np.linalg.solve(m, (m @ u + b) - b),
            }
        )
    return cases


def temperature() -> list[dict[str, Any]]:
    """Give what readings would be at the reference, by powers; `bits` are single, by Horner's rule."""
    rng = np.random.default_rng(11)
    low, reference, high = -20.0, 25.0, 70.0
    sizes = np.array([1e-3, 1e-5, 1e-7])[:, None]
    cases = []
    for degrees in (-60.0, -20.0, 3.5, 25.0, 61.0, 70.0, 95.0):
        # Numbers that single precision holds, so that both precisions are given the same.
        bias, scale, b, y = (
            np.float64(np.float32(values))
            for values in (
                sizes * rng.normal(size=(3, 3)),
                0.05 * sizes * rng.normal(size=(3, 3)),
                rng.normal(0, 0.2, 3),
                rng.normal(0, 6, 3),
            )
        )
        t = np.clip(degrees, low, high) - reference
        powers = t ** np.arange(1, 4)
        cases.append(
            {
                "reference": reference,
                "range": [low, high],
                "bias": bias,
                "scale": scale,
                "b": b,
                "y": y,
                "temperature": degrees,
                "at_reference": (y - b - powers @ bias) / (1.0 + powers @ scale) + b,
                "bits": _single(y, b, bias, scale, t).view(np.uint32).tolist(),
            }
        )
    return cases


def _single(y: Array, b: Array, bias: Array, scale: Array, t: float) -> NDArray[np.float32]:
    """Take a reading to the reference in single precision, step by step."""
    one, degrees = np.float32(1.0), np.float32(t)
    y_single, b_single = y.astype(np.float32), b.astype(np.float32)
    first, second, third = zip(bias.astype(np.float32), scale.astype(np.float32), strict=True)
    d, s = (
        ((cubic * degrees + square) * degrees + linear) * degrees
        for linear, square, cubic in zip(first, second, third, strict=True)
    )
    found: NDArray[np.float32] = (y_single - b_single - d) / (one + s) + b_single
    return found


def magnetometer() -> list[dict[str, Any]]:
    """Give the field behind readings by a linear solver, and records of such units by struct."""
    rng = np.random.default_rng(17)
    cases = []
    for code, load in enumerate((12.5, 0.75)):
        # Numbers that single precision holds: a record keeps them as they are.
        m, b, effect, y, m_sigma, b_sigma = (
            np.float64(np.float32(values))
            for values in (
                skewed(rng, rng.normal(0, 1, 3)),
                rng.normal(0, 30, 3),
                rng.normal(0, 2, 3),
                rng.normal(0, 40, 3),
                rng.uniform(1e-4, 1e-2, (3, 3)),
                rng.uniform(0.05, 0.5, 3),
            )
        )
        identity = 77 + code
        numbers = np.concatenate([part.ravel() for part in (m, b, effect, m_sigma, b_sigma)])
        body = struct.pack("<2sBQBB27f", b"TR", 4, identity, 2, code, *numbers)
        cases.append(
            {
                "identity": identity,
                "current_unit": ("A", "1")[code],
                "M": m,
                "b": b,
                "current": effect,
                "M_sigma": m_sigma,
                "b_sigma": b_sigma,
                "load": load,
                "y": y,
                "field": np.linalg.solve(m, y - b - effect * load),
                "record": (body + struct.pack("<I", zlib.crc32(body))).hex(),
            }
        )
    return cases


def moments() -> dict[str, Any]:
    """Mean and variance of two channels."""
    rng = np.random.default_rng(2)
    samples = np.round(rng.normal([9.8, -0.01], [0.02, 0.002], (50, 2)), 6)
    return {"samples": samples, "mean": samples.mean(axis=0), "variance": samples.var(axis=0, ddof=1)}


def gravity() -> list[dict[str, Any]]:
    """NIMA TR8350.2, table 3.4, at equator and pole; elsewhere its equations 4-1 and 4-3, written out."""
    a, f, m = 6378137.0, 1 / 298.257223563, 3.44978650684e-3
    cases = [
        {"latitude_deg": 0.0, "height_m": 0.0, "gravity": 9.7803253359},
        {"latitude_deg": 90.0, "height_m": 0.0, "gravity": 9.8321849378},
    ]
    for latitude, height in ((48.1, 520.0), (-33.9, 0.0), (27.99, 8849.0)):
        s = np.sin(np.radians(latitude)) ** 2
        ground = 9.7803253359 * (1 + 1.93185265241e-3 * s) / np.sqrt(1 - 6.69437999014e-3 * s)
        above = 1 - 2 / a * (1 + f + m - 2 * f * s) * height + 3 / a**2 * height**2
        cases.append({"latitude_deg": latitude, "height_m": height, "gravity": ground * above})
    return cases


def allan() -> dict[str, Any]:
    """Allan variance over pairs of neighbouring means, octave by octave, from the plain definition."""
    rng = np.random.default_rng(3)
    means = np.round(rng.normal(0, 0.01, 37) + np.linspace(0, 0.02, 37), 6)
    octaves, level = [], means
    tau = 0.05
    while len(level) >= 2:
        pairs = level[: len(level) // 2 * 2].reshape(-1, 2)
        variance = float(np.mean(np.diff(pairs, axis=1) ** 2) / 2)
        octaves.append({"averaging": tau, "variance": variance, "pairs": len(pairs)})
        level, tau = pairs.mean(axis=1), 2 * tau
    return {"block_s": 0.05, "means": means, "octaves": octaves}


def sphere() -> dict[str, Any]:
    """Bias from |r - b| = g by nonlinear least squares."""
    rng = np.random.default_rng(4)
    directions = rng.normal(size=(9, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    sigma = 1e-3
    rests = np.round(GRAVITY * directions + [0.02, -0.03, 0.01] + rng.normal(0, sigma, (9, 3)), 7)

    def misses(bias: Array) -> Array:
        return np.asarray(np.linalg.norm(rests - bias, axis=1) - GRAVITY, dtype=np.float64)

    fit = least_squares(misses, np.zeros(3), xtol=1e-15)
    jacobian = np.asarray(fit.jac, dtype=np.float64)
    covariance = np.linalg.inv(jacobian.T @ jacobian) * sigma**2
    return {
        "gravity": GRAVITY,
        "sigma": sigma,
        "rests": rests,
        "bias": fit.x,
        "bias_sigma": np.sqrt(np.diag(covariance)),
    }


def mounting() -> dict[str, Any]:
    """Rotation and offset between poses and readings: alignment of the centred vectors."""
    rng = np.random.default_rng(5)
    turn, bias = Rotation.from_rotvec([0.01, -0.02, 0.015]), np.array([0.01, 0.02, -0.03])
    measured = np.round(turn.apply(GRAVITY * FACES) + bias + rng.normal(0, 0.005, (6, 3)), 6)
    found, _ = Rotation.align_vectors(measured - measured.mean(axis=0), FACES - FACES.mean(axis=0))
    offset = measured.mean(axis=0) - found.apply(GRAVITY * FACES.mean(axis=0))
    return {
        "gravity": GRAVITY,
        "up": FACES,
        "measured": measured,
        "rotation_vector": found.as_rotvec(),
        "bias": offset,
    }


def triad() -> dict[str, Any]:
    """M, b and the bias of the reference at once, with gravity's direction at every rest unknown too."""
    rng = np.random.default_rng(6)
    m, b = skewed(rng, np.array([0.02, 0.01, -0.03])), np.array([0.3, -0.1, 0.2])
    true = np.vstack([FACES, FACES[:4] + 0.3])
    true *= GRAVITY / np.linalg.norm(true, axis=1, keepdims=True)
    sigma_reference, sigma_target = 3e-4, 2e-3
    true_bias = np.array([0.01, 0.02, -0.01])
    reference = np.round(true + true_bias + rng.normal(0, sigma_reference, true.shape), 7)
    target = np.round(true @ m.T + b + rng.normal(0, sigma_target, true.shape), 7)

    def residuals(x: Array) -> Array:
        matrix, bias, reference_bias = x[:9].reshape(3, 3), x[9:12], x[12:15]
        polar, azimuth = x[15:].reshape(2, -1)
        up = np.column_stack(
            [np.cos(polar) * np.cos(azimuth), np.cos(polar) * np.sin(azimuth), np.sin(polar)]
        )
        u = GRAVITY * up
        seen = (reference - u - reference_bias) / sigma_reference
        felt = (target - u @ matrix.T - bias) / sigma_target
        return np.concatenate([seen.ravel(), felt.ravel()])

    towards = true / GRAVITY
    angles = np.concatenate([np.arcsin(towards[:, 2].clip(-1, 1)), np.arctan2(towards[:, 1], towards[:, 0])])
    start = np.concatenate([m.ravel(), b, np.zeros(3), angles])
    fit = least_squares(residuals, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac", max_nfev=2000)
    # At the poles of the sphere the azimuth is free: the pseudo-inverse leaves it out.
    jacobian = np.asarray(fit.jac, dtype=np.float64)
    covariance = np.linalg.pinv(jacobian.T @ jacobian)
    return {
        "gravity": GRAVITY,
        "rest_s": 10.0,
        "gap_s": 5.0,
        "sigma_reference": sigma_reference,
        "sigma_target": sigma_target,
        "reference": reference,
        "target": target,
        "M": fit.x[:9].reshape(3, 3),
        "b": fit.x[9:12],
        "sigma": np.sqrt(np.diag(covariance))[:12],
    }


def stream() -> dict[str, Any]:
    """Two rests with a turn of 90 deg about x between: counts of 1e-4 m/s^2 and 1e-5 rad/s at 100 Hz."""
    rng = np.random.default_rng(7)
    rate, rest, turn = 100, 5.0, 2.0
    time = np.arange(int((2 * rest + turn) * rate)) / rate
    share = ((time - rest) / turn).clip(0, 1)
    angle = np.pi / 2 * (10 * share**3 - 15 * share**4 + 6 * share**5)
    angular_rate = np.pi / 2 / turn * 30 * share**2 * (1 - share) ** 2
    nothing = np.zeros_like(time)
    force = GRAVITY * np.column_stack([nothing, np.sin(angle), np.cos(angle)])
    turning = np.column_stack([angular_rate, nothing, nothing])
    force += np.array([0.1, -0.05, 0.02])
    turning += np.array([0.01, -0.02, 0.005])
    counts_force = np.round((force + rng.normal(0, 0.01, force.shape)) / 1e-4).astype(int)
    counts_rate = np.round((turning + rng.normal(0, 0.001, turning.shape)) / 1e-5).astype(int)
    return {
        "interval_us": 1_000_000 // rate,
        "force_step": 1e-4,
        "rate_step": 1e-5,
        "counts": np.hstack([counts_force, counts_rate]),
        "rests_s": [[0.0, rest], [rest + turn, 2 * rest + turn]],
        "turn_angle": [np.pi / 2, 0.0, 0.0],
        "bias": [0.01, -0.02, 0.005],
    }


@dataclass(frozen=True)
class Robot:
    """A robot on a floor of 2 deg: what is true of it, and of the noise of one sample."""

    rate: int = 50
    still: float = 6.0
    accelerometer_bias: Array = field(default_factory=lambda: np.array([0.25, -0.15, 0.1]))
    gyroscope_bias: Array = field(default_factory=lambda: np.array([0.02, -0.01, 0.03]))
    up: Array = field(default_factory=lambda: np.array([0.06, 0.04, 0.9974]))
    tilt: float = float(np.radians(2.0))
    arm: Array = field(default_factory=lambda: np.array([0.12, -0.05]))
    noise: tuple[float, float] = (0.02, 0.002)

    def motion(self) -> tuple[Array, Array, Array, Array]:
        """Time, heading, rate and its change: two turns and a half, faster and slower, then 2 s at rest."""
        duration, angle = 12.0, 5.0 * np.pi
        time = np.arange(int((self.still + duration + 2.0) * self.rate)) / self.rate
        share = ((time - self.still) / duration).clip(0.0, 1.0)
        wave, speed = 2.0 * np.pi * share, 2.0 * np.pi / duration
        heading = angle * (share - np.sin(wave) / (2.0 * np.pi))
        rate = angle / duration * (1.0 - np.cos(wave))
        return time, heading, rate, angle / duration * speed * np.sin(wave)

    def frame(self, up: Array) -> Array:
        """(3, 3) forward, left, up as columns."""
        up = up / np.linalg.norm(up)
        forward = np.array([1.0, 0.0, 0.0]) - up[0] * up
        forward /= np.linalg.norm(forward)
        return np.column_stack([forward, np.cross(up, forward), up])

    def force(self, up: Array, uphill: Array, arm: Array, motion: tuple[Array, Array, Array, Array]) -> Array:
        """(n, 3) specific force without bias; `uphill` (2,) is the pull of gravity across the axis."""
        _, heading, rate, change = motion
        frame = self.frame(up)
        up = frame[:, 2]
        pull, lever = frame[:, :2] @ uphill, frame[:, :2] @ arm
        vertical = np.sqrt(GRAVITY**2 - uphill @ uphill)
        return np.asarray(
            vertical * up
            + np.outer(np.cos(heading), pull)
            - np.outer(np.sin(heading), np.cross(up, pull))
            - np.outer(rate**2, lever)
            + np.outer(change, np.cross(up, lever))
        )


def spin() -> dict[str, Any]:
    """Biases from all samples at once, the true motion known; the rate along the axis counts at rest only."""
    rng = np.random.default_rng(8)
    robot = Robot()
    motion = robot.motion()
    time, _, rate, _ = motion
    uphill = GRAVITY * np.sin(robot.tilt) * np.array([np.cos(0.7), np.sin(0.7)])
    axis = robot.frame(robot.up)[:, 2]
    force = robot.force(axis, uphill, robot.arm, motion) + robot.accelerometer_bias
    turning = np.outer(rate, axis) + robot.gyroscope_bias
    counts_force = np.round((force + rng.normal(0, robot.noise[0], force.shape)) / 1e-4).astype(int)
    counts_rate = np.round((turning + rng.normal(0, robot.noise[1], force.shape)) / 1e-5).astype(int)
    measured, rates = counts_force * 1e-4, counts_rate * 1e-5
    resting = (time < robot.still) | (rate == 0.0)

    def misses(x: Array) -> Array:
        up = robot.frame(np.array([x[6], x[7], 1.0]))[:, 2]
        of_force = measured - x[:3] - robot.force(up, x[8:10], x[10:12], motion)
        of_rate = rates - x[3:6] - np.outer(rate, up)
        across = of_rate - np.outer(of_rate @ up, up) * ~resting[:, None]
        return np.concatenate([(of_force / robot.noise[0]).ravel(), (across / robot.noise[1]).ravel()])

    found = least_squares(misses, np.zeros(12), x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    sigma = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))
    return {
        "interval_us": 1_000_000 // robot.rate,
        "force_step": 1e-4,
        "rate_step": 1e-5,
        "gravity": GRAVITY,
        "rests_s": [[0.0, robot.still], [float(time[-1]) - 1.9, float(time[-1])]],
        "counts": np.hstack([counts_force, counts_rate]),
        "accelerometer_bias": found.x[:3],
        "accelerometer_bias_sigma": sigma[:3],
        "gyroscope_bias": found.x[3:6],
        "gyroscope_bias_sigma": sigma[3:6],
        "floor_tilt": float(np.arcsin(np.linalg.norm(found.x[8:10]) / GRAVITY)),
        "floor_tilt_sigma": float(sigma[8:10].max() / GRAVITY),
    }


def redundancy() -> dict[str, Any]:
    """Errors of a secondary from all samples at once, the true angular acceleration known."""
    rng = np.random.default_rng(9)
    rate_hz, still, moving = 40, 3.0, 17.0
    time = np.arange(round((still + moving) * rate_hz)) / rate_hz
    force_noise, rate_noise = 0.003, 0.0003
    frequencies = 2.0 * np.pi * np.array([[0.31, 0.43, 0.53], [0.71, 0.61, 0.83]])
    phases = rng.uniform(0.0, 2.0 * np.pi, (2, 2, 3))

    def waves(amplitude: float, phase: Array) -> tuple[Array, Array]:
        """Smooth motion and its derivative, growing from nothing over two seconds."""
        since = np.clip((time - still) / 2.0, 0.0, 1.0)[:, None]
        grown, growing = since**2 * (3.0 - 2.0 * since), 6.0 * since * (1.0 - since) / 2.0
        angles = time[:, None, None] * frequencies + phase
        value = amplitude * np.sin(angles).sum(axis=1)
        change = amplitude * (np.cos(angles) * frequencies).sum(axis=1)
        return grown * value, grown * change + growing * value

    (force, _), (turning, change) = waves(2.0, phases[0]), waves(1.0, phases[1])
    force = force + np.array([0.0, 0.0, GRAVITY])
    arm = np.array([0.05, -0.08, 0.03])
    there = force + np.cross(change, arm) + np.cross(turning, np.cross(turning, arm))
    errors = {
        "accelerometer": (np.eye(3) + rng.normal(0.0, 0.01, (3, 3)), np.array([0.2, -0.15, 0.1])),
        "gyroscope": (np.eye(3) + rng.normal(0.0, 0.01, (3, 3)), np.array([0.02, 0.015, -0.03])),
    }
    said = {
        "accelerometer": (force, there, force_noise, 1e-4),
        "gyroscope": (turning, turning, rate_noise, 1e-5),
    }
    counts: dict[str, tuple[Array, Array]] = {}
    for sensor, (first, second, noise, step) in said.items():
        matrix, bias = errors[sensor]
        readings = (first, second @ matrix.T + bias)
        noisy = [reading + rng.normal(0.0, noise, first.shape) for reading in readings]
        counts[sensor] = (np.round(noisy[0] / step).astype(int), np.round(noisy[1] / step).astype(int))
    # About the span from which the monitor takes its pairs, a twentieth of which it leaves out.
    moves = (time > still + 0.4) & (time < still + 0.4 + 12.0 * 20 / 19)
    forces = [each * 1e-4 for each in counts["accelerometer"]]
    rates = [each * 1e-5 for each in counts["gyroscope"]]

    def misses(x: Array) -> Array:
        r = x[12:]
        carried = forces[0] + np.cross(change, r) + np.cross(turning, np.cross(turning, r))
        return ((forces[1] - carried @ x[:9].reshape(3, 3).T - x[9:12])[moves] / force_noise).ravel()

    start = np.concatenate([np.eye(3).ravel(), np.zeros(6)])
    found = least_squares(misses, start, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    columns = np.hstack([rates[0], np.ones((len(time), 1))])[moves]
    fitted, *_ = np.linalg.lstsq(columns, rates[1][moves], rcond=None)
    return {
        "interval_us": 1_000_000 // rate_hz,
        "force_step": 1e-4,
        "rate_step": 1e-5,
        "rest_duration_s": 1.0,
        "collect_s": 12.0,
        "primary_counts": np.hstack([counts["accelerometer"][0], counts["gyroscope"][0]]),
        "secondary_counts": np.hstack([counts["accelerometer"][1], counts["gyroscope"][1]]),
        "accelerometer_M": found.x[:9].reshape(3, 3),
        "accelerometer_b": found.x[9:12],
        "lever_arm": found.x[12:],
        "gyroscope_M": fitted[:3].T,
        "gyroscope_b": fitted[3],
        "events": ["selected", "rest began", "triggered", "rest ended", "motion began", "fitted", "adopted"],
    }


def one_model() -> dict[str, Any]:
    """The parts of a redundant set by one model, and a whole one, as the model in numpy takes them."""
    sys.path.insert(0, str(HERE.parent))
    from benchmarks.flights.model.error import Grade, Information, levers, nothing_known
    from benchmarks.flights.model.means import LeakyMeans
    from benchmarks.flights.model.monitor import flown
    from benchmarks.flights.model.window import HOP, averaged
    from benchmarks.redundancy_set import Samples

    rng = np.random.default_rng(12)
    interval, steps = 0.02, np.repeat([1e-3, 1e-4], 3)

    def samples(stamps: Array, counts: Array) -> Samples:
        readings = counts * steps
        return Samples(stamps, stamps, readings[:, :3], readings[:, 3:])

    # One unit, of which a sample is missing, and two come together.
    stamps = np.round(np.arange(1.0, 3.0, interval) + rng.uniform(0.0, 0.004, 100), 6)
    stamps = np.delete(stamps, 60)
    stamps[80] = stamps[79]
    counts = np.round(np.cumsum(rng.normal(0.0, 300.0, (99, 6)), axis=0)).astype(int)
    index = np.arange(34, 57)
    columns = averaged(samples(stamps, counts), index * HOP)
    names = ("reading", "change", "product", "scatter", "whole", "repeated", "silence")
    window = dict(zip(names, columns[:7], strict=True)) | {"whole": columns[4].astype(int).tolist()}
    window["repeated"] = columns[5].astype(int).tolist()

    values, whole = rng.normal(0.0, 1.0, 60), rng.random(60) > 0.2
    means = LeakyMeans((), 1)
    for value, is_whole in zip(values, whole, strict=True):
        means.take(np.array([value]), np.array(is_whole))

    errors = nothing_known(1, 2, Grade(0.03, 0.042, 0.6, 0.12)).walked(1.0)
    block = Information.none(1, 2)
    rates, forces = rng.normal(0.0, 0.5, (10, 6)), rng.normal(0.0, 2.0, (6, 15))
    one = np.ones((1, 2))
    for row in rates:
        block.add_rate(row[None, :3], np.array([[np.zeros(3), row[3:]]]), one)
    for row in forces:
        lever = levers(row[3:6], row[6:12])
        block.add_force(row[None, :3], lever[None], np.array([[np.zeros(3), row[12:]]]), one)
    learnt = errors.informed(block, one)
    motion = rng.normal(0.0, 1.0, (1, 18))
    lever = levers(motion[:, 9:12], motion[:, 12:])
    variance = [
        *learnt.force_variance(motion[:, :3], lever)[0, 1],
        learnt.rate_variance(motion[:, 3:6])[0, 1],
    ]

    time = np.arange(1.0, 12.0, interval)
    angles = time[:, None] * np.array([1.7, 1.3, 0.9, 1.1, 0.8, 0.6])
    truth = np.sin(angles) * [1.5, 1.2, 2.0, 0.6, 0.5, 0.4] + [0.0, 0.0, GRAVITY, 0.0, 0.0, 0.0]
    units = []
    for unit in range(3):
        readings = truth + rng.normal(0.0, 1.0, truth.shape) * np.repeat([0.02, 0.002], 3)
        if unit == 1:
            readings += [0.1, -0.1, 0.05, 0.01, 0.0, -0.02]
            readings[time > 9.0, 4] += 0.3
        units.append(np.round(readings / steps).astype(int))
    (run,) = flown([[samples(time, each) for each in units]], find_delays=False)
    told = [[round(when * 1e6), unit, what] for when, unit, what, _ in run.events]
    return {
        "force_step": 1e-3,
        "rate_step": 1e-4,
        "window": {
            "stamps_us": np.round(stamps * 1e6).astype(int),
            "counts": counts,
            "index": index,
            **window,
        },
        "means": {
            "values": values,
            "whole": whole.astype(int),
            "mean": means.mean()[:, 0],
            "weight": means.weight,
        },
        "errors": {
            "rates": rates,
            "forces": forces,
            "motion": motion[0],
            "rate_mean": learnt.rate[0, 1],
            "force_mean": learnt.force[0, 1],
            "error": learnt.both(motion)[0, 1],
            "variance": variance,
        },
        "set": {
            "interval_us": round(interval * 1e6),
            "counts": np.hstack(units),
            "events": told,
            "set_rate_mean": run.errors.rate[0, 1],
            "set_force_mean": run.errors.force[0, 1],
        },
    }


def plain(value: object) -> object:
    """Turn arrays into lists, so that JSON takes them."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, list):
        return [plain(each) for each in value]
    return float(value) if isinstance(value, np.floating) else value


@dataclass(frozen=True)
class Vectors:
    """One file: how its cases are made, and the tolerance of each quantity in double and single precision."""

    make: Callable[[], object]
    tolerance: dict[str, tuple[float, float]]


# Some five to ten times the largest difference seen: room for another compiler, none for another formula.
VECTORS = {
    "model": Vectors(
        model,
        {
            "scale": (2e-15, 1e-6),
            "L": (2e-15, 1e-6),
            "Q": (2e-15, 1e-6),
            "non_orthogonality": (1e-15, 2e-7),
            "mounting": (5e-15, 5e-7),
            "y": (2e-14, 5e-6),
            "corrected": (2e-14, 1e-5),
        },
    ),
    "temperature": Vectors(temperature, {"at_reference": (2e-15, 2e-6)}),
    "magnetometer": Vectors(magnetometer, {"field": (2e-13, 5e-5)}),
    "moments": Vectors(moments, {"mean": (2e-14, 5e-6), "variance": (5e-17, 5e-9)}),
    "gravity": Vectors(gravity, {"gravity": (5e-10, 5e-6)}),
    "allan": Vectors(allan, {"averaging": (5e-15, 2e-6), "variance": (2e-19, 5e-11)}),
    # The least squares of scipy stop short of the last digits.
    "sphere": Vectors(sphere, {"bias": (2e-8, 5e-6), "bias_sigma": (1e-9, 1e-9)}),
    "mounting": Vectors(mounting, {"rotation_vector": (5e-14, 5e-6), "bias": (5e-15, 5e-7)}),
    # In units of sigma: good estimators agree to a small part of their uncertainty, not to the last digit.
    "triad": Vectors(triad, {"M": (0.02, 0.02), "b": (0.02, 0.02), "sigma": (2e-4, 2e-4)}),
    # A rest may lose two blocks of 0.1 s at an end; the others are three sigma of the noise put in.
    "stream": Vectors(stream, {"rests_s": (0.2, 0.2), "bias": (1.5e-4, 1.5e-4), "turn_angle": (5e-4, 5e-4)}),
    # In units of sigma, twice what was seen: the core has to find the motion, and averages over blocks. Its
    # sigma of the accelerometer bias is up to 1.5 times as large; over 12 seeds both differ by 0.8 sigma rms.
    "spin": Vectors(
        spin, {"accelerometer_bias": (1.3, 1.3), "gyroscope_bias": (1.0, 1.0), "floor_tilt": (0.2, 0.2)}
    ),
    # Likewise: the core has to find the angular acceleration, and averages over windows.
    "redundancy": Vectors(
        redundancy,
        {
            "accelerometer_M": (0.7, 0.7),
            "accelerometer_b": (0.6, 0.6),
            "lever_arm": (0.2, 0.2),
            "gyroscope_M": (0.6, 0.6),
            "gyroscope_b": (0.4, 0.4),
        },
    ),
    "one_model": Vectors(
        one_model,
        {
            "reading": (8e-12, 1e-5),
            "change": (1e-11, 5e-4),
            "product": (2e-13, 1e-5),
            "scatter": (2e-13, 1e-5),
            "silence": (1e-14, 1e-7),
            "mean": (1e-14, 1e-6),
            "weight": (1e-14, 1e-6),
            "rate_mean": (1e-13, 1e-5),
            "force_mean": (1e-12, 1e-4),
            "error": (1e-12, 1e-4),
            "variance": (1e-12, 1e-5),
            "set_rate_mean": (1e-11, 1e-4),
            "set_force_mean": (1e-11, 2e-3),
        },
    ),
}


def content(vectors: Vectors) -> dict[str, object]:
    """Make what belongs into a file."""
    tolerance = {name: {"f64": double, "f32": single} for name, (double, single) in vectors.tolerance.items()}
    return {"tolerance": tolerance, "cases": plain(vectors.make())}


def text(value: object, indent: str = "") -> str:
    """Write JSON with every row of numbers on a line of its own."""
    deeper = indent + " "
    if isinstance(value, dict):
        parts = [f"{deeper}{json.dumps(key)}: {text(each, deeper)}" for key, each in value.items()]
        return "{\n" + ",\n".join(parts) + f"\n{indent}}}"
    if isinstance(value, list) and any(isinstance(each, list | dict) for each in value):
        return "[\n" + ",\n".join(deeper + text(each, deeper) for each in value) + f"\n{indent}]"
    return json.dumps(value)


def main() -> None:
    """Write one JSON file for each."""
    for name, vectors in VECTORS.items():
        (HERE / f"{name}.json").write_text(text(content(vectors)) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
