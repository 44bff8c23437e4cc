"""Axes of a table from the floor up, and their limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray


@dataclass(frozen=True, slots=True)
class AxisLimits:
    """Limits of an axis."""

    rate: float
    """rad/s, either way."""
    acceleration: float
    """rad/s^2, either way."""
    angle: tuple[float, float] | None = None
    """rad, lowest and highest; None for an axis that turns without end."""

    def within(self, other: AxisLimits) -> AxisLimits:
        """Returns what both allow."""
        return AxisLimits(
            min(self.rate, other.rate),
            min(self.acceleration, other.acceleration),
            _overlap(self.angle, other.angle),
        )


FREE = AxisLimits(math.inf, math.inf)
"""No limit at all."""


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis of a table."""

    name: str
    about: tuple[float, float, float]
    """Unit vector it turns about where all angles are zero; x, y level and z up there, as in the table."""
    limits: AxisLimits


def level_from_table(axes: Sequence[Axis], angles: FloatArray) -> FloatArray:
    """Attitude (n, 3, 3) of the table at angles (n, axes), rad; the first axis carries the others.

    The product of the turns about each axis, from the floor up: R = R_1(a_1) R_2(a_2) ...
    """
    attitude = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for number, axis in enumerate(axes):
        attitude = attitude @ turns(axis, angles[:, number])
    return attitude


def turns(axis: Axis, angles: FloatArray) -> FloatArray:
    """Returns rotations (n, 3, 3) about an axis by angles (n,), rad; formula of Rodrigues."""
    cross = cross_matrix(axis.about)
    sine, versine = np.sin(angles), 1.0 - np.cos(angles)
    rotations: FloatArray = (
        np.eye(3)
        + sine[:, np.newaxis, np.newaxis] * cross
        + versine[:, np.newaxis, np.newaxis] * cross @ cross
    )
    return rotations


def cross_matrix(vector: Sequence[float]) -> FloatArray:
    """Returns the matrix (3, 3) of `v x`; rows times it, `w @ matrix`, are `w x v`."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def ups(axes: Sequence[Axis], angles: FloatArray) -> FloatArray:
    """Returns the directions (n, 3) of the table frame that point up at angles (n, axes), rad."""
    directions: FloatArray = level_from_table(axes, angles)[:, 2, :]
    return directions


def body_motion(
    axes: Sequence[Axis], angles: FloatArray, rates: FloatArray, accelerations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns angular rate and angular acceleration (n, 3) in the table frame, rad/s and rad/s^2.

    `angles`, `rates`, `accelerations` are (n, axes). From the floor up, what turned below is seen from the
    frame that each axis carries: w' = R^T w + q a, w'dot = R^T wdot + qdot a + (R^T w) x (q a), with a the
    axis and q its rate.
    """
    turned, speeding = np.zeros((len(angles), 3)), np.zeros((len(angles), 3))
    for number, axis in enumerate(axes):
        carried_from = np.swapaxes(turns(axis, angles[:, number]), 1, 2)
        turned, speeding = (np.einsum("nij,nj->ni", carried_from, each) for each in (turned, speeding))
        own = np.multiply.outer(rates[:, number], np.array(axis.about))
        speeding = speeding + np.multiply.outer(accelerations[:, number], np.array(axis.about))
        speeding += rates[:, number, np.newaxis] * (turned @ cross_matrix(axis.about))
        turned = turned + own
    return turned, speeding


def _overlap(
    one: tuple[float, float] | None, other: tuple[float, float] | None
) -> tuple[float, float] | None:
    if one is None or other is None:
        return other if one is None else one
    return max(one[0], other[0]), min(one[1], other[1])
