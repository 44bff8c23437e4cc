"""A hand that holds a unit and turns it on request, or to one orientation after another."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.tools.simulate.live.fault import LiveFault
from tumble.tools.simulate.live.playback import ROBOT
from tumble.tools.simulate.live.scenario import LiveScenario
from tumble.tools.simulate.live.table_units import Noise, TableUnit, units_on
from tumble.tools.simulate.multipose.procedure import HAND, SCATTER, SimulatedMultipose, spread
from tumble.tools.table.axes import FREE, Axis
from tumble.tools.table.simulated import SimulatedTable

JOINTS = (Axis("wrist", (1.0, 0.0, 0.0), FREE), Axis("fingers", (0.0, 0.0, 1.0), FREE))
"""Two axes, which reach every orientation; the first carries the other."""
ORIENTATIONS = 24
"""Number of orientations to which it turns without requests."""
TARGET = "target_1"
"""Name of the unit among those that the simulator of sessions draws."""


class Hand:
    """Turns a unit as a person does, and misses a little; `advance` has to be called now and then.

    `joints` are a table of `JOINTS`. Unless it is `told` by `go_to`, it rests for `rest` s in each of
    `ORIENTATIONS`.
    """

    def __init__(self, joints: SimulatedTable, scenario: LiveScenario, joints_from_own: FloatArray) -> None:
        self._joints = joints
        self._joints_from_own = joints_from_own
        self._rest = scenario.rest_seconds
        self._random = np.random.default_rng([scenario.seed, *b"hand"])
        self._left = [] if scenario.told else list(spread(ORIENTATIONS, self._random))
        self._told = scenario.told
        self._rested_since = 0.0

    def go_to(self, up: FloatArray) -> None:
        """Turns the unit so that about this direction (3,) of its own axes points up."""
        meant = self._joints_from_own @ up + SCATTER * self._random.normal(size=3)
        x, y, z = meant / np.linalg.norm(meant)
        wrist, fingers = math.acos(z), math.atan2(x, y)
        at = self._joints.position()
        # Either way over, whichever is nearer.
        ways = [np.array([side * wrist, fingers + (0.0 if side > 0 else math.pi)]) for side in (1.0, -1.0)]
        ways = [at + (way - at + math.pi) % (2.0 * math.pi) - math.pi for way in ways]
        angles = min(ways, key=lambda way: float(np.abs(way - at).max()))
        rate, acceleration = (
            np.full(2, math.radians(HAND[name])) for name in ("turn_rate_dps", "turn_acceleration_dps2")
        )
        self._joints.goto(angles, rate, acceleration)

    def advance(self, now: float) -> bool:
        """Turns where it is time to, `now` in s of the bench's clock; whether it will ever turn again."""
        if self._told or not self._joints.settled():
            self._rested_since = now
            return True
        if now - self._rested_since < self._rest:
            return True
        if not self._left:
            return False
        self.go_to(self._left.pop())
        self._rested_since = now
        return True


def unit_in_hand(
    joints: SimulatedTable, scenario: LiveScenario, faults: Mapping[str, tuple[LiveFault, ...]]
) -> tuple[SimulatedMultipose, TableUnit, Noise]:
    """Puts a unit into a hand; returns the session it was drawn in, its feed, and its noise to close."""
    pair = replace(scenario, grades=("reference", scenario.usual_grades[0]), motion="table", faults={})
    session, feeds, noise = units_on(joints, pair, {TARGET: faults.get(ROBOT, ())})
    return SimulatedMultipose(session), feeds[TARGET], noise


def joints_from_own(found: SimulatedMultipose) -> FloatArray:
    """Returns the rotation (3, 3) from the accelerometer's own axes to the frame of the joints."""
    turned: FloatArray = found.session.R_e.T @ np.asarray(found.unit.accelerometer.Q).T
    return turned
