"""Sessions in the hand whose rests tremble: a tremor of known size, put into rests that lay still."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import tumble
from tumble.foundation.recording import FloatArray, Recording
from tumble.tools.simulate import SimulatedMultipose, simulate_multipose

RAMP = 0.3
"""s in which a tremor begins and ends."""
OWN = [0, 3, 4, 6, 7, 8, 9, 10, 11]
"""Elements of M and b of an accelerometer that a session in the hand fits: M is a lower triangle."""
Span = tuple[float, float]


def session(seed: int, orientations: int = 18) -> tuple[SimulatedMultipose, list[Span]]:
    """Simulates a session of white noise alone; returns it with (start, end), s, of each used rest."""
    hand = simulate_multipose(
        seed=seed, orientations=orientations, bias_instability=False, g_sensitivity=False, latitude_deg=None
    )
    rests = tumble.multipose(hand.recording).rests
    return hand, [(rest.start, rest.end) for rest in rests if rest.used]


def sigmas_off(found: tumble.MultiposeResult, hand: SimulatedMultipose) -> tuple[FloatArray, FloatArray]:
    """Errors of the accelerometer (9,) and of the gyroscope (12,), each over its stated sigma."""
    assert found.gyroscope is not None
    force = np.append(
        found.accelerometer.M - hand.force_matrix, found.accelerometer.b - hand.unit.accelerometer.b
    )
    rate = np.append(found.gyroscope.M - hand.rate_matrix, found.gyroscope.b - hand.unit.gyroscope.b)
    sigmas = (np.sqrt(np.diag(each.covariance)) for each in (found.accelerometer, found.gyroscope))
    of_force, of_rate = sigmas
    return force[OWN] / of_force[OWN], rate / of_rate


def trembling(
    hand: SimulatedMultipose,
    shaken: Sequence[Span],
    *,
    amplitude: float = 8.7e-4,
    frequency: float = 8.0,
    lever_arm: Sequence[float] = (0.1, 0.05, 0.03),
    seed: int = 0,
) -> Recording:
    """Returns the recording of a simulated session in which the rests `shaken`, (start, end) s, tremble.

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


def _envelope(time: FloatArray, start: float, end: float) -> tuple[FloatArray, FloatArray]:
    """Returns an envelope that rises from 0 to 1 and falls again within a rest, and its slope."""
    x = np.clip(np.minimum(time - start, end - time) / RAMP, 0.0, 1.0)
    sign = np.where(time < 0.5 * (start + end), 1.0, -1.0)
    return x**2 * (3.0 - 2.0 * x), np.where((x > 0) & (x < 1), sign * 6.0 * x * (1.0 - x) / RAMP, 0.0)
