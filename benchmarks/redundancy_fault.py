"""Faults put into the readings of a unit, simulated or recorded."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from benchmarks.redundancy_set import SENSORS, Samples, direction
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName

Kind = Literal[
    "jump",
    "ramp",
    "scale",
    "noise",
    "stuck",
    "frozen",
    "swapped axes",
    "spikes",
    "wrong sign",
    "dead",
    "late",
    "not a number",
    "duplicated",
]
KINDS: tuple[Kind, ...] = get_args(Kind)

SIZES: dict[Kind, tuple[tuple[float, float], tuple[float, float]]] = {
    "jump": ((0.2, 5.0), (0.02, 0.5)),
    "ramp": ((0.3, 3.0), (0.03, 0.3)),
    "scale": ((0.05, 0.3), (0.05, 0.3)),
    "noise": ((0.5, 20.0), (0.05, 5.0)),
    "spikes": ((20.0, 100.0), (3.0, 20.0)),
    "late": ((0.15, 1.0), (0.15, 1.0)),
}
"""Least and most, of accelerometer and of gyroscope, drawn evenly in logarithm: m/s^2 and rad/s; of a scale
its distance from one, either way; s by which samples arrive late."""
RAMP_SECONDS = (60.0, 120.0)
"""s in which a ramp reaches its size, where it stays."""
SPIKING = 0.05
"""Share of the samples that are spikes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InjectedFault:
    """One fault of one sensor, or of the whole unit where it is of its clock or its link."""

    kind: Kind
    sensor: TriadName
    start: float
    """s of arrival."""
    size: float = 0.0
    seconds: float = 0.0
    """Duration of a ramp."""
    direction: FloatArray
    """(3,) of a jump, ramp or spike."""
    axis: int
    seed: int

    def inject(self, samples: Samples) -> Samples:
        """Returns the samples of the unit from then on, and before."""
        after = samples.arrival >= self.start
        if self.kind == "dead":
            kept = ~after
            return Samples(
                samples.time[kept],
                samples.arrival[kept],
                samples.specific_force[kept],
                samples.angular_rate[kept],
            )
        if self.kind == "late":
            return replace(samples, arrival=samples.arrival + np.where(after, self.size, 0.0))
        first = int(np.argmax(after))
        if self.kind == "frozen":
            force, rate = samples.specific_force.copy(), samples.angular_rate.copy()
            force[first:], rate[first:] = force[first], rate[first]
            return replace(samples, specific_force=force, angular_rate=rate)
        if self.kind == "duplicated":
            return _duplicated(samples, first)
        readings = samples.of(self.sensor).copy()
        readings[first:] = self._spoilt(samples.arrival[first:] - self.start, readings[first:])
        channel = "specific_force" if self.sensor == "accelerometer" else "angular_rate"
        return replace(samples, **{channel: readings})

    def _spoilt(self, since: FloatArray, readings: FloatArray) -> FloatArray:
        """Returns readings (n, 3) that are wrong; (n,) s since the start."""
        random = np.random.default_rng(self.seed)
        if self.kind == "jump":
            return readings + self.size * self.direction
        if self.kind == "ramp":
            grown = np.minimum(since / self.seconds, 1.0)
            return readings + np.outer(grown, self.size * self.direction)
        if self.kind == "scale":
            return np.asarray(readings * (1.0 + self.size))
        if self.kind == "noise":
            return readings + self.size * random.standard_normal(readings.shape)
        if self.kind == "spikes":
            some = random.random(len(readings)) < SPIKING
            signs = random.choice([-1.0, 1.0], len(some))
            return readings + np.outer(some * signs, self.size * self.direction)
        if self.kind == "wrong sign":
            return -readings
        wrong = readings.copy()
        if self.kind == "swapped axes":
            other = (self.axis + 1) % 3
            wrong[:, [self.axis, other]] = readings[:, [other, self.axis]]
        else:
            wrong[:, self.axis] = readings[0, self.axis] if self.kind == "stuck" else np.nan
        return np.asarray(wrong)


def _duplicated(samples: Samples, first: int) -> Samples:
    """Returns every second sample, from one on, with the readings of the one before it."""
    force, rate = samples.specific_force.copy(), samples.angular_rate.copy()
    for readings in (force, rate):
        copies = readings[first + 1 :: 2]
        copies[:] = readings[first::2][: len(copies)]
    return replace(samples, specific_force=force, angular_rate=rate)


def draw_fault(random: np.random.Generator, kind: Kind, start: float, least: float = 0.0) -> InjectedFault:
    """Draws a fault of a kind; `least` m/s^2, a tenth of it in rad/s, bounds the size of a jump or a ramp."""
    index = int(random.integers(2))
    size = 0.0
    if kind in SIZES:
        low, high = SIZES[kind][index]
        if kind in ("jump", "ramp"):
            low = max(low, least * (1.0 if index == 0 else 0.1))
        size = float(np.exp(random.uniform(np.log(low), np.log(high))))
    if kind == "scale":
        size *= float(random.choice([-1.0, 1.0]))
    return InjectedFault(
        kind=kind,
        sensor=SENSORS[index],
        start=start,
        size=size,
        seconds=float(random.uniform(*RAMP_SECONDS)),
        direction=direction(random),
        axis=int(random.integers(3)),
        seed=int(random.integers(2**32)),
    )
