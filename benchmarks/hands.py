"""A tremor of the hand, put into simulated rests that lay still."""

from __future__ import annotations

import numpy as np

from tumble import Recording

RAMP = 0.3
"""s in which a tremor begins and ends."""


def trembling(hand, shaken, *, amplitude=8.7e-4, frequency=8.0, lever_arm=(0.1, 0.05, 0.03), seed=0):
    """Give the recording of a simulated session in which the rests `shaken`, (start, end) s, tremble.

    Amplitude in rad about each axis; the turning centre is `lever_arm` m away.
    """
    samples, unit = hand.unit.samples, hand.unit
    time = samples.time
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 3)
    angle, rate, acceleration = (np.zeros((len(time), 3)) for _ in range(3))
    omega = 2.0 * np.pi * frequency
    for start, end in shaken:
        envelope, slope = _envelope(time, start, end)
        bend = np.gradient(slope, time)
        wave, turned = np.sin(omega * time[:, None] + phases), np.cos(omega * time[:, None] + phases)
        e, s, b = envelope[:, None], slope[:, None], bend[:, None]
        angle += amplitude * e * wave
        rate += amplitude * (s * wave + omega * e * turned)
        acceleration += amplitude * (b * wave + 2.0 * omega * s * turned - omega**2 * e * wave)
    true_force = np.linalg.solve(unit.accelerometer.M, (samples.accelerometer - unit.accelerometer.b).T).T
    arm = np.asarray(lever_arm)
    felt = -np.cross(angle, true_force) + np.cross(acceleration, arm) + np.cross(rate, np.cross(rate, arm))
    return Recording.from_arrays(
        "trembling",
        time,
        samples.accelerometer + felt @ unit.accelerometer.M.T,
        samples.gyroscope + rate @ unit.gyroscope.M.T,
    )


def _envelope(time, start, end):
    """Rise from 0 to 1 and fall again within a rest, and the slope of that."""
    x = np.clip(np.minimum(time - start, end - time) / RAMP, 0.0, 1.0)
    sign = np.where(time < 0.5 * (start + end), 1.0, -1.0)
    return x**2 * (3.0 - 2.0 * x), np.where((x > 0) & (x < 1), sign * 6.0 * x * (1.0 - x) / RAMP, 0.0)
