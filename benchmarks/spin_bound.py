"""The Cramer-Rao bound of a spin, sample by sample from true values, in numpy: nothing of the core is used.

Unknown are accelerometer and gyroscope bias, the axis, the pull of the floor's tilt, the lever arm, the scale
error about the axis, and, as nuisance, *the heading at every sample* of the turn: the gyroscope's component
along the axis shows how it changed from one sample to the next, specific force where it is. So the walk of
the heading by noise of the gyroscope is in the bound. Where rate and its change multiply the lever arm they
are those of the gyroscope rid of its bias and scale error, and its noise is not counted; that can only lower
the bound. The information on the headings is a band of three, and is eliminated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

from benchmarks.spin_session import GRAVITY, SCALE_SIGMA, Course, PlayedSpin, Unit, floor_frame, ideal
from tumble.foundation.recording import FloatArray

UNKNOWNS = 13
"""Accelerometer bias (3), gyroscope bias (3), turn of the floor frame about forward and left (2), pull of the
tilt forward and left (2), lever arm forward and left (2), scale error."""
AXIS, PULL, ARM, SCALE = slice(6, 8), slice(8, 10), slice(10, 12), 12
KNOWN_BEFOREHAND = np.array([5.0] * 3 + [np.inf] * 5 + [5.0] * 2 + [1.0] * 2 + [SCALE_SIGMA])
"""1-sigma of the unknowns before any data, SI and rad: those of the procedure."""

GROUPS: dict[str, slice] = {
    "accelerometer bias": slice(0, 3),
    "gyroscope bias": slice(3, 6),
    "roll and pitch": slice(6, 8),
    "floor tilt": slice(8, 9),
    "lever arm": slice(9, 12),
    "scale": slice(12, 13),
}
"""Quantities of the result, in this order."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Derivatives of what is measured, in units of its noise."""

    force: FloatArray
    """(13, 3, n) of specific force by the unknowns."""
    force_by_heading: FloatArray
    """(3, n)."""
    across: FloatArray
    """(13, 2, n) of the rates about forward and left."""
    along: FloatArray
    """(13, n - 1) of the mean rate about the axis between two samples."""
    along_by_heading: float
    """By the later heading; by the earlier one it is the negative."""


def moved(unit: Unit, change: FloatArray) -> Unit:
    """The unit after a small change of the unknowns (13,), to first order."""
    floor = unit.floor
    up = floor[2] + np.cross(change[AXIS] @ floor[:2], floor[2])
    return Unit(
        unit.accelerometer_bias + change[0:3],
        unit.gyroscope_bias + change[3:6],
        float(np.arctan2(up[1], up[2])),
        float(np.arctan2(-up[0], np.hypot(up[1], up[2]))),
        unit.pull + change[PULL],
        unit.arm + change[ARM],
        unit.scale + float(change[SCALE]),
    )


def rows(course: Course, unit: Unit, noise: tuple[float, float], rate: float) -> Rows:
    """Derivatives at the truth, for noise (m/s^2, rad/s) of a sample and `rate` samples a second."""
    up, arm = unit.floor[2], unit.lever_arm
    count = len(course.time)
    cosine, sine = np.cos(course.heading), np.sin(course.heading)
    square, change, seen = course.rate**2, course.change, 1.0 / (1.0 + unit.scale)
    ideal_force = ideal(course, unit)[0].T
    force = np.zeros((UNKNOWNS, 3, count))
    across = np.zeros((UNKNOWNS, 2, count))
    along = np.zeros((UNKNOWNS, count - 1))
    by_rate = np.outer(2.0 * seen * arm, course.rate)
    down = unit.pull / np.sqrt(GRAVITY**2 - unit.pull @ unit.pull)
    for i in range(3):
        force[i, i] = 1.0
        across[3 + i] = unit.floor[:2, i, None]
        along[3 + i] = up[i]
        force[3 + i] = up[i] * by_rate
    for i, (axis, yaw) in enumerate(zip(unit.floor[:2], _yaw_by_axis(unit), strict=True)):
        # Forward is the case's x laid onto the floor: tilting the axis turns it about the axis as well.
        force[6 + i] = _cross_product(axis + yaw * up) @ ideal_force
        across[6 + i] = np.outer(unit.floor[:2] @ np.cross(axis, up), course.rate)
        left = np.cross(up, axis)
        force[8 + i] = np.outer(axis, cosine) - np.outer(left, sine) - (down[i] * up)[:, None]
        force[10 + i] = np.outer(left, change) - np.outer(axis, square)
    force[SCALE] = seen * (np.outer(2.0 * arm, square) - np.outer(np.cross(up, arm), change))
    along[SCALE] = np.diff(course.heading) * rate
    uphill = unit.pull @ unit.floor[:2]
    by_heading = -np.outer(uphill, sine) - np.outer(np.cross(up, uphill), cosine)
    return Rows(
        force / noise[0],
        by_heading / noise[0],
        across / noise[1],
        along / noise[1],
        (1.0 + unit.scale) * rate / noise[1],
    )


