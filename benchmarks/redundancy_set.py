"""A set of units on one body, simulated in numpy: independent of the core and of `tumble simulate flight`.

The body rests, and between rests it turns, is pushed about and shaken by rotors. Each unit has what a unit
has that is within its specification: errors left by its factory, drift with temperature and time, noise,
jitter and an offset of its clock, a mounting and a place that are not quite those that are stated.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np

from tumble import _core
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName

SENSORS: tuple[TriadName, TriadName] = ("accelerometer", "gyroscope")
STEP = 0.004
"""s between the moments at which the motion is worked out; linear in between."""
RAMP = 1.5
"""s in which motion begins and ends."""
RANGE = (156.9, 34.9)
"""m/s^2 and rad/s that a unit can measure."""
NOISE = (0.02, 0.002)
"""m/s^2 and rad/s, of a sample; each unit has half to three halves of it."""
PRIMARY_ERROR = ((0.015, 0.001), (0.0015, 0.001))
"""Bias and matrix element that the calibration of a primary leaves, 1 sigma, accelerometer and gyroscope."""
SECONDARY_ERROR = (((0.15, 0.4), 0.005), ((0.015, 0.04), 0.005))
"""Length of the bias of a secondary, least and most, and matrix element, 1 sigma."""
WARMING = (0.01, 0.001)
"""Change of the bias that warming up brings in the end, m/s^2 and rad/s, 1 sigma an axis."""
WARMING_SECONDS = 150.0
WANDER = (0.002, 0.0002)
"""Amplitude of slow wander of the bias, m/s^2 and rad/s, 1 sigma an axis."""
WANDER_SECONDS = (150.0, 600.0)
LARGEST_OFFSET = 1e-3
"""s by which the clock of a secondary is off at most."""
JITTER = 2e-4
"""s, of a time stamp, 1 sigma, cut at twice that."""
ARM_ERROR = 0.002
"""m an axis, 1 sigma, between a place and what is stated of it."""
UNSTATED_ARMS = 0.1
"""Share of the secondaries whose place is not stated."""
VIBRATION = {"weak": (0.6, 0.02), "strong": (3.0, 0.12)}
"""m/s^2 and rad/s of the rotors' tone before the filter of a unit."""
BROADBAND = 0.03
"""White noise that comes with a rotor's tone, over the tone."""
FILTER = 0.25
"""Cut-off of the filter of a unit over its rate; no unit has one above `LARGEST_CUT_OFF`."""
LARGEST_CUT_OFF = 60.0
"""Hz."""
RATES_HZ = (100.0, 200.0, 250.0, 400.0)


