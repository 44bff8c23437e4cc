"""A redundant set made of a few lines: it rests, is turned and pushed about, and rests again.

Independent of `tumble simulate flight`, so that what one of the two has wrong shows in the other.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from turntable_sessions import one_line, typed

GRAVITY = 9.80665
CHANNELS = ("ax", "ay", "az", "gx", "gy", "gz")
FINE = 1000.0
"""Hz, at which the motion is worked out."""
RAMP = 1.0
"""s in which motion begins and ends."""
FACING_DOWN = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""A unit on the other side of the board."""
QUICK = ("--set", "collect=20", "--set", "collect_timeout=60", "--set", "evaluate_every=5")
"""Settings for a log of less than a minute."""


@dataclass(frozen=True)
class Motion:
    """Motion of the platform: rest, motion, rest; vectors are in the primary's case frame."""

    time: np.ndarray
    specific_force: np.ndarray
    angular_rate: np.ndarray
    angular_acceleration: np.ndarray

    def at(self, lever_arm):
        """(n, 3) specific force at a place, m."""
        arm = np.broadcast_to(np.array(lever_arm, dtype=float), self.angular_rate.shape)
        across = np.cross(self.angular_rate, np.cross(self.angular_rate, arm))
        return self.specific_force + np.cross(self.angular_acceleration, arm) + across


def motion(rest=5.0, moving=30.0, after=6.0, swing=(1.0, 0.8, 1.2), push=2.0):
    """Swing about the three axes by so much, rad, and push about by so much, m/s^2."""
    time = np.arange(round((rest + moving + after) * FINE)) / FINE
    since = np.clip(np.minimum(time - rest, rest + moving - time) / RAMP, 0.0, 1.0)
    envelope = np.sin(0.5 * np.pi * since) ** 2
    speeds, phases = (1.9, 1.3, 0.7), (0.3, 1.1, 2.3)
    angles = np.column_stack(
        [a * envelope * np.sin(s * time + p) for a, s, p in zip(swing, speeds, phases, strict=True)]
    )
    world_from_case = Rotation.from_euler("ZYX", angles[:, ::-1])
    ahead, behind = world_from_case[2:], world_from_case[:-2]
    rate = np.zeros((len(time), 3))
    rate[1:-1] = (behind.inv() * ahead).as_rotvec() * (FINE / 2.0)
    pushes = push * envelope[:, None] * np.sin(np.outer(time, [2.3, 1.7, 2.9]) + np.arange(3.0))
    force = world_from_case.inv().apply(pushes + np.array([0.0, 0.0, GRAVITY]))
    return Motion(time, force, rate, np.gradient(rate, 1.0 / FINE, axis=0))


@dataclass(frozen=True)
class Imu:
    """One unit of the set; M and b are those of its errors, in its own axes."""

    name: str
    rate_hz: float = 100.0
    accelerometer_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gyroscope_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    accelerometer_scale: float = 1.0
    gyroscope_scale: float = 1.0
    accelerometer_noise: float = 0.02
    gyroscope_noise: float = 0.002
    """Noise of one sample, m/s^2 and rad/s."""
    mounting: np.ndarray | None = None
    """(3, 3) sensor from the primary's case."""
    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    clock: float = 0.0
    """s by which its clock is ahead."""


PRIMARY = Imu("imu1", accelerometer_noise=0.01, gyroscope_noise=0.001)
BIASED = Imu(
    "imu2",
    accelerometer_bias=(0.25, -0.2, 0.3),
    gyroscope_bias=(0.03, -0.02, 0.025),
    accelerometer_scale=1.01,
    gyroscope_scale=0.99,
)
SOUND = Imu("imu3", accelerometer_bias=(0.01, -0.01, 0.02), gyroscope_bias=(0.001, 0.001, -0.001))


@dataclass
class Said:
    """Samples of one unit, which tests may corrupt."""

    imu: Imu
    time: np.ndarray
    readings: np.ndarray
    """(n, 6) m/s^2 and rad/s."""

    def between(self, start, end):
        """Mask of the samples from one time to another."""
        return (self.time >= start) & (self.time < end)

    def part(self, start=-np.inf, end=np.inf):
        kept = self.between(start, end)
        return replace(self, time=self.time[kept], readings=self.readings[kept])

    def write(self, path, header=None):
        """Writes it as a log of its own; a reading that is no number stands as `nan`."""
        header = header or ",".join(("time", *CHANNELS))
        rows = np.column_stack([self.time, self.readings])
        path.write_text("\n".join([header, *(",".join(map(repr, row)) for row in rows.tolist())]) + "\n")
        return path


def record(imus, seed, moved=None):
    """Simulates the units; prints the seed for the analysis of failures."""
    print(f"seed {seed}")
    moved = moved or motion()
    generator = np.random.default_rng(seed)
    return {imu.name: _said(imu, moved, generator) for imu in imus}


def _said(imu, moved, generator):
    time = np.arange(0.0, moved.time[-1], 1.0 / imu.rate_hz)
    turn = np.eye(3) if imu.mounting is None else imu.mounting
    felt = [
        _at(time, moved.time, values) @ turn.T for values in (moved.at(imu.lever_arm), moved.angular_rate)
    ]
    noise = generator.standard_normal((len(time), 6))
    force = (
        imu.accelerometer_scale * felt[0] + imu.accelerometer_bias + imu.accelerometer_noise * noise[:, :3]
    )
    rate = imu.gyroscope_scale * felt[1] + imu.gyroscope_bias + imu.gyroscope_noise * noise[:, 3:]
    return Said(imu, time + imu.clock, np.hstack([force, rate]))


def _at(time, fine, values):
    return np.column_stack([np.interp(time, fine, column) for column in values.T])


def write_table(path, said):
    """Writes units of one rate as one table, with a prefix each."""
    first = next(iter(said.values()))
    names = ["time", *(f"{name}_{channel}" for name in said for channel in CHANNELS)]
    rows = np.column_stack([first.time, *(unit.readings for unit in said.values())])
    path.write_text("\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows.tolist())]) + "\n")
    return path


def units(said):
    """Names the first unit as primary, the others as secondaries."""
    primary, *secondaries = said
    return ["--primary", primary, *(word for name in secondaries for word in ("--secondary", name))]


def replay(*arguments, code=0):
    """Runs `tumble redundancy` as typed; returns the result and its events. `code` None: 0 or 3."""
    done = typed("redundancy", *arguments, "--json")
    assert done.code in (0, 3), f"exit code {done.code}: {done.err}"
    result = json.loads(done.out)
    assert code in (done.code, None), f"exit code {done.code}: {result['events']}"
    lines = Path(result["files"]["events"]).read_text(encoding="utf-8").splitlines()
    return result, [json.loads(line) for line in lines]


def refusal(*arguments):
    """The one line with which `tumble redundancy` ends when nothing can be done."""
    done = typed("redundancy", *arguments)
    assert done.code == 2, f"exit code {done.code}: {done.out}{done.err}"
    assert done.out == ""
    return one_line(done.err)


def of(events, unit, event):
    """The events of that kind of one unit."""
    return [each for each in events if each["unit"] == unit and each["event"] == event]