def _cross_product(vector: FloatArray) -> FloatArray:
    """(3, 3) matrix of the cross product with this vector on the left."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _yaw_by_axis(unit: Unit) -> FloatArray:
    """(2,) rad that the floor frame turns about up where the axis tilts by 1 rad about forward and left."""
    floor = unit.floor
    step = 1e-6
    yaw: list[float] = []
    for axis in floor[:2]:
        sides = []
        for sign in (1.0, -1.0):
            up = floor[2] + sign * step * np.cross(axis, floor[2])
            frame = floor_frame(
                float(np.arctan2(up[1], up[2])), float(np.arctan2(-up[0], np.hypot(up[1], up[2])))
            )
            sides.append(frame[0] @ floor[1])
        yaw.append((sides[0] - sides[1]) / (2.0 * step))
    return np.array(yaw)


def covariance(course: Course, unit: Unit, noise: tuple[float, float], rate: float) -> FloatArray:
    """(13, 13) least covariance of the unknowns, headings eliminated."""
    found = rows(course, unit, noise, rate)
    information = np.diag(KNOWN_BEFOREHAND**-2)
    for part in (found.force, found.across, found.along):
        flat = part.reshape(UNKNOWNS, -1)
        information = information + flat @ flat.T
    # At rest the heading is known; every sample after that has one of its own.
    first = course.rest
    by_heading = found.force_by_heading[:, first:]
    later = found.along[:, first - 1 :] * found.along_by_heading
    mixed = np.einsum("ik,jik->jk", by_heading, found.force[:, :, first:]) + later
    mixed[:, :-1] -= later[:, 1:]
    band = np.zeros((2, by_heading.shape[1]))
    band[1] = np.sum(by_heading**2, axis=0) + 2.0 * found.along_by_heading**2
    band[1, -1] -= found.along_by_heading**2
    band[0, 1:] = -(found.along_by_heading**2)
    information = information - mixed @ solveh_banded(band, mixed.T)
    unit_size = 1.0 / np.sqrt(np.diag(information))
    inverse: FloatArray = np.linalg.inv(information * np.outer(unit_size, unit_size))
    return inverse * np.outer(unit_size, unit_size)


def quantities(unit: Unit) -> FloatArray:
    """(13,) accelerometer bias, gyroscope bias, roll, pitch, floor tilt, lever arm (3), scale; SI and rad."""
    return np.concatenate(
        [
            unit.accelerometer_bias,
            unit.gyroscope_bias,
            [unit.roll, unit.pitch, unit.tilt],
            unit.lever_arm,
            [unit.scale],
        ]
    )


def bound(played: PlayedSpin) -> FloatArray:
    """(13,) 1-sigma of the quantities that nobody can beat; floor tilt is NaN on a level floor."""
    least = covariance(played.course, played.unit, played.noise, played.motion.rate)
    step = 1e-6
    columns = []
    for change in step * np.eye(UNKNOWNS):
        ahead, behind = quantities(moved(played.unit, change)), quantities(moved(played.unit, -change))
        columns.append((ahead - behind) / (2.0 * step))
    jacobian = np.array(columns).T
    sigma = np.sqrt(np.diag(jacobian @ least @ jacobian.T))
    if played.unit.tilt == 0.0:
        sigma[GROUPS["floor tilt"]] = np.nan
    return sigma
