"""The recording of eight IMUs on one board: the statements of its makers, and the readings of the units.

Turned to twenty rests, then from `SHAKING` s on shaken by hand beyond its range; no unit is calibrated.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq  # type: ignore[import-untyped]

from benchmarks.redundancy_set import Samples
from tumble import _core
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray

FOLDER = Path(__file__).parents[2] / "shared" / "data" / "mimu4444"
LOG = FOLDER / "exp_3.parquet"
ABSENT = "the recordings in ../shared/data are not here"
NUMBERS = range(1, 9)
FACING_DOWN = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Case from sensor of units of even numbers, which sit on the other side of the board."""
SPECIFIC_FORCE_RANGE = 15.98 * STANDARD_GRAVITY
ANGULAR_RATE_RANGE = float(np.radians(1998.0))
SHAKING = 490.0
"""s from which on the board is shaken by hand, at first without and then with saturation."""
SETTINGS: dict[str, object] = {
    "primary_accelerometer_threshold": 0.8,
    "primary_gyroscope_threshold": 0.2,
    "collect": 20.0,
    "evaluate_every": 20.0,
}
"""Norms at rest stray by 0.6 m/s^2 from gravity: the primary is taken as it is. Turns between the rests are
short, so that 20 s of motion take 400 s."""


def is_here() -> bool:
    """Returns whether the recording exists."""
    return LOG.is_file()


def turn(number: int) -> FloatArray:
    """Returns the case from the sensor (3, 3) of a unit."""
    return np.eye(3) if number % 2 else FACING_DOWN


def places() -> FloatArray:
    """Returns where the units are (8, 3) m, in the case frame."""
    table = np.loadtxt(FOLDER / "IMU_positions.csv", delimiter=",", skiprows=1, usecols=range(1, 9))
    return np.asarray(table.T)


def sensor_from_primary(number: int, primary: int) -> FloatArray:
    """Returns the rotation (3, 3) to a unit from a primary."""
    return np.asarray(turn(number).T @ turn(primary))


def lever_arm(number: int, primary: int) -> FloatArray:
    """Returns where a unit is (3,) m, seen from a primary."""
    at = places()
    return np.asarray(turn(primary).T @ (at[number - 1] - at[primary - 1]))


def told(numbers: Sequence[int]) -> list[_core.RedundancyUnit]:
    """Describes a set of these units, the first the primary, for a monitor."""
    primary = numbers[0]
    return [
        _core.RedundancyUnit(
            index + 1,
            sensor_from_primary=np.ascontiguousarray(sensor_from_primary(number, primary)) if index else None,
            lever_arm=lever_arm(number, primary) if index else None,
            specific_force_range=SPECIFIC_FORCE_RANGE,
            angular_rate_range=ANGULAR_RATE_RANGE,
        )
        for index, number in enumerate(numbers)
    ]


def recorded() -> dict[int, Samples]:
    """Reads the samples of each unit; all have one clock."""
    table = pq.read_table(LOG)
    column = {name: np.asarray(table[name], dtype=float) for name in table.column_names}
    time = column["time"]
    return {
        number: Samples(
            time,
            time,
            *(
                np.column_stack([column[f"imu{number}_{sensor}{axis}"] for axis in "xyz"])
                for sensor in ("a", "g")
            ),
        )
        for number in NUMBERS
    }
