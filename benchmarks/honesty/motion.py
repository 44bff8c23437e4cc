"""Motions of a body as rests and turns about one axis each; this shares no code with the package."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
GRAVITY = 9.80665
"""m/s^2."""


@dataclass(frozen=True)
class Segment:
    """A rest, or a turn by a rotation vector in body axes, rad, that begins and ends at rest."""

    seconds: float
    rotation: FloatArray
    """(3,) zero for a rest."""
    pose: int
    """Number of the pose that it holds; -1 for a turn."""


@dataclass
class Motion:
    """Samples of a motion; body axes are those of the sensor's case."""

    time: FloatArray
    """(n,) s."""
    attitude: FloatArray
    """(n, 3, 3) world from body."""
    rate: FloatArray
    """(n, 3) rad/s, in body axes."""
    acceleration: FloatArray
    """(n, 3) rad/s^2, derivative of `rate`."""
    pose: npt.NDArray[np.int64]
    """(n,) number of the pose that is held, -1 in a turn."""

    @property
    def force(self) -> FloatArray:
        """(n, 3) specific force of a point that does not travel, m/s^2: gravity, upwards, in body axes."""
        return GRAVITY * self.attitude[:, 2, :]


def cross(vector: FloatArray) -> FloatArray:
    """(3, 3) matrix of the product with a vector from the left."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def turned_by(rotation: FloatArray, share: FloatArray) -> FloatArray:
    """(n, 3, 3) rotations by shares of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(rotation))
    if angle == 0.0:
        return np.repeat(np.eye(3)[None], len(share), axis=0)
    axis = cross(rotation / angle)
    turned = (share * angle)[:, None, None]
    turns: FloatArray = np.eye(3) + np.sin(turned) * axis + (1.0 - np.cos(turned)) * (axis @ axis)
    return turns


def rotation_vector(matrix: FloatArray) -> FloatArray:
    """Rotation vector of a rotation matrix by less than half a turn."""
    skew = matrix - matrix.T
    across: FloatArray = 0.5 * np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    sine = float(np.linalg.norm(across))
    angle = float(np.arctan2(sine, (np.trace(matrix) - 1.0) / 2.0))
    return angle / sine * across if sine else across


def moved(segments: Sequence[Segment], start: FloatArray, rate_hz: float) -> Motion:
    """Samples of the segments one after another. Rate of a turn: one period of 1 - cos."""
    ends = np.cumsum([0.0, *(segment.seconds for segment in segments)])
    time = np.arange(int(np.floor(ends[-1] * rate_hz))) / rate_hz
    attitude, rate = np.empty((len(time), 3, 3)), np.zeros((len(time), 3))
    acceleration, pose = np.zeros((len(time), 3)), np.full(len(time), -1)
    before = start
    for segment, begin, end in zip(segments, ends, ends[1:], strict=False):
        place = (time >= begin) & (time < end)
        phase = (time[place] - begin) / segment.seconds
        share = phase - np.sin(2.0 * np.pi * phase) / (2.0 * np.pi)
        attitude[place] = before @ turned_by(segment.rotation, share)
        slope, bend = 1.0 - np.cos(2.0 * np.pi * phase), 2.0 * np.pi * np.sin(2.0 * np.pi * phase)
        rate[place] = slope[:, None] * segment.rotation / segment.seconds
        acceleration[place] = bend[:, None] * segment.rotation / segment.seconds**2
        pose[place] = segment.pose
        before = before @ turned_by(segment.rotation, np.ones(1))[0]
    return Motion(time, attitude, rate, acceleration, pose)


def attitude_with_up(up: FloatArray, heading: float) -> FloatArray:
    """(3, 3) world from body, with a direction of the body upwards."""
    third = up / np.linalg.norm(up)
    other = np.eye(3)[int(np.argmin(np.abs(third)))]
    first = np.cross(other, third)
    first /= np.linalg.norm(first)
    level = np.stack([first, np.cross(third, first), third])
    c, s = np.cos(heading), np.sin(heading)
    world: FloatArray = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ level
    return world


def attitude_after(before: FloatArray, up: FloatArray, heading: float) -> FloatArray:
    """(3, 3) world from body after the shortest turn that brings a direction up, then one of the heading."""
    now = before[2]
    axis, cosine = np.cross(up, now), float(np.clip(up @ now, -1.0, 1.0))
    length = float(np.linalg.norm(axis))
    rotation = axis / length * np.arccos(cosine) if length else np.zeros(3)
    brought = before @ turned_by(rotation, np.ones(1))[0]
    after: FloatArray = turned_by(np.array([0.0, 0.0, heading]), np.ones(1))[0] @ brought
    return after


def visits(attitudes: Sequence[FloatArray], rest: float, rate: float) -> list[Segment]:
    """Rests at attitudes, and turns between them at a mean rate, rad/s."""
    segments = []
    for number, attitude in enumerate(attitudes):
        if number:
            turn = rotation_vector(attitudes[number - 1].T @ attitude)
            segments.append(Segment(max(1.0, float(np.linalg.norm(turn)) / rate), turn, -1))
        segments.append(Segment(rest, np.zeros(3), number))
    return segments
