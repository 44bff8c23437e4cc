"""Simulated spins in numpy, quick enough for tens of thousands of them: nothing of the core is used."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tumble import _core
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray

GRAVITY = STANDARD_GRAVITY
"""m/s^2, as the procedure takes it where no place is given."""
SCALE_SIGMA = 0.01
"""Scale error of the gyroscope, 1-sigma: what sessions draw, and what procedure and bound know beforehand."""
ACCELEROMETER_NOISE = 0.02
GYROSCOPE_NOISE = 0.002
"""m/s^2 and rad/s, 1-sigma of a sample."""
LEVER_ARM = 0.12
"""m."""
START = 2.0
"""s from standing to full speed and back, along half a cosine."""


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion of the robot, and the rate of its samples."""

    turns: tuple[float, ...] = (3.0, -3.0)
    """Full turns one after the other, counter-clockwise positive."""
    speed: float = 1.0
    """rad/s; where it is uneven, about that."""
    uneven: bool = False
    """Indicates whether wheels slip, so that the rate wavers by 40 % with a period of 2.7 s."""
    rest: float = 5.0
    """s before the first turn."""
    rate: float = 100.0
    """Hz."""
    tilt: float = 0.0
    """rad, of the floor."""


@dataclass(frozen=True, slots=True)
class Course:
    """Where the robot heads at each of n samples."""

    time: FloatArray
    """(n,) s."""
    heading: FloatArray
    """(n,) rad."""
    rate: FloatArray
    """(n,) rad/s."""
    change: FloatArray
    """(n,) rad/s^2."""
    rest: int
    """So many samples at the start are at rest."""


@dataclass(frozen=True, slots=True)
class Unit:
    """Biases to be estimated, and the mounting of the IMU."""

    accelerometer_bias: FloatArray
    """(3,) m/s^2."""
    gyroscope_bias: FloatArray
    """(3,) rad/s."""
    roll: float
    pitch: float
    """rad, of the mounting."""
    pull: FloatArray
    """(2,) m/s^2: g sin(tilt) uphill, forward and left at the first rest."""
    arm: FloatArray
    """(2,) m, forward and left."""
    scale: float
    """Error of the gyroscope about the turning axis."""

    @property
    def floor(self) -> FloatArray:
        """(3, 3): forward, left and up in the case frame, one a row."""
        return floor_frame(self.roll, self.pitch)

    @property
    def lever_arm(self) -> FloatArray:
        """(3,) m, case frame."""
        arm: FloatArray = self.arm @ self.floor[:2]
        return arm

    @property
    def tilt(self) -> float:
        """rad."""
        return float(np.arcsin(np.hypot(*self.pull) / GRAVITY))


@dataclass(frozen=True, slots=True)
class PlayedSpin:
    """One session: what was measured and what is true."""

    motion: Motion
    course: Course
    unit: Unit
    noise: tuple[float, float]
    accelerometer: FloatArray
    gyroscope: FloatArray
    """(n, 3) m/s^2 and rad/s."""


def floor_frame(roll: float, pitch: float) -> FloatArray:
    """(3, 3): forward, left and up in the case frame, one a row, for that mounting."""
    (sr, sp), (cr, cp) = np.sin([roll, pitch]), np.cos([roll, pitch])
    return np.array([[cp, sr * sp, cr * sp], [0.0, cr, -sr], [-sp, cp * sr, cp * cr]])


@lru_cache(maxsize=64)
def course(motion: Motion) -> Course:
    """Rates and heading at each sample; the heading is the integral of the rate on a ten times finer grid."""
    finer = 10
    step = 1.0 / (motion.rate * finer)
    pieces = [np.zeros(round(motion.rest * motion.rate) * finer)]
    for turn in motion.turns:
        start = min(START, 2.0 * np.pi * abs(turn) / motion.speed)
        seconds = 2.0 * np.pi * abs(turn) / motion.speed + start
        time = np.arange(round(seconds * motion.rate) * finer) * step
        to_the_end = np.clip(np.minimum(time, seconds - time) / start, 0.0, 1.0)
        wavering = 1.0 + 0.4 * motion.uneven * np.sin(2.0 * np.pi * time / 2.7)
        pieces.append(np.sign(turn) * motion.speed * wavering * 0.5 * (1.0 - np.cos(np.pi * to_the_end)))
    rate = np.concatenate([*pieces, [0.0]])
    heading = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1])) * step])
    change = np.gradient(rate, step)
    own = slice(None, None, finer)
    count = len(rate[own])
    return Course(
        np.arange(count) / motion.rate, heading[own], rate[own], change[own], len(pieces[0]) // finer
    )


def draw_unit(tilt: float, random: np.random.Generator) -> Unit:
    """Draws biases, mounting, uphill bearing, the direction of the lever arm, and the scale error."""
    uphill, aside = random.uniform(-np.pi, np.pi, 2)
    roll, pitch = np.radians(5.0) * random.standard_normal(2)
    return Unit(
        accelerometer_bias=0.3 * random.standard_normal(3),
        gyroscope_bias=0.02 * random.standard_normal(3),
        roll=float(roll),
        pitch=float(pitch),
        pull=GRAVITY * np.sin(tilt) * np.array([np.cos(uphill), np.sin(uphill)]),
        arm=LEVER_ARM * np.array([np.cos(aside), np.sin(aside)]),
        scale=float(SCALE_SIGMA * random.standard_normal()),
    )


def ideal(course: Course, unit: Unit) -> tuple[FloatArray, FloatArray]:
    """(n, 3) specific force and angular rate in the case frame: no bias, scale error or noise in them."""
    forward, left, up = unit.floor
    ahead, aside = unit.pull
    uphill = ahead * forward + aside * left
    heading, rate, change = course.heading[:, None], course.rate[:, None], course.change[:, None]
    force = np.sqrt(GRAVITY**2 - unit.pull @ unit.pull) * up
    force = force + np.cos(heading) * uphill - np.sin(heading) * np.cross(up, uphill)
    force += -(rate**2) * unit.lever_arm + change * np.cross(up, unit.lever_arm)
    return force, rate * up


def play(
    motion: Motion,
    random: np.random.Generator,
    noise: tuple[float, float] = (ACCELEROMETER_NOISE, GYROSCOPE_NOISE),
    unit: Unit | None = None,
) -> PlayedSpin:
    """Simulates a session with white noise of that 1-sigma a sample; a unit is drawn where none is given."""
    unit = unit or draw_unit(motion.tilt, random)
    there = course(motion)
    force, rate = ideal(there, unit)
    shape = force.shape
    return PlayedSpin(
        motion,
        there,
        unit,
        noise,
        force + unit.accelerometer_bias + noise[0] * random.standard_normal(shape),
        (1.0 + unit.scale) * rate + unit.gyroscope_bias + noise[1] * random.standard_normal(shape),
    )


def fit(played: PlayedSpin, precision: str = "f64") -> _core.SpinFigures:
    """Estimates from the session, with its true rest."""
    rests = np.array([[0.0, played.course.time[played.course.rest - 1]]])
    settings = _core.SpinSettings({"scale_sigma": SCALE_SIGMA, "spin_timeout": 3600.0})
    return _core.fit_spin(
        played.course.time, played.accelerometer, played.gyroscope, rests, settings, precision
    )[0]
