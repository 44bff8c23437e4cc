"""A simulated record at rest: scenario in; samples drawn as they are read, and the terms they are made of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tumble import _core
from tumble.foundation.recording import Chunk, FloatArray, Metadata, Recording
from tumble.foundation.units import TRIADS
from tumble.tools.simulate.files import ROWS
from tumble.tools.simulate.static.scenario import StaticScenario


@dataclass(frozen=True, slots=True)
class SimulatedStatic:
    """A unit that stood still, drawn anew, and alike, each time it is read."""

    scenario: StaticScenario
    recording: Recording

    @property
    def truth(self) -> dict[str, dict[str, float]]:
        """Coefficients of each triad by the words of their terms, units as `tumble noise` states them."""
        return {triad: self.scenario.coefficients(triad) for triad in TRIADS}


def simulate_static(scenario: StaticScenario | None = None, **changes: Any) -> SimulatedStatic:  # noqa: ANN401
    """Simulates a record at rest; `changes` are fields of `StaticScenario`, set on top of it or its defaults.

    Its noise has exactly the Allan variance of its terms: white noise, random walk, quantisation and ramp at
    all averaging times; bias instability, made of first-order Gauss-Markov processes, within 0.5 % from
    averages of four samples on.

    Raises `ScenarioError`, in one line, where a figure makes no sense.
    """
    scenario = replace(scenario or StaticScenario(), **changes)
    metadata = Metadata.of_arrays("static", serial=f"SIM-{scenario.seed}")
    return SimulatedStatic(scenario, Recording(metadata, lambda: _draw(scenario)))


def _draw(scenario: StaticScenario) -> Iterator[Chunk]:
    rows: list[FloatArray] = []
    for triad in TRIADS:
        rows += [np.array(list(scenario.coefficients(triad).values()))] * 3
    source = _core.StillNoise(scenario.seed, np.array(rows), scenario.rate_hz, scenario.samples)
    level = np.array([0.0, 0.0, scenario.gravity])
    for start in range(0, scenario.samples, ROWS):
        count = min(ROWS, scenario.samples - start)
        noise = source.draw(count)
        time = np.arange(start, start + count) / scenario.rate_hz
        kept = np.ones(count, dtype=bool)
        for begin, end in scenario.gaps:
            kept &= ~((time >= begin) & (time < end))
        if kept.any():
            yield Chunk(time[kept], noise[kept, :3] + level, noise[kept, 3:])
