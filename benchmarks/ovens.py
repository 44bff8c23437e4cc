"""Sessions in an oven by numpy alone: warming and cooling that differ, and a thermometer that lags."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray, Recording

SECONDS, RATE = 3600.0, 2.0
SCATTER = 5e-3
"""m/s^2 a sample."""
GYROSCOPE_SCATTER = 3e-4
"""rad/s a sample."""
LOOPS = {"lens": (0.09, 0.06), "constant": (0.03, 0.03), "none": (0.0, 0.0)}
"""Largest and mean difference of warming and cooling of accelerometer z, m/s^2."""
SHAPES: Mapping[str, Callable[[FloatArray], FloatArray]] = {
    "lens": lambda x: 0.045 * (1.0 - x**2),
    "constant": lambda x: np.full_like(x, 0.015),
    "faint": lambda x: np.full_like(x, 7.5e-4),
    "none": np.zeros_like,
}
"""Half the difference over x, which runs from -1 to 1 over the range."""


def oven(
    seed: int,
    loop: str = "none",
    lag: float = 0.0,
    bias: Sequence[float] = (0.1, 0.05, -0.2),
    gyroscope: float = 0.05,
    jump: float = 0.0,
    wander: float = 0.0,
) -> Recording:
    """Simulates a unit that warms from -10 to 60 degC and cools again at an even pace.

    `loop` is that of accelerometer z, `lag` the time constant of the thermometer, s. `bias` is the drift of
    the accelerometer over half the range, m/s^2, and `jump` a step of it; the gyroscope drifts `gyroscope`
    times as much, rad/s. `wander` is the bias instability of each axis over its white noise,
    1/sqrt(s).
    """
    rng = np.random.default_rng(seed)
    time = np.arange(round(SECONDS * RATE)) / RATE
    temperature = 60.0 - 70.0 * np.abs(2.0 * time / SECONDS - 1.0)
    leg = np.where(time < 0.5 * SECONDS, 1.0, -1.0)
    x = (temperature - 25.0) / 35.0
    drift = x[:, None] * np.array(bias)
    drift[:, 2] += leg * SHAPES[loop](x)
    drift += jump * (time > 1000.0)[:, None]
    reading = np.array(temperature)
    if lag:
        for k in range(1, len(reading)):
            reading[k] = reading[k - 1] + (temperature[k] - reading[k - 1]) / (lag * RATE)
    scatter = np.array([SCATTER] * 3 + [GYROSCOPE_SCATTER] * 3)
    noise = scatter * np.hstack([rng.normal(size=drift.shape), rng.normal(size=drift.shape)])
    if wander:
        density = scatter / np.sqrt(RATE)
        terms = np.column_stack([0 * density, density, wander * density, 0 * density, 0 * density])
        noise = _core.StillNoise(seed, terms, RATE, len(time)).draw(len(time))
    return Recording.from_arrays(
        "oven",
        time,
        drift + [0.0, 0.0, 9.8] + noise[:, :3],
        gyroscope * x[:, None] * np.array(bias) + noise[:, 3:],
        temperature=reading,
    )
