"""Units fastened to one body that is turned and pushed about, made of a few lines.

Independent of `tumble simulate flight`, so that what one of the two has wrong shows in the other.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation

import tumble

GRAVITY = 9.80665
STEP = 1e-4
"""s, of the numerical derivative of smooth functions."""


@dataclass(frozen=True)
class Motion:
    """Turning and pushing as sums of sines; about the axes given, upright where there is only one."""

    seed: int
    turning: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """rad/s, root mean square rate of roll, pitch and yaw."""
    pushing: float = 1.0
    """m/s^2, root mean square an axis."""
    fastest: float = 2.0
    """Hz."""
    period: float | None = None
    """s after which the motion repeats itself."""

    def _sines(self, time, stream, derivative):
        """(n, 3) sums of eight sines with a root mean square slope of one, or their slopes."""
        generator = np.random.default_rng([self.seed, stream])
        frequency = generator.uniform(0.1, self.fastest, (8, 3))
        if self.period is not None:
            frequency = np.ceil(frequency * self.period) / self.period
        phase = generator.uniform(0.0, 2.0 * np.pi, (8, 3))
        angle = 2.0 * np.pi * frequency * np.asarray(time)[:, None, None] + phase
        size = 0.5 * np.ones((8, 3))
        if derivative:
            return (size * np.cos(angle)).sum(axis=1)
        return (size / (2.0 * np.pi * frequency) * np.sin(angle)).sum(axis=1)

    def world_from_body(self, time):
        """Attitude at each time."""
        angles = self._sines(time, 0, False) * self.turning
        return Rotation.from_euler("ZYX", angles[:, ::-1])

    def rate(self, time):
        """(n, 3) rad/s, body frame."""
        roll, pitch, _ = (self._sines(time, 0, False) * self.turning).T
        of_roll, of_pitch, of_yaw = (self._sines(time, 0, True) * self.turning).T
        return np.column_stack(
            [
                of_roll - np.sin(pitch) * of_yaw,
                np.cos(roll) * of_pitch + np.sin(roll) * np.cos(pitch) * of_yaw,
                -np.sin(roll) * of_pitch + np.cos(roll) * np.cos(pitch) * of_yaw,
            ]
        )

    def force(self, time, lever_arm=(0.0, 0.0, 0.0)):
        """(n, 3) specific force, m/s^2, body frame, at a place in the body."""
        world = np.array([0.0, 0.0, GRAVITY]) + self.pushing * self._sines(time, 1, True)
        rate = self.rate(time)
        change = (self.rate(time + STEP) - self.rate(time - STEP)) / (2.0 * STEP)
        arm = np.broadcast_to(lever_arm, rate.shape)
        return (
            self.world_from_body(time).inv().apply(world)
            + np.cross(change, arm)
            + np.cross(rate, np.cross(rate, arm))
        )


@dataclass(frozen=True)
class Sensor:
    """A unit on the body: where it sits, what its clock shows, and what is wrong with it."""

    sensor_from_body: Rotation = field(default_factory=Rotation.identity)
    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """m, body frame."""
    offset: float = 0.0
    """s, to be added to its clock."""
    skew: float = 0.0
    rate_hz: float = 200.0
    jitter: float = 0.0
    """Share of the sample interval by which samples come early or late, with a true time stamp."""
    gyroscope_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    accelerometer_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gyroscope_stretch: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Scale errors."""
    gyroscope_noise: float = 0.002
    accelerometer_noise: float = 0.02
    """Noise of one sample, rad/s and m/s^2."""


def record(motion, sensor, seconds=60.0, seed=0):
    """Time by the unit's own clock, specific force and angular rate, as the unit has it."""
    generator = np.random.default_rng([motion.seed, seed])
    count = round(seconds * sensor.rate_hz)
    early = sensor.jitter * generator.uniform(-0.5, 0.5, count)
    time = (np.arange(count) + early) / sensor.rate_hz
    rate = sensor.sensor_from_body.apply(motion.rate(time))
    force = sensor.sensor_from_body.apply(motion.force(time, sensor.lever_arm))
    return (
        time - sensor.offset - sensor.skew * (time - 0.5 * seconds),
        force
        + sensor.accelerometer_bias
        + sensor.accelerometer_noise * generator.standard_normal(force.shape),
        rate * (1.0 + np.array(sensor.gyroscope_stretch))
        + sensor.gyroscope_bias
        + sensor.gyroscope_noise * generator.standard_normal(rate.shape),
    )


def recordings(motion, sensors, seconds=60.0, clock=""):
    """One recording a sensor: `unit_0`, the primary, and so on."""
    print(f"seed {motion.seed}")
    return [
        tumble.Recording.from_arrays(f"unit_{k}", *record(motion, sensor, seconds, k), clock=clock)
        for k, sensor in enumerate(sensors)
    ]


def drawn(seed, **changes):
    """A secondary mounted and wrong at random."""
    generator = np.random.default_rng([seed, 99])
    sensor = Sensor(
        sensor_from_body=Rotation.random(random_state=generator.integers(2**31)),
        lever_arm=tuple(generator.uniform(-0.2, 0.2, 3)),
        offset=generator.uniform(-2.0, 2.0),
        skew=generator.uniform(-5e-5, 5e-5),
        gyroscope_bias=tuple(generator.uniform(-0.05, 0.05, 3)),
        accelerometer_bias=tuple(generator.uniform(-0.3, 0.3, 3)),
        gyroscope_stretch=tuple(generator.uniform(-0.01, 0.01, 3)),
    )
    return replace(sensor, **changes)


def errors(unit, primary, secondary, seconds):
    """Estimated less true, with 1-sigma, of everything that `align` finds."""
    truth = secondary.sensor_from_body * primary.sensor_from_body.inv()
    middle = unit.reference_time - 0.5 * seconds
    vector = truth.as_rotvec()
    if np.dot(vector, unit.rotation_vector) < 0.0 and np.linalg.norm(vector) > 3.0:
        # Close to half a turn, one rotation has two vectors.
        vector *= 1.0 - 2.0 * np.pi / np.linalg.norm(vector)
    arm = primary.sensor_from_body.apply(np.subtract(secondary.lever_arm, primary.lever_arm))
    ours = truth.apply(primary.gyroscope_bias), truth.apply(primary.accelerometer_bias)
    return {
        "rotation": (unit.rotation_vector - vector, np.sqrt(np.diag(unit.rotation_covariance))),
        "time offset": (
            unit.time_offset - secondary.offset - secondary.skew * middle,
            unit.time_offset_sigma,
        ),
        "skew": (unit.skew - secondary.skew, unit.skew_sigma),
        "lever arm": (unit.lever_arm - arm, np.sqrt(np.diag(unit.lever_arm_covariance))),
        "gyroscope bias": (
            unit.gyroscope_bias - secondary.gyroscope_bias + ours[0],
            unit.gyroscope_bias_sigma,
        ),
        "accelerometer bias": (
            unit.accelerometer_bias - secondary.accelerometer_bias + ours[1],
            unit.accelerometer_bias_sigma,
        ),
    }
