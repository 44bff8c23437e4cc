"""A simulated multi-pose session: one unit, orientations all over the sphere, turns by hand between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tumble.recording import FloatArray, Recording
from tumble.simulate.turntable.procedure import SimulatedTurntable, simulate_turntable
from tumble.simulate.unit import SimulatedUnit
from tumble.turntable.poses import Pose, PoseList

SCATTER = 0.15
"""rad by which a hand misses an orientation it meant."""
HAND: dict[str, Any] = {"turn_rate_dps": 120.0, "turn_acceleration_dps2": 400.0, "heading_turn_deg": 20.0}
"""How a hand turns a unit, as fields of `TurntableScenario`."""


@dataclass(frozen=True, slots=True)
class SimulatedMultipose:
    """A session with its truth."""

    session: SimulatedTurntable
    """The hand as a table that turns one target, the unit."""

    @property
    def unit(self) -> SimulatedUnit:
        """The unit and its truth."""
        return self.session.target_units[0]

    @property
    def recording(self) -> Recording:
        """What it recorded."""
        return self.unit.recording

    @property
    def force_matrix(self) -> FloatArray:
        """(3, 3) M of the accelerometer in its own axes, as a calibration without equipment finds it."""
        return np.asarray(self.unit.accelerometer.K @ self.unit.accelerometer.L)

    @property
    def rate_matrix(self) -> FloatArray:
        """(3, 3) M of the gyroscope in the axes of the accelerometer."""
        return np.asarray(self.unit.gyroscope.M @ self.unit.accelerometer.Q.T)


def simulate_multipose(
    *,
    seed: int = 1,
    orientations: int = 18,
    rest_seconds: float = 4.0,
    grade: str = "consumer",
    **changes: Any,  # noqa: ANN401
) -> SimulatedMultipose:
    """Simulate a unit of a grade, held still `rest_seconds`, s, in each of so many orientations.

    `changes` are further fields of `TurntableScenario`. Raises `ScenarioError`, in one line, where a figure
    makes no sense.
    """
    ups = spread(orientations, np.random.default_rng(seed))
    poses = PoseList(tuple(Pose(f"orientation {k}", up) for k, up in enumerate(ups, start=1)))
    session = simulate_turntable(
        seed=seed, poses=poses, rest_seconds=rest_seconds, grades=(grade,), **{**HAND, **changes}
    )
    return SimulatedMultipose(session)


def spread(count: int, random: np.random.Generator) -> FloatArray:
    """Draw directions (count, 3) that cover the sphere as well as a person's do, in random order."""
    place = np.arange(count) + 0.5
    height, bearing = 1.0 - 2.0 * place / count, np.pi * (3.0 - np.sqrt(5.0)) * place
    across = np.sqrt(1.0 - height**2)
    even = np.column_stack([across * np.cos(bearing), across * np.sin(bearing), height])
    turned, _ = np.linalg.qr(random.normal(size=(3, 3)))
    meant = even @ turned + SCATTER * random.normal(size=(count, 3))
    directions: FloatArray = (meant / np.linalg.norm(meant, axis=1)[:, None])[random.permutation(count)]
    return directions
