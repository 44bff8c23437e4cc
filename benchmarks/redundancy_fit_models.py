"""The fit models in numbers: 60 s of motion, a secondary wrong by 0.3 m/s^2 and 1 % beside its primary.

Motion and readings are made in numpy, independent of the core and its simulator: sums of sines below 1 Hz,
1 m/s^2 and 0.3 rad/s root mean square an axis, as the table of the design has it; sampled at instants, with
white noise, and no other error of the primary.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tumble import _core
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray

RATE_HZ = 200.0
REST_SECONDS = 6.0
MOTION_SECONDS = 66.0
"""Duration of the motion, of which 60 s are collected."""
RAMP_SECONDS = 1.0
GRAVITY = STANDARD_GRAVITY
FORCE_NOISE = (0.01, 0.02)
"""m/s^2 a sample, of the primary and of the secondary."""
RATE_NOISE = (0.002, 0.004)
"""rad/s a sample."""
BIAS = 0.3
"""m/s^2, in any direction."""
MATRIX_SIGMA = 0.01
"""Sigma of each element of M."""
RATE_BIAS_SIGMA = 0.02
"""rad/s, of each axis of the secondary's gyroscope."""
SINES = 12
HIGHEST_HZ = 1.0
FORCE_SIZE = 1.0
RATE_SIZE = 0.3
SETTINGS: dict[str, object] = {"collect": 60.0, "improvement": 0.0, "excitation_lever_arm": 0.5}
"""All else as by default. The motion of the table is gentler than a lever arm is asked for by default."""


@dataclass(frozen=True, slots=True)
class Pair:
    """A primary and a secondary in motion, and what is true of the secondary's accelerometer."""

    time: FloatArray
    specific_forces: tuple[FloatArray, FloatArray]
    angular_rates: tuple[FloatArray, FloatArray]
    moving: npt.NDArray[np.bool_]
    """(n,) whether pairs could be collected."""
    force: FloatArray
    """(n, 3) true at the primary."""
    rate: FloatArray
    angular_acceleration: FloatArray
    matrix: FloatArray
    bias: FloatArray
    arm: FloatArray

    def left(self, matrix: FloatArray, bias: FloatArray, arm: FloatArray) -> float:
        """Returns the root mean square over the motion of the norm of what an error found leaves."""
        true = _elsewhere(self.force, self.rate, self.angular_acceleration, self.arm)
        said = np.linalg.solve(matrix, (true @ self.matrix.T + self.bias - bias).T).T
        moved = _elsewhere(self.force, self.rate, self.angular_acceleration, arm)
        error = (said - moved)[self.moving]
        return float(np.sqrt(np.mean(np.sum(error**2, axis=1))))


def draw_pair(random: np.random.Generator, distance: float) -> Pair:
    """Draws motion, errors and noise of two units that far apart, m."""
    time = np.arange(round((REST_SECONDS + MOTION_SECONDS) * RATE_HZ)) / RATE_HZ
    since = np.maximum(time - REST_SECONDS, 0.0)
    share = np.minimum(since / RAMP_SECONDS, 1.0)
    ramp = (share**2 * (3.0 - 2.0 * share))[:, None]
    slope = np.where(since < RAMP_SECONDS, 6.0 * share * (1.0 - share) / RAMP_SECONDS, 0.0)[:, None]
    rate, change = _sines(random, since, RATE_SIZE)
    force = np.array([0.0, 0.0, GRAVITY]) + ramp * _sines(random, since, FORCE_SIZE)[0]
    angular_acceleration = ramp * change + slope * rate
    rate = ramp * rate
    arm, bias = (size * _direction(random) for size in (distance, BIAS))
    matrix, rate_matrix = (np.eye(3) + random.normal(0.0, MATRIX_SIGMA, (3, 3)) for _ in range(2))
    there = _elsewhere(force, rate, angular_acceleration, arm) @ matrix.T + bias
    turned = rate @ rate_matrix.T + random.normal(0.0, RATE_BIAS_SIGMA, 3)
    return Pair(
        time=time,
        specific_forces=(_noisy(random, force, FORCE_NOISE[0]), _noisy(random, there, FORCE_NOISE[1])),
        angular_rates=(_noisy(random, rate, RATE_NOISE[0]), _noisy(random, turned, RATE_NOISE[1])),
        moving=time > REST_SECONDS + RAMP_SECONDS,
        force=force,
        rate=rate,
        angular_acceleration=angular_acceleration,
        matrix=matrix,
        bias=bias,
        arm=arm,
    )


def calibrate(pair: Pair, largest_fit_model: str, precision: str = "f64") -> dict[str, object] | None:
    """Returns the record of the accelerometer that the monitor adopts, or `None`."""
    units = [_core.RedundancyUnit(1), _core.RedundancyUnit(2)]
    monitor = _core.RedundancyMonitor(units, {**SETTINGS, "largest_fit_model": largest_fit_model}, precision)
    monitor.replay([pair.time] * 2, list(pair.specific_forces), list(pair.angular_rates))
    return next((record for record in monitor.records() if record["sensor"] == "accelerometer"), None)


def _sines(random: np.random.Generator, time: FloatArray, size: float) -> tuple[FloatArray, FloatArray]:
    """Three channels (n, 3) of sines, and their derivative."""
    shape = (SINES, 3)
    pulsation = 2.0 * np.pi * random.uniform(0.2, HIGHEST_HZ, shape)
    amplitude = size * np.sqrt(2.0 / SINES)
    angle = pulsation * time[:, None, None] + random.uniform(0.0, 2.0 * np.pi, shape)
    value = (amplitude * np.sin(angle)).sum(axis=1)
    return value, (amplitude * pulsation * np.cos(angle)).sum(axis=1)


def _direction(random: np.random.Generator) -> FloatArray:
    drawn = random.standard_normal(3)
    return np.asarray(drawn / np.linalg.norm(drawn))


def _elsewhere(force: FloatArray, rate: FloatArray, change: FloatArray, arm: FloatArray) -> FloatArray:
    return np.asarray(force + np.cross(change, arm) + np.cross(rate, np.cross(rate, arm)))


def _noisy(random: np.random.Generator, values: FloatArray, sigma: float) -> FloatArray:
    return np.asarray(values + sigma * random.standard_normal(values.shape))
