"""A rigid body in flight: attitude by quaternions, place by sums of sines, rests in between.

Written anew, without the core, `tumble simulate flight` or `redundancy_set`, so that a mistake in one of them
does not hide in another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray

GRID_HZ = 500.0
"""Moments a second at which the motion is worked out; readings are interpolated, with cubics."""
EARTH_RATE = 7.292115e-5
"""rad/s."""
RAMP = 1.2
"""s in which motion begins and ends."""
TURNING = (0.1, 0.8)
"""rad/s of each axis, amplitude of the slow turns, least and most."""
TURN_BAND = (0.03, 0.5)
"""Hz of the sines of which turns are made."""
PUSHING = (0.5, 4.0)
"""m/s^2 of each axis, amplitude of the accelerations."""
PUSH_BAND = (0.08, 1.2)
"""Hz of the sines of which the place is made."""
SINES = 4
"""Number of sines of different frequencies an axis."""


@dataclass(frozen=True, slots=True)
class Body:
    """Motion of the primary's place, on a grid, in body axes."""

    time: FloatArray
    """(n,) s."""
    specific_force: FloatArray
    """(n, 3) m/s^2."""
    angular_rate: FloatArray
    """(n, 3) rad/s against inertial space."""
    angular_acceleration: FloatArray
    """(n, 3) rad/s^2."""
    activity: FloatArray
    """(n,) 0 at rest to 1 in motion."""

    def at(self, time: FloatArray, arm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns specific force and angular rate (n, 3) at a place `arm` m away, at times (n,) s."""
        w = self.angular_rate
        carried = np.cross(self.angular_acceleration, arm) + np.cross(w, np.cross(w, arm))
        both = interpolated(time * GRID_HZ, np.hstack([self.specific_force + carried, w]))
        return both[:, :3], both[:, 3:]

    def activity_at(self, time: FloatArray) -> FloatArray:
        """Returns the activity (n,) at times (n,) s."""
        return np.interp(time, self.time, self.activity)


def fly(random: np.random.Generator, motions: FloatArray, duration: float, tilt: float) -> Body:
    """Moves a body for `duration` s: at rest but in `motions` (n, 2) s, first `tilt` rad from upright."""
    time = np.arange(int(duration * GRID_HZ) + 3) / GRID_HZ
    activity = _activity(time, motions)
    rate = activity[:, None] * _sines(random, time, TURN_BAND, random.uniform(*TURNING, 3))
    attitude = attitudes(rate, _tilted(random, tilt))
    acceleration = _acceleration(random, time, activity)
    north = np.array([1.0, 0.0, 0.0])
    up = np.array([0.0, 0.0, 1.0])
    latitude = random.uniform(-1.2, 1.2)
    earth = EARTH_RATE * (np.cos(latitude) * north + np.sin(latitude) * up)
    sensed = rate + turned_back(attitude, np.broadcast_to(earth, rate.shape))
    return Body(
        time,
        turned_back(attitude, acceleration + STANDARD_GRAVITY * up),
        sensed,
        np.gradient(sensed, 1.0 / GRID_HZ, axis=0),
        activity,
    )


def _activity(time: FloatArray, motions: FloatArray) -> FloatArray:
    found = np.zeros(len(time))
    for start, end in motions:
        done = np.clip(np.minimum(time - start, end - time) / RAMP, 0.0, 1.0)
        # Fifth order: accelerations of what is moved by it have no steps.
        found += done**3 * (10.0 - 15.0 * done + 6.0 * done**2)
    return np.asarray(found)


def _sines(
    random: np.random.Generator, time: FloatArray, band: tuple[float, float], amplitude: FloatArray
) -> FloatArray:
    found = np.zeros((len(time), 3))
    for axis in range(3):
        for frequency in _logarithmic(random, band, SINES):
            phase = random.uniform(0.0, 2.0 * np.pi)
            found[:, axis] += np.sin(2.0 * np.pi * frequency * time + phase)
    return np.asarray(found * amplitude / np.sqrt(SINES))


def _logarithmic(random: np.random.Generator, band: tuple[float, float], count: int) -> FloatArray:
    return np.asarray(np.exp(random.uniform(np.log(band[0]), np.log(band[1]), count)))


def _acceleration(random: np.random.Generator, time: FloatArray, activity: FloatArray) -> FloatArray:
    """Returns the acceleration (n, 3) m/s^2, level axes, of a place that is the same at every rest."""
    place = np.zeros((len(time), 3))
    for axis in range(3):
        for frequency in _logarithmic(random, PUSH_BAND, SINES):
            turns = 2.0 * np.pi * frequency
            size = random.uniform(*PUSHING) / np.sqrt(SINES) / turns**2
            place[:, axis] += size * np.sin(turns * time + random.uniform(0.0, 2.0 * np.pi))
    moved = activity[:, None] * place
    acceleration = np.zeros_like(moved)
    acceleration[1:-1] = (moved[2:] - 2.0 * moved[1:-1] + moved[:-2]) * GRID_HZ**2
    return np.asarray(acceleration)


def _tilted(random: np.random.Generator, tilt: float) -> FloatArray:
    heading, bearing = random.uniform(0.0, 2.0 * np.pi, 2)
    turn = np.array([np.cos(0.5 * heading), 0.0, 0.0, np.sin(0.5 * heading)])
    axis = np.array([np.cos(bearing), np.sin(bearing), 0.0])
    lean = np.concatenate([[np.cos(0.5 * tilt)], np.sin(0.5 * tilt) * axis])
    return np.asarray(product(turn[None], lean[None])[0])


def product(first: FloatArray, second: FloatArray) -> FloatArray:
    """Multiplies quaternions (n, 4), scalar first."""
    a, b, c, d = first.T
    e, f, g, h = second.T
    return np.column_stack(
        [
            a * e - b * f - c * g - d * h,
            a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e,
        ]
    )


def attitudes(rate: FloatArray, first: FloatArray) -> FloatArray:
    """Integrates an angular rate (n, 3), body axes: level from body, quaternions (n, 4).

    Products of all steps before a moment are taken two by two, then four by four, and so on.
    """
    angles = 0.5 * (rate[1:] + rate[:-1]) / GRID_HZ
    size = np.linalg.norm(angles, axis=1, keepdims=True)
    steps = np.hstack([np.cos(0.5 * size), 0.5 * np.sinc(0.5 * size / np.pi) * angles])
    found = np.vstack([first, steps])
    reach = 1
    while reach < len(found):
        found[reach:] = product(found[:-reach], found[reach:])
        reach *= 2
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def turned_back(attitude: FloatArray, vectors: FloatArray) -> FloatArray:
    """Returns level vectors (n, 3) in body axes."""
    scalar, imaginary = attitude[:, :1], -attitude[:, 1:]
    across = 2.0 * np.cross(imaginary, vectors)
    return np.asarray(vectors + scalar * across + np.cross(imaginary, across))


def interpolated(place: FloatArray, columns: FloatArray) -> FloatArray:
    """Interpolates columns (m, k) at places (n,) of their index, by the cubic through four neighbours."""
    index = np.clip(place.astype(int), 1, len(columns) - 3)
    x = (place - index)[:, None]
    before, left, right, after = (columns[index + step] for step in (-1, 0, 1, 2))
    cubic = 3.0 * (left - right) + after - before
    square = 2.0 * before - 5.0 * left + 4.0 * right - after
    return np.asarray(left + 0.5 * x * (right - before + x * (square + x * cubic)))
