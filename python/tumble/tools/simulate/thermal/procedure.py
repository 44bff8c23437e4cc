"""A simulated thermal session: scenario in; samples drawn as they are read, and the drift they hold."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tumble import _core
from tumble.foundation.noise_terms import BIAS_INSTABILITY, TERM_UNITS, WHITE
from tumble.foundation.recording import Chunk, FloatArray, Metadata, Recording
from tumble.foundation.units import TRIADS, Triad
from tumble.tools.simulate.files import ROWS
from tumble.tools.simulate.thermal.scenario import ThermalScenario

TURN_SECONDS = 2.0
"""That a hand takes to turn the unit to its next pose."""
_TURNING = 0.005
"""Share of the fastest pace at which hysteresis passes from one leg to the other."""
_UPS = np.array(
    [[0, 0, 1], [1, 0, 0], [0, 0, -1], [0, 1, 0], [-1, 0, 0], [0, -1, 0]],
    dtype=float,
)
"""Directions that point up, one pose after the other, none opposite to the one before."""


@dataclass(frozen=True, slots=True)
class SimulatedThermal:
    """A unit that warmed and cooled, drawn anew, and alike, each time it is read."""

    scenario: ThermalScenario
    recording: Recording

    @property
    def truth(self) -> dict[str, dict[str, Any]]:
        """Drift of each triad as a calibration file keeps it."""
        return {triad: self._drift(triad) for triad in TRIADS}

    def _drift(self, triad: Triad) -> dict[str, Any]:
        scenario = self.scenario
        scale = scenario.scale if triad == "accelerometer" else ()
        return {
            "reference": scenario.reference,
            "range": [scenario.low, scenario.high],
            "bias": scenario.bias(triad),
            "scale": np.array([[power] * 3 for power in scale]).reshape(-1, 3),
            "hysteresis": np.full(3, scenario.hysteresis(triad)),
        }


def simulate_thermal(scenario: ThermalScenario | None = None, **changes: Any) -> SimulatedThermal:  # noqa: ANN401
    """Simulates a unit that rests while it warms and cools; `changes` are fields of `ThermalScenario`.

    Temperature follows a cosine from `low` to `high` and back, `cycles` times. Its noise is white noise and
    bias instability as of `simulate_static`.

    Raises `ScenarioError`, in one line, where a figure makes no sense.
    """
    scenario = replace(scenario or ThermalScenario(), **changes)
    metadata = Metadata.of_arrays("thermal", serial=f"SIM-{scenario.seed}")
    return SimulatedThermal(scenario, Recording(metadata, lambda: _draw(scenario)))


def _draw(scenario: ThermalScenario) -> Iterator[Chunk]:
    noise = _core.StillNoise(scenario.seed, _coefficients(scenario), scenario.rate_hz, scenario.samples)
    for start in range(0, scenario.samples, ROWS):
        count = min(ROWS, scenario.samples - start)
        drawn = noise.draw(count)
        time = np.arange(start, start + count) / scenario.rate_hz
        temperature, leg = _temperature(scenario, time)
        t = (temperature - scenario.reference)[:, None]
        force, rate = _motion(scenario, time)
        scale = 1.0 + _polynomial(np.array([[power] * 3 for power in scenario.scale]).reshape(-1, 3), t)
        biases = [
            _polynomial(scenario.bias(triad), t) + 0.5 * scenario.hysteresis(triad) * leg[:, None]
            for triad in TRIADS
        ]
        yield Chunk(
            time,
            scale * force + biases[0] + drawn[:, :3],
            rate + biases[1] + drawn[:, 3:],
            _thermometer(scenario, time),
        )


def _coefficients(scenario: ThermalScenario) -> FloatArray:
    """Terms of the noise of the six channels (6, 5), as `StillNoise` takes them."""
    rows: list[FloatArray] = []
    for triad in TRIADS:
        grade = getattr(scenario.unit_grade, triad)
        usual = {WHITE: grade.noise_density, BIAS_INSTABILITY: grade.bias_instability}
        rows += [np.array([usual.get(word, 0.0) for word in TERM_UNITS[triad]])] * 3
    return np.array(rows)


def _temperature(scenario: ThermalScenario, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Temperature of the sensor (n,), degC, and its leg: from -1, cooling, over to 1, warming."""
    half, pace = 0.5 * (scenario.high - scenario.low), 2.0 * np.pi * scenario.cycles / scenario.duration
    return scenario.reference - half * np.cos(pace * time), np.tanh(np.sin(pace * time) / _TURNING)


def _thermometer(scenario: ThermalScenario, time: FloatArray) -> FloatArray:
    """Returns the readings of a thermometer of first order, and of steps, (n,), degC, once it has settled."""
    half, pace = 0.5 * (scenario.high - scenario.low), 2.0 * np.pi * scenario.cycles / scenario.duration
    behind = np.arctan(pace * scenario.lag)
    reading = scenario.reference - half * np.cos(behind) * np.cos(pace * time - behind)
    step = scenario.thermometer_step
    return np.asarray(step * np.round(reading / step) if step > 0.0 else reading)


def _motion(scenario: ThermalScenario, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Specific force (n, 3), m/s^2, and angular rate (n, 3), rad/s, of one pose after the other."""
    each = scenario.duration / scenario.poses
    pose = np.minimum((time / each).astype(int), scenario.poses - 1)
    since = time - each * pose
    angle = 0.25 * np.pi * (1.0 - np.cos(np.pi * np.minimum(since / TURN_SECONDS, 1.0)))
    turning = (pose > 0) & (since < TURN_SECONDS)
    before, after = _UPS[(pose - 1) % len(_UPS)], _UPS[pose % len(_UPS)]
    angle = np.where(turning, angle, 0.5 * np.pi)[:, None]
    up = np.cos(angle) * before + np.sin(angle) * after
    pace = 0.25 * np.pi**2 / TURN_SECONDS * np.sin(np.pi * since / TURN_SECONDS)
    # The up direction in the case rotates opposite to the case.
    rate = np.where(turning, pace, 0.0)[:, None] * np.cross(after, before)
    return scenario.gravity * up, rate


def _polynomial(coefficients: FloatArray, t: FloatArray) -> FloatArray:
    """Sum of powers from 1 (k, 3) of t (n, 1), (n, 3)."""
    powers = t ** np.arange(1, len(coefficients) + 1)
    return np.asarray(powers @ coefficients)
