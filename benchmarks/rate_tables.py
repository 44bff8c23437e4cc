"""Sessions of a rate table by numpy alone: neither noise nor profiles are those of the simulator."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from tumble.foundation.recording import FloatArray, Recording

GRAVITY = 9.80665
EARTH = 7.292115e-5 * np.array([np.cos(0.84), 0.0, np.sin(0.84)])
"""World frame, z up, at 48 deg of latitude."""
FACES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))


@dataclass
class Unit:
    """A unit and its errors: reading = M true + b + noise."""

    M: FloatArray = field(default_factory=lambda: np.eye(3))
    b: FloatArray = field(default_factory=lambda: np.zeros(3))
    force_M: FloatArray = field(default_factory=lambda: np.eye(3))
    force_b: FloatArray = field(default_factory=lambda: np.zeros(3))
    force_noise: float = 2e-4
    rate_noise: float = 2e-5
    delay: float = 0.0

    def rate_reading(self, rate: FloatArray) -> FloatArray:
        """Angular rate (n, 3) as it is read, without noise."""
        return np.asarray(rate @ self.M.T + self.b)


def usual(random: np.random.Generator) -> Unit:
    """Draws a target of consumer grade."""

    def matrix() -> FloatArray:
        return np.eye(3) + random.normal(0.0, 0.008, (3, 3))

    return Unit(
        matrix(),
        random.normal(0.0, 0.008, 3),
        matrix(),
        random.normal(0.0, 0.15, 3),
        2e-3 * 10**0.5,
        3e-4 * 10**0.5,
        delay=2e-3,
    )


def _about(axis: FloatArray, angle: FloatArray) -> FloatArray:
    """Rotation matrices (n, 3, 3) about a unit vector by angles (n,)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross))


def _profile(rates: Sequence[float | None], hold: float, ramp: float, rest: float) -> FloatArray:
    """Knots of the rate of the table, rad/s: rates from one to the next; None is a rest."""
    knots = [(0.0, 0.0), (rest, 0.0)]
    for rate in (*rates, None):
        value = 0.0 if rate is None else np.radians(rate)
        length = rest if rate is None else hold
        knots += [(knots[-1][0] + ramp, value), (knots[-1][0] + ramp + length, value)]
    whole = np.array(knots)
    return np.asarray(whole[np.append(True, np.diff(whole[:, 0]) > 0.0)])


def _smooth(knots: FloatArray, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rates and angle (n,) at times: between knots the rate is a cubic that begins and ends level."""
    start, value = knots[:-1, 0], knots[:-1, 1]
    length, change = np.diff(knots[:, 0]), np.diff(knots[:, 1])
    whole = np.concatenate([[0.0], np.cumsum(length * (value + 0.5 * change))])
    at = np.clip(np.searchsorted(knots[:, 0], time, side="right") - 1, 0, len(start) - 1)
    x = np.clip((time - start[at]) / length[at], 0.0, 1.0)
    rate = value[at] + change[at] * x * x * (3.0 - 2.0 * x)
    angle = whole[at] + length[at] * (value[at] * x + change[at] * (x**3 - 0.5 * x**4))
    return rate, angle


@dataclass
class Session:
    """Motion of a table: at each face a profile of rates, then a turn to the next face."""

    rates: tuple[float | None, ...]
    faces: tuple[tuple[int, int, int], ...] = FACES
    hold: float = 20.0
    ramp: float = 1.0
    rest: float = 10.0
    tilt: float = 0.0
    """Axis of the table off vertical, rad."""
    turn: float = 4.0

    def pieces(self) -> Iterator[tuple[float, FloatArray, FloatArray, FloatArray]]:
        """Times, axes and profiles, one after the other."""
        begun, attitude = 0.0, None
        for k, face in enumerate(self.faces):
            up = np.array(face, dtype=float)
            if attitude is None:
                attitude = _from_up(up)
            knots = _profile(self.rates, self.hold, self.ramp, self.rest)
            axis = attitude @ np.array([np.sin(self.tilt), 0.0, np.cos(self.tilt)])
            yield begun, attitude, axis, knots
            _, angle = _smooth(knots, knots[-1:, 0])
            attitude = _about(axis, -angle)[0] @ attitude
            begun += knots[-1, 0]
            if k + 1 < len(self.faces):
                here, there = attitude @ np.array([0, 0, 1.0]), np.array(self.faces[k + 1], dtype=float)
                turned = np.arctan2(np.linalg.norm(np.cross(here, there)), here @ there)
                axis = np.cross(there, here)
                if np.linalg.norm(axis) < 0.1:
                    axis = np.cross(here, np.roll(here, 1))
                axis /= np.linalg.norm(axis)
                mean = turned / (0.5 * self.turn)
                knots = np.array([(0.0, 0.0), (0.5 * self.turn, mean), (self.turn, 0.0)])
                yield begun, attitude, axis, knots
                attitude = _about(axis, -np.array([turned]))[0] @ attitude
                begun += self.turn

    def truth(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Specific force and angular rate (n, 3) in the case at times."""
        force, rate = np.empty((len(time), 3)), np.empty((len(time), 3))
        pieces = list(self.pieces())
        starts = np.array([begun for begun, *_ in pieces])
        at = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(pieces) - 1)
        for k, (begun, attitude, axis, knots) in enumerate(pieces):
            here = at == k
            speed, angle = _smooth(knots, np.clip(time[here] - begun, 0.0, knots[-1, 0]))
            attitudes = _about(axis, -angle) @ attitude
            force[here] = attitudes @ np.array([0.0, 0.0, GRAVITY])
            rate[here] = speed[:, None] * axis + attitudes @ EARTH
        return force, rate

    @property
    def length(self) -> float:
        """Length of the session, s."""
        *_, (begun, _, _, knots) = self.pieces()
        return begun + float(knots[-1, 0])

    def recorded(
        self,
        name: str,
        unit: Unit,
        random: np.random.Generator,
        sample_rate: float = 100.0,
        stamp: float = 1e-3,
    ) -> Recording:
        """Recording of a unit; stamps are whole numbers of `stamp` seconds."""
        time = np.arange(int(self.length * sample_rate)) / sample_rate
        force, rate = self.truth(time - unit.delay)
        force = force @ unit.force_M.T + unit.force_b + random.normal(0.0, unit.force_noise, force.shape)
        rate = unit.rate_reading(rate) + random.normal(0.0, unit.rate_noise, rate.shape)
        return Recording.from_arrays(name, np.round(time / stamp) * stamp, force, rate, clock="table")


def _from_up(up: FloatArray) -> FloatArray:
    """Any rotation case_from_world with that face up."""
    side = np.roll(np.abs(up), 1)
    return np.column_stack([side, np.cross(up, side), up])
