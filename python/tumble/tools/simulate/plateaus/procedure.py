"""Simulated turntable sessions over temperature: scenario in, sessions of one unit and its truth out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from tumble import _core
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk, FloatArray, Recording
from tumble.foundation.units import TRIADS, CalibratedTriad, Triad
from tumble.tools.simulate.plateaus.scenario import PlateausScenario
from tumble.tools.simulate.turntable.procedure import SimulatedTurntable, simulate_turntable
from tumble.tools.simulate.unit import MagnetometerTruth, SimulatedUnit, TriadTruth

SCATTER = 0.1
"""K of the thermometer, 1 sigma."""
TURN = 55.0
"""deg about the vertical after each pose, so that a magnetometer meets the field from more directions."""


@dataclass(frozen=True)
class SimulatedPlateaus:
    """Sessions of one unit, one at each temperature, and its truth."""

    scenario: PlateausScenario

    @cached_property
    def unit(self) -> SimulatedUnit:
        """The unit at the reference temperature."""
        return _turntable(self.scenario, 0)["target_1"]

    def triad_at(self, triad: CalibratedTriad, session: int) -> tuple[FloatArray, FloatArray]:
        """M (3, 3) and b (3,) of a triad in a session."""
        truth: TriadTruth | MagnetometerTruth = getattr(self.unit, triad)
        scenario = self.scenario
        low, high = min(scenario.temperatures), max(scenario.temperatures)
        share = (scenario.temperatures[session] - scenario.reference) / max(high - low, 1.0)
        turn = _core.rotation_matrix(np.radians([share * scenario.mounting_change_deg, 0.0, 0.0]))
        matrix = (1.0 + scenario.scale_at(triad, session)) * truth.M @ turn
        return matrix, truth.b + scenario.bias_at(triad, session)

    def sessions(self) -> Iterator[SimulatedTurntable]:
        """Yields one session after the other."""
        for number in range(len(self.scenario.temperatures)):
            yield self._session(number)

    def _session(self, number: int) -> SimulatedTurntable:
        """Gives the readings of an own unit of each session the errors of the one unit at its temperature."""
        session = _turntable(self.scenario, number)
        drawn = session["target_1"]
        random = np.random.default_rng([self.scenario.seed, number, 1])
        temperature = self.scenario.temperatures[number] + SCATTER * random.normal(size=len(drawn.samples))
        force, rate = (self._changed(drawn, triad, number) for triad in TRIADS)
        samples = Chunk(drawn.samples.time, force, rate, temperature)
        metadata = replace(drawn.recording.metadata, serial=self.unit.recording.metadata.serial)
        track = self._track(drawn, number)
        read_magnetic = None if track is None else lambda: track
        recording = Recording(metadata, lambda: iter((samples,)), read_magnetic=read_magnetic)
        unit = replace(drawn, samples=samples, recording=recording)
        return replace(session, target_units=(unit,))

    def _track(self, drawn: SimulatedUnit, number: int) -> MagneticTrack | None:
        own, track = drawn.magnetometer, drawn.recording.magnetic
        if own is None or track is None:
            return None
        matrix, bias = self.triad_at("magnetometer", number)
        field = (track.field - own.b) @ np.linalg.inv(own.M).T @ matrix.T + bias
        return replace(track, field=field)

    def _changed(self, drawn: SimulatedUnit, triad: Triad, number: int) -> FloatArray:
        own: TriadTruth = getattr(drawn, triad)
        readings: FloatArray = getattr(drawn.samples, triad)
        matrix, bias = self.triad_at(triad, number)
        return np.asarray((readings - own.b) @ np.linalg.inv(own.M).T @ matrix.T + bias)


def simulate_plateaus(scenario: PlateausScenario | None = None, **changes: Any) -> SimulatedPlateaus:  # noqa: ANN401
    """Plays a scenario; `changes` are fields of `PlateausScenario`, set on top of it or of its defaults.

    Raises `ScenarioError`, in one line, where a figure makes no sense.
    """
    return SimulatedPlateaus(replace(scenario or PlateausScenario(), **changes))


def _turntable(scenario: PlateausScenario, number: int) -> SimulatedTurntable:
    """Session of a unit of that grade at the reference temperature, with noise of its own."""
    seed = int(np.random.default_rng([scenario.seed, number]).integers(2**32))
    return simulate_turntable(
        seed=seed,
        grades=(scenario.grade,),
        rate_hz=scenario.rate_hz,
        rest_seconds=scenario.rest_seconds,
        perfect_reference=True,
        bias_instability=scenario.bias_instability,
        quantisation=False,
        g_sensitivity=False,
        magnetometer=bool(scenario.magnetometer),
        heading_turn_deg=TURN if scenario.magnetometer else 0.0,
    )
