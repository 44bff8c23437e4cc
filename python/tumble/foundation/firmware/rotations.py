"""Rotations by number, as PX4 and ArduPilot share them: MAV_SENSOR_ORIENTATION and what they added to it."""

from __future__ import annotations

import numpy as np

from tumble.foundation.recording import FloatArray

_ANGLES = (
    (0, 0, 0), (0, 0, 45), (0, 0, 90), (0, 0, 135), (0, 0, 180), (0, 0, 225), (0, 0, 270), (0, 0, 315),
    (180, 0, 0), (180, 0, 45), (180, 0, 90), (180, 0, 135), (0, 180, 0), (180, 0, 225), (180, 0, 270),
    (180, 0, 315), (90, 0, 0), (90, 0, 45), (90, 0, 90), (90, 0, 135), (270, 0, 0), (270, 0, 45),
    (270, 0, 90), (270, 0, 135), (0, 90, 0), (0, 270, 0), (0, 180, 90), (0, 180, 270), (90, 90, 0),
    (180, 90, 0), (270, 90, 0), (90, 180, 0), (270, 180, 0), (90, 270, 0), (180, 270, 0), (270, 270, 0),
    (90, 180, 90), (90, 0, 270), (90, 68, 293), (0, 315, 0), (90, 315, 0),
)  # fmt: skip
"""Roll, pitch and yaw, degrees, by number."""


def rotation(number: int) -> FloatArray:
    """Returns (3, 3) body_from_sensor; raises `KeyError` for a number that only one of them knows."""
    if not 0 <= number < len(_ANGLES):
        raise KeyError(number)
    # Right angles come out exact, as the firmware turns them without a matrix.
    matrix = from_euler(*_ANGLES[number])
    whole = np.round(matrix)
    return np.where(np.abs(matrix - whole) < 1e-12, whole, matrix)


def to_euler(matrix: FloatArray) -> tuple[float, float, float]:
    """Returns roll, pitch and yaw, degrees, of a rotation (3, 3), turned about z, then y, then x."""
    roll = np.arctan2(matrix[2, 1], matrix[2, 2])
    pitch = -np.arcsin(np.clip(matrix[2, 0], -1.0, 1.0))
    yaw = np.arctan2(matrix[1, 0], matrix[0, 0])
    return float(np.degrees(roll)), float(np.degrees(pitch)), float(np.degrees(yaw))


def from_euler(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Returns (3, 3) of angles in degrees, turned about z, then y, then x."""
    angles = np.radians([roll, pitch, yaw])
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
