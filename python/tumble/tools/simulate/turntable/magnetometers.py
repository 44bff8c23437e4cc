"""Simulated magnetometers on a turntable: the Earth's field at each sample, as each unit reads it."""

from __future__ import annotations

import numpy as np

from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import FloatArray
from tumble.tools.simulate.turntable.scenario import REFERENCE, TurntableScenario
from tumble.tools.simulate.unit import MagnetometerTruth

STEP = 0.15
"""uT of one count of a usual magnetometer."""
MAGNET = np.array([6.0, -4.0, 5.0])
"""uT of a magnet that is near at a disturbed rest, in the case."""
SOFT_IRON, HARD_IRON = 0.06, 30.0
"""1-sigma of an element of M, and of b in uT, of a target."""
OF_REFERENCE = 0.05
"""Errors of the magnetometer of a reference over those of a target."""


def fields_of(scenario: TurntableScenario) -> list[FloatArray]:
    """(3,) uT of each unit in the level frame: east, north, up."""
    dip = np.radians(scenario.dip_deg)
    field = scenario.field_strength * np.array([0.0, np.cos(dip), -np.sin(dip)])
    at_targets = field + np.array([scenario.field_difference, 0.0, 0.0])
    return [field if name == REFERENCE else at_targets for name in scenario.unit_names]


def magnetometer_of(
    scenario: TurntableScenario, name: str, time: FloatArray, field: FloatArray, disturbed: FloatArray
) -> tuple[MagneticTrack, MagnetometerTruth]:
    """Draws the magnetometer of a unit, and lets it read (n, 3) uT at (n,) s.

    `disturbed` (n,) is 1 near a magnet.
    """
    random = np.random.default_rng([scenario.seed, scenario.unit_names.index(name)])
    share = OF_REFERENCE if name == REFERENCE else 1.0
    matrix = np.eye(3) + share * SOFT_IRON * random.normal(size=(3, 3))
    bias = share * HARD_IRON * random.normal(size=3)
    if name == REFERENCE and scenario.perfect_reference:
        matrix = np.eye(3)
    seen = field + np.outer(disturbed, MAGNET)
    readings = seen @ matrix.T + bias + random.normal(0.0, scenario.field_noise, field.shape)
    if scenario.quantisation:
        readings = STEP * np.round(readings / STEP)
    return MagneticTrack(time, readings), MagnetometerTruth(matrix, bias)
