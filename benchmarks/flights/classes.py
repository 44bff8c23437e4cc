"""Classes of fault that are put into recorded flights: 22, each of one size, from seeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from benchmarks.redundancy_set import Samples, direction
from tumble.foundation.recording import FloatArray

SPIKING = 0.05
"""Share of the samples that are spikes."""
LOST = 0.6
"""Share of the samples that a bad link loses."""
BEHIND = 0.1
"""s by which a unit that lags is late, of a sudden."""
SHARES = (0.4, 0.6)
"""Shares of a flight between which a fault begins."""

Change: TypeAlias = Callable[[Samples, int, float, np.random.Generator], Samples]
"""Makes samples faulty from an index and a time on, s."""


@dataclass(frozen=True, slots=True)
class FaultClass:
    """A fault of one sensor or unit."""

    name: str
    change: Change

    def inject(self, samples: Samples, start: float, random: np.random.Generator) -> Samples:
        """Returns the samples of a unit with the fault from a time on, s."""
        return self.change(samples, int(np.searchsorted(samples.time, start)), start, random)


def _with(samples: Samples, sensor: str, readings: FloatArray) -> Samples:
    if sensor == "specific_force":
        return replace(samples, specific_force=readings)
    return replace(samples, angular_rate=readings)


def _step(sensor: str, size: float) -> Change:
    def change(samples: Samples, first: int, start: float, random: np.random.Generator) -> Samples:
        readings = getattr(samples, sensor).copy()
        readings[first:] += size * direction(random)
        return _with(samples, sensor, readings)

    return change


def _ramp(sensor: str, slope: float) -> Change:
    def change(samples: Samples, first: int, start: float, random: np.random.Generator) -> Samples:
        readings = getattr(samples, sensor).copy()
        readings[first:] += np.outer(samples.time[first:] - start, slope * direction(random))
        return _with(samples, sensor, readings)

    return change


def _scale(sensor: str, factor: float) -> Change:
    def change(samples: Samples, first: int, start: float, random: np.random.Generator) -> Samples:
        readings = getattr(samples, sensor).copy()
        readings[first:] *= factor
        return _with(samples, sensor, readings)

    return change


def _noise(sensor: str, size: float) -> Change:
    def change(samples: Samples, first: int, start: float, random: np.random.Generator) -> Samples:
        readings = getattr(samples, sensor).copy()
        readings[first:] += size * random.standard_normal(readings[first:].shape)
        return _with(samples, sensor, readings)

    return change


def _spikes(sensor: str, size: float) -> Change:
    def change(samples: Samples, first: int, start: float, random: np.random.Generator) -> Samples:
        readings = getattr(samples, sensor).copy()
        some = (random.random(len(readings) - first) < SPIKING) * random.choice(
            [-1.0, 1.0], len(readings) - first
        )
        readings[first:] += np.outer(some, size * direction(random))
        return _with(samples, sensor, readings)

    return change


def _stuck(sensor: str) -> Change:
    def change(samples: Samples, first: int, start: float, random: np.random.Generator) -> Samples:
        readings, axis = getattr(samples, sensor).copy(), int(random.integers(3))
        readings[first:, axis] = readings[min(first, len(readings) - 1), axis]
        return _with(samples, sensor, readings)

    return change


def _swapped(sensor: str) -> Change:
    def change(samples: Samples, first: int, start: float, random: np.random.Generator) -> Samples:
        readings, axis = getattr(samples, sensor).copy(), int(random.integers(3))
        both = [axis, (axis + 1) % 3]
        readings[first:, both] = readings[first:, both[::-1]]
        return _with(samples, sensor, readings)

    return change


def _frozen(samples: Samples, first: int, start: float, random: np.random.Generator) -> Samples:
    force, rate = samples.specific_force.copy(), samples.angular_rate.copy()
    last = max(first - 1, 0)
    force[first:], rate[first:] = force[last], rate[last]
    return replace(samples, specific_force=force, angular_rate=rate)


def _lagging(samples: Samples, first: int, start: float, random: np.random.Generator) -> Samples:
    """Readings that are older than their stamps."""
    found = []
    for readings in (samples.specific_force, samples.angular_rate):
        readings = readings.copy()
        shifted = [np.interp(samples.time[first:] - BEHIND, samples.time, column) for column in readings.T]
        readings[first:] = np.column_stack(shifted)
        found.append(readings)
    return replace(samples, specific_force=found[0], angular_rate=found[1])


def _kept(samples: Samples, kept: NDArray[np.bool_]) -> Samples:
    return Samples(
        samples.time[kept], samples.arrival[kept], samples.specific_force[kept], samples.angular_rate[kept]
    )


def _lossy(samples: Samples, first: int, start: float, random: np.random.Generator) -> Samples:
    kept = random.random(len(samples.time)) >= LOST
    kept[:first] = True
    return _kept(samples, kept)


def _dead(samples: Samples, first: int, start: float, random: np.random.Generator) -> Samples:
    return _kept(samples, np.arange(len(samples.time)) < first)


_FORCE, _RATE = "specific_force", "angular_rate"
CLASSES: Mapping[str, FaultClass] = {
    each.name: each
    for each in (
        FaultClass("gyroscope step 0.05 rad/s", _step(_RATE, 0.05)),
        FaultClass("gyroscope step 0.2 rad/s", _step(_RATE, 0.2)),
        FaultClass("gyroscope step 1 rad/s", _step(_RATE, 1.0)),
        FaultClass("accelerometer step 0.3 m/s^2", _step(_FORCE, 0.3)),
        FaultClass("accelerometer step 1 m/s^2", _step(_FORCE, 1.0)),
        FaultClass("accelerometer step 5 m/s^2", _step(_FORCE, 5.0)),
        FaultClass("gyroscope ramp 0.01 rad/s^2", _ramp(_RATE, 0.01)),
        FaultClass("accelerometer ramp 0.1 m/s^3", _ramp(_FORCE, 0.1)),
        FaultClass("gyroscope scale 1.3", _scale(_RATE, 1.3)),
        FaultClass("accelerometer scale 1.1", _scale(_FORCE, 1.1)),
        FaultClass("gyroscope noise 1 rad/s", _noise(_RATE, 1.0)),
        FaultClass("accelerometer noise 10 m/s^2", _noise(_FORCE, 10.0)),
        FaultClass("gyroscope spikes 10 rad/s", _spikes(_RATE, 10.0)),
        FaultClass("accelerometer spikes 60 m/s^2", _spikes(_FORCE, 60.0)),
        FaultClass("gyroscope axis stuck", _stuck(_RATE)),
        FaultClass("accelerometer axis stuck", _stuck(_FORCE)),
        FaultClass("gyroscope of wrong sign", _scale(_RATE, -1.0)),
        FaultClass("accelerometer axes swapped", _swapped(_FORCE)),
        FaultClass("unit frozen", _frozen),
        FaultClass("unit lags 0.1 s", _lagging),
        FaultClass("unit loses 60 % of its samples", _lossy),
        FaultClass("unit dead", _dead),
    )
}
"""By name, in the order of the table."""