@dataclass(frozen=True, slots=True)
class Samples:
    """Samples of one unit."""

    time: FloatArray
    """(n,) s, as stamped."""
    arrival: FloatArray
    """(n,) s, when it comes."""
    specific_force: FloatArray
    """(n, 3) m/s^2."""
    angular_rate: FloatArray
    """(n, 3) rad/s."""
    drift: dict[TriadName, FloatArray] = field(default_factory=dict, kw_only=True)
    """(n, 3) of the bias of each sensor, where it is known."""

    def of(self, sensor: TriadName) -> FloatArray:
        """Returns the readings (n, 3) of a sensor."""
        return self.specific_force if sensor == "accelerometer" else self.angular_rate

    def part(self, start: float, end: float) -> Samples:
        """Returns what arrived from one time to another, s; of the drift nothing."""
        kept = slice(*np.searchsorted(self.arrival, (start, end)))
        return Samples(
            self.time[kept], self.arrival[kept], self.specific_force[kept], self.angular_rate[kept]
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """Truth of a unit, and the statements about it."""

    rate_hz: float
    turn: FloatArray
    """(3, 3) sensor from primary, as stated."""
    matrix: dict[TriadName, FloatArray]
    """(3, 3) readings from what happens in the primary's axes."""
    bias: dict[TriadName, FloatArray]
    noise: dict[TriadName, float]
    arm: FloatArray
    """(3,) m, of the primary's axes."""
    stated_arm: FloatArray | None
    offset: float
    """s by which its stamps are ahead."""

    def told(self, number: int) -> _core.RedundancyUnit:
        """Returns the unit as the builder of the set describes it."""
        return _core.RedundancyUnit(
            number + 1,
            sensor_from_primary=np.ascontiguousarray(self.turn) if number else None,
            lever_arm=self.stated_arm if number else None,
            specific_force_range=RANGE[0],
            angular_rate_range=RANGE[1],
        )


@dataclass(frozen=True, slots=True)
class Body:
    """Motion of the primary's place on a grid of `STEP`, in the primary's axes."""

    time: FloatArray
    specific_force: FloatArray
    angular_rate: FloatArray
    angular_acceleration: FloatArray
    envelope: FloatArray
    """(n,) 0 at rest, 1 in motion."""
    level_from_body: FloatArray
    """(n, 3, 3)."""

    def part(self, since: float, every: int) -> Body:
        """Returns one moment of so many, from a time on, s."""
        kept = slice(int(np.searchsorted(self.time, since)), None, every)
        return Body(*(getattr(self, each.name)[kept] for each in fields(self)))

    def carried(self, arm: FloatArray) -> FloatArray:
        """Specific force (n, 3) that a place has more than the primary's, `arm` m away."""
        w = self.angular_rate
        return np.asarray(np.cross(self.angular_acceleration, arm) + np.cross(w, np.cross(w, arm)))


@dataclass(frozen=True, slots=True)
class SimulatedSet:
    """A body, its units, and their samples without a fault."""

    body: Body
    units: tuple[Unit, ...]
    samples: tuple[Samples, ...] = field(default=())


def simulate_set(
    random: np.random.Generator, count: int, spans: FloatArray, duration: float, vibration: str
) -> SimulatedSet:
    """Simulates `count` units for `duration` s; `spans` (n, 2) s are those of motion."""
    body = _body(random, spans, duration)
    units = (_primary(random), *(_secondary(random) for _ in range(1, count)))
    rotors = _Rotors(random, body, VIBRATION[vibration])
    return SimulatedSet(body, units, tuple(_said(random, body, unit, rotors) for unit in units))


def _body(random: np.random.Generator, spans: FloatArray, duration: float) -> Body:
    time = np.asarray(np.arange(round(duration / STEP) + 2) * STEP, dtype=float)
    envelope = np.zeros(len(time))
    angles = np.zeros((len(time), 3))
    tilt = np.radians(8.0) * np.array([1.0, 1.0, 0.0])
    angles += tilt * random.standard_normal(3)
    for start, end in spans:
        envelope += np.sin(0.5 * np.pi * np.clip(np.minimum(time - start, end - time) / RAMP, 0.0, 1.0)) ** 2
        done = np.clip((time - start) / (end - start), 0.0, 1.0)
        change = tilt * random.standard_normal(3) + [0.0, 0.0, random.uniform(-1.0, 1.0)]
        angles += (done**3 * (10.0 - 15.0 * done + 6.0 * done**2))[:, None] * change
    swing = random.uniform([0.2, 0.2, 0.1], [0.6, 0.6, 0.5])
    angles += envelope[:, None] * swing * _sines(random, time, (0.05, 0.6))
    push = random.uniform(0.5, 3.0) * envelope[:, None] * _sines(random, time, (0.1, 1.5))
    turn = _rotation(angles)
    rate = _rate(angles, np.asarray(np.gradient(angles, STEP, axis=0)))
    force = np.einsum("nij,ni->nj", turn, push + np.array([0.0, 0.0, STANDARD_GRAVITY]))
    return Body(time, force, rate, np.gradient(rate, STEP, axis=0), envelope, turn)


def _sines(random: np.random.Generator, time: FloatArray, band: tuple[float, float]) -> FloatArray:
    """Three columns of three sines each, of a root mean square of about 0.7, frequencies in Hz."""
    found = np.zeros((len(time), 3))
    for column in range(3):
        for _ in range(3):
            frequency = np.exp(random.uniform(*np.log(band)))
            phase = random.uniform(0.0, 2.0 * np.pi)
            found[:, column] += np.sin(2.0 * np.pi * frequency * time + phase) / np.sqrt(3.0)
    return found


def _rotation(angles: FloatArray) -> FloatArray:
    """Level from body (n, 3, 3), of roll, pitch, yaw (n, 3)."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(angles).T, np.cos(angles).T
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _rate(angles: FloatArray, change: FloatArray) -> FloatArray:
    """Angular rate (n, 3) in the axes of the body."""
    (sr, sp, _), (cr, cp, _) = np.sin(angles).T, np.cos(angles).T
    roll, pitch, yaw = change.T
    return np.column_stack([roll - sp * yaw, cr * pitch + sr * cp * yaw, -sr * pitch + cr * cp * yaw])


class _Rotors:
    """A tone and its second harmonic, of a speed that wanders so that it never aliases to a standstill."""

    def __init__(self, random: np.random.Generator, body: Body, strength: tuple[float, float]) -> None:
        self.frequency = random.uniform(70.0, 180.0)
        self.strength = strength
        self.directions = random.standard_normal((2, 2, 3)) / np.sqrt(3.0)
        wander = 1.0 + 0.03 * _sines(random, body.time, (0.05, 1.0))[:, 0]
        self.phase = 2.0 * np.pi * np.cumsum(self.frequency * wander) * STEP
        self.body = body

    def felt(self, random: np.random.Generator, time: FloatArray, rate_hz: float) -> tuple[FloatArray, ...]:
        """Returns what both sensors (n, 3) of a unit feel at their place, after their filter."""
        phase = np.interp(time, self.body.time, self.phase)
        envelope = np.interp(time, self.body.time, self.body.envelope)
        speed = 0.7 + 0.3 * envelope
        cut_off = min(FILTER * rate_hz, LARGEST_CUT_OFF)
        found = []
        for sensor in range(2):
            near = 1.0 + 0.15 * random.standard_normal((2, 3))
            shaken = BROADBAND * random.standard_normal((len(time), 3))
            for harmonic, direction in enumerate(self.directions[sensor] * near, start=1):
                passed = 1.0 / (1.0 + (harmonic * self.frequency / cut_off) ** 2)
                shaken += passed * np.outer(np.sin(harmonic * phase), direction) / harmonic
            found.append(self.strength[sensor] * (speed * envelope)[:, None] * shaken)
        return tuple(found)


def _primary(random: np.random.Generator) -> Unit:
    errors = dict(zip(SENSORS, PRIMARY_ERROR, strict=True))
    return Unit(
        rate_hz=float(random.choice(RATES_HZ)),
        turn=np.eye(3),
        matrix={name: _near_one(random, each[1]) for name, each in errors.items()},
        bias={name: each[0] * random.standard_normal(3) for name, each in errors.items()},
        noise=_noise(random),
        arm=np.zeros(3),
        stated_arm=None,
        offset=0.0,
    )


def _secondary(random: np.random.Generator) -> Unit:
    errors = dict(zip(SENSORS, SECONDARY_ERROR, strict=True))
    turn = _square_rotation(random)
    arm = random.uniform(-0.1, 0.1, 3)
    stated = arm + ARM_ERROR * random.standard_normal(3)
    return Unit(
        rate_hz=float(random.choice(RATES_HZ)),
        turn=turn,
        matrix={name: _near_one(random, each[1]) @ turn for name, each in errors.items()},
        bias={name: random.uniform(*each[0]) * direction(random) for name, each in errors.items()},
        noise=_noise(random),
        arm=arm,
        stated_arm=None if random.random() < UNSTATED_ARMS else stated,
        offset=float(random.uniform(-LARGEST_OFFSET, LARGEST_OFFSET)),
    )


def direction(random: np.random.Generator) -> FloatArray:
    """Draws a unit vector (3,)."""
    vector = random.standard_normal(3)
    return np.asarray(vector / np.linalg.norm(vector))


def _near_one(random: np.random.Generator, sigma: float) -> FloatArray:
    return np.eye(3) + sigma * random.standard_normal((3, 3))


def _noise(random: np.random.Generator) -> dict[TriadName, float]:
    return {name: float(random.uniform(0.5, 1.5)) * each for name, each in zip(SENSORS, NOISE, strict=True)}


def _square_rotation(random: np.random.Generator) -> FloatArray:
    """One of the 24 turns of a cube onto itself."""
    turn = np.eye(3)[random.permutation(3)] * random.choice([-1.0, 1.0], 3)[:, None]
    return np.asarray(turn * np.linalg.det(turn))


def _said(random: np.random.Generator, body: Body, unit: Unit, rotors: _Rotors) -> Samples:
    count = int((body.time[-1] - 0.01) * unit.rate_hz)
    instants = np.asarray((np.arange(count) + random.random()) / unit.rate_hz, dtype=float)
    stamps = instants + unit.offset + np.clip(JITTER * random.standard_normal(count), -2 * JITTER, 2 * JITTER)
    felt = _between(instants, np.hstack([body.specific_force + body.carried(unit.arm), body.angular_rate]))
    shaken = rotors.felt(random, instants, unit.rate_hz)
    readings, drifts = [], {}
    for sensor, name in enumerate(SENSORS):
        true = felt[:, 3 * sensor : 3 * sensor + 3] + shaken[sensor]
        noise = unit.noise[name] * random.standard_normal((count, 3))
        drifts[name] = _drift(random, instants, sensor)
        bias = unit.bias[name] + drifts[name]
        readings.append(np.ascontiguousarray(true @ unit.matrix[name].T + bias + noise))
    return Samples(stamps, instants, *readings, drift=drifts)


def _between(time: FloatArray, columns: FloatArray) -> FloatArray:
    place = time / STEP
    index = place.astype(int)
    share = (place - index)[:, None]
    return np.asarray((1.0 - share) * columns[index] + share * columns[index + 1])


def _drift(random: np.random.Generator, time: FloatArray, sensor: int) -> FloatArray:
    """Returns what warming and wander add to a bias, (n, 3); of seconds, and linear in between."""
    seconds = np.arange(time[-1] + 2.0)
    warming = np.outer(-np.expm1(-seconds / WARMING_SECONDS), WARMING[sensor] * random.standard_normal(3))
    period = random.uniform(*WANDER_SECONDS, 3)
    phase = random.uniform(0.0, 2.0 * np.pi, 3)
    wander = np.sin(2.0 * np.pi * seconds[:, None] / period + phase)
    drift = warming + WANDER[sensor] * random.standard_normal(3) * wander
    return np.column_stack([np.interp(time, seconds, column) for column in drift.T])
