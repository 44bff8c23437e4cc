"""A wheeled robot made of a few lines: it stands, turns on the spot, drives, and is treated badly.

Independent of `tumble simulate spin`, so that what one of the two has wrong shows in the other.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

GRAVITY = 9.80665
HEADER = "time,ax,ay,az,gx,gy,gz"
RAMP = 0.5
"""s in which the robot gets up to speed and comes to rest."""


@dataclass(frozen=True)
class Move:
    """Motion of the robot for a while."""

    seconds: float
    turns: float = 0.0
    """Counter-clockwise positive."""
    speed: float = 0.0
    """m/s forward, reached after the ramp."""
    unevenness: float = 0.0
    """Share by which the rate of turning goes up and down, once a second."""
    vibration: float = 0.0
    """m/s^2 of shaking while it moves, and a tenth of it in rad/s."""


def still(seconds=6.0):
    return Move(seconds)


def turn(turns=3.0, rate=1.0, unevenness=0.0, vibration=0.0):
    """So many turns, counter-clockwise positive; the ramps make it last a little longer."""
    seconds = abs(turns) * 2.0 * np.pi / rate + RAMP
    return Move(seconds, turns=turns, unevenness=unevenness, vibration=vibration)


def drive(seconds=12.0, speed=0.6, turns=0.0, vibration=0.0):
    """Straight on, or round a bend of so many turns; without vibration it is as smooth as a rest."""
    return Move(seconds, turns=turns, speed=speed, vibration=vibration)


@dataclass(frozen=True)
class Robot:
    """The robot, the IMU on it and the floor under it; vectors are in the case frame."""

    accelerometer_bias: tuple[float, float, float] = (0.20, -0.15, 0.30)
    gyroscope_bias: tuple[float, float, float] = (0.02, -0.01, 0.015)
    lever_arm: tuple[float, float, float] = (0.10, -0.06, 0.0)
    """m, position of the IMU from the turning axis; what lies along the axis does nothing."""
    roll: float = 3.0
    pitch: float = -2.0
    """deg, mounting of the IMU."""
    floor_tilt: float = 1.0
    """deg."""
    uphill: float = 40.0
    """deg counter-clockwise from forward at heading 0."""
    gyroscope_scale: float = 1.0
    accelerometer_noise: float = 0.02
    gyroscope_noise: float = 0.002
    """Noise of one sample, m/s^2 and rad/s."""
    rate_hz: float = 100.0

    @property
    def up(self):
        """(3,) turning axis upwards, case frame."""
        roll, pitch = np.radians([self.roll, self.pitch])
        return np.array([-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)])

    @property
    def case_from_floor(self):
        """(3, 3) columns are forward, left and up in the case frame."""
        up = self.up
        forward = np.array([1.0, 0.0, 0.0]) - up[0] * up
        forward /= np.linalg.norm(forward)
        return np.column_stack([forward, np.cross(up, forward), up])


@dataclass
class Session:
    """Recorded samples, which tests may corrupt, and the truth."""

    robot: Robot
    time: np.ndarray
    accelerometer: np.ndarray
    gyroscope: np.ndarray
    heading: np.ndarray
    spans: list[tuple[float, float]] = field(default_factory=list)
    """Start and end of each move, s."""

    @property
    def table(self):
        """(n, 7) time, specific force, angular rate."""
        return np.column_stack([self.time, self.accelerometer, self.gyroscope])

    def during(self, move, begin=0.0, end=1.0):
        """Mask of the samples of a move, or of the share of it from `begin` to `end`."""
        start, stop = self.spans[move]
        span = stop - start
        return (self.time >= start + begin * span) & (self.time < start + end * span)

    def part(self, until):
        """The session cut off at a time, s."""
        kept = self.time < until
        return replace(
            self,
            time=self.time[kept],
            accelerometer=self.accelerometer[kept],
            gyroscope=self.gyroscope[kept],
            heading=self.heading[kept],
        )

    def write(self, path, header=HEADER):
        """Writes it as CSV, as any logger does."""
        lines = [",".join(map(repr, row)) for row in self.table.tolist()]
        path.write_text("\n".join([header, *lines]) + "\n")
        return path


def record(moves, seed, **changes):
    """Simulates a robot that makes these moves; prints the seed for the analysis of failures."""
    print(f"seed {seed}")
    robot = Robot(**changes)
    step = 1.0 / robot.rate_hz
    rates, speeds, shaking, spans, start = [], [], [], [], 0.0
    for move in moves:
        time = np.arange(round(move.seconds * robot.rate_hz)) * step
        rates.append(_turning(move, time))
        speeds.append(move.speed * _trapezium(move, time))
        shaking.append(move.vibration * _trapezium(move, time))
        spans.append((start, start + len(time) * step))
        start += len(time) * step
    rate, speed = np.concatenate(rates), np.concatenate(speeds)
    pushes = np.gradient(speed, step)
    time = np.arange(len(rate)) * step
    heading = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * step)])
    generator = np.random.default_rng(seed)
    force = _force(robot, heading, rate, np.gradient(rate, step), np.column_stack([pushes, rate * speed]))
    turning = robot.gyroscope_scale * np.outer(rate, robot.up) + robot.gyroscope_bias
    shaken = np.concatenate(shaking)[:, None]
    return Session(
        robot,
        time,
        force + np.hypot(robot.accelerometer_noise, shaken) * generator.standard_normal(force.shape),
        turning + np.hypot(robot.gyroscope_noise, 0.1 * shaken) * generator.standard_normal(force.shape),
        heading,
        spans,
    )


def _trapezium(move, time):
    """From 0 to 1 and back in ramps without a jump in slope."""
    ramp = np.clip(np.minimum(time, move.seconds - time) / RAMP, 0.0, 1.0)
    return np.sin(0.5 * np.pi * ramp) ** 2


def _turning(move, time):
    """(n,) rad/s counter-clockwise: speed up, turn, slow down; the whole is the angle asked for."""
    if move.turns == 0.0:
        return np.zeros_like(time)
    shape = _trapezium(move, time) * (1.0 + move.unevenness * np.sin(2.0 * np.pi * time))
    return move.turns * 2.0 * np.pi * shape / np.trapezoid(shape, time)


def _force(robot, heading, rate, acceleration, driving):
    """(n, 3) specific force in the case frame: gravity over a tilted floor, lever arm, driving."""
    forward, left, up = robot.case_from_floor.T
    tilt, bearing = np.radians([robot.floor_tilt, robot.uphill])
    uphill = np.cos(bearing) * forward + np.sin(bearing) * left
    across = np.outer(np.cos(heading), uphill) - np.outer(np.sin(heading), np.cross(up, uphill))
    arm = np.array(robot.lever_arm) - np.dot(robot.lever_arm, up) * up
    return (
        np.array(robot.accelerometer_bias)
        + GRAVITY * (np.cos(tilt) * up + np.sin(tilt) * across)
        - np.outer(rate**2, arm)
        + np.outer(acceleration, np.cross(up, arm))
        + driving @ np.vstack([forward, left])
    )
