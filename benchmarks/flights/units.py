"""Inertial units on a flying body: what each reads, with the errors that real ones have."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.flights.body import Body
from benchmarks.redundancy_set import SENSORS, Samples, direction
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName

Pair = tuple[float, float]
"""Accelerometer and gyroscope; m/s^2 and rad/s."""

NOISE_DENSITY: Pair = (1.5e-3, 1.5e-4)
"""Density of white noise, a root hertz; each unit has half to twice of it."""
INSTABILITY: Pair = (1.0e-3, 1.0e-4)
"""Change of the bias, 1 sigma an axis, in each of `INSTABILITY_SECONDS`."""
INSTABILITY_SECONDS = (10.0, 100.0, 1000.0)
PRIMARY_BIAS: Pair = (0.015, 0.0015)
"""Left by the calibration of a primary, 1 sigma an axis."""
SECONDARY_BIAS: Pair = (0.2, 0.02)
"""Left by the factory of a secondary, 1 sigma an axis."""
PRIMARY_MATRIX, SECONDARY_MATRIX = 0.001, 0.006
"""Error of an element, 1 sigma."""
ALIGNMENT = 0.01
"""rad about each axis, 1 sigma, by which a secondary is not mounted as stated."""
AGEING: Pair = (0.1, 0.006)
"""Change of the bias from one flight to the next, 1 sigma an axis; a tenth of it in a primary."""
THERMAL: Pair = (0.2e-3 * STANDARD_GRAVITY, 2.6e-4)
"""Change of the bias, a kelvin, 1 sigma an axis."""
WARMING_SECONDS = (60.0, 300.0)
AMBIENT = 25.0
"""degC at the start of each flight."""
THERMOMETERS = 0.5
"""Share of the units that log a temperature."""
THERMOMETER_OFFSET = 2.0
"""K, 1 sigma, by which a thermometer is wrong throughout."""
THERMOMETER_NOISE = 0.05
"""K, 1 sigma."""
THERMOMETER_STEPS = (1.0 / 340.0, 1.0 / 132.48, 0.125)
"""K: resolutions of an MPU-6000, an ICM-20948 and a BMI088 (their data sheets)."""
ARM = 0.12
"""m, largest of each axis."""
ARM_ERROR = 0.002
"""m an axis, 1 sigma."""
RANGES: tuple[Pair, ...] = (
    (8.0 * STANDARD_GRAVITY, float(np.radians(1000.0))),
    (16.0 * STANDARD_GRAVITY, float(np.radians(2000.0))),
)
BITS = 16
JITTER = 0.03
"""Jitter of a stamp over the interval, 1 sigma; cut at three times that."""
LARGEST_JITTER = 3e-4
"""s, 1 sigma."""
PACE = 0.005
"""Share by which a unit samples faster or slower than it states, 1 sigma."""
DELAY = 1e-3
"""s, largest that a unit stamps late."""
BANDWIDTH = (0.2, 0.5)
"""Cut-off of a unit's filter over its rate."""
LARGEST_BANDWIDTH = 90.0
"""Hz."""
UNFILTERED = 0.15
"""Share of units whose filter lets all vibration through, and aliases it."""


@dataclass(frozen=True, slots=True)
class Line:
    """One frequency at which a vehicle shakes."""

    frequency: float
    """Hz."""
    wander: float
    """Share by which the frequency wanders."""
    period: float
    """s of that."""
    size: tuple[FloatArray, FloatArray]
    """(3,) m/s^2 and rad/s, amplitudes."""
    phase: tuple[FloatArray, FloatArray]
    """(3,) rad."""

    def turned_by(self, time: FloatArray) -> FloatArray:
        """Returns the phase (n,) rad at times (n,) s."""
        turns = 2.0 * np.pi * self.frequency
        swing = self.wander * self.period / (2.0 * np.pi)
        return np.asarray(turns * (time + swing * np.sin(2.0 * np.pi * time / self.period)))


@dataclass(frozen=True, slots=True)
class Shaking:
    """All that shakes a vehicle."""

    lines: tuple[Line, ...]
    at_rest: float
    """Share of it that is there at rest: an engine that idles."""

    def felt(
        self, random: np.random.Generator, body: Body, time: FloatArray, bandwidth: float
    ) -> tuple[FloatArray, FloatArray]:
        """Vibration (n, 3) of a unit: nearly equal everywhere on the body, through its filter."""
        share = self.at_rest + (1.0 - self.at_rest) * body.activity_at(time)
        felt = (np.zeros((len(time), 3)), np.zeros((len(time), 3)))
        for line in self.lines:
            passed = 1.0 / np.hypot(1.0, line.frequency / bandwidth)
            turned = line.turned_by(time)
            for sensor in (0, 1):
                near = line.size[sensor] * (1.0 + 0.1 * random.standard_normal(3))
                late = line.phase[sensor] + 0.2 * random.standard_normal(3)
                felt[sensor][:] += (passed * share)[:, None] * near * np.sin(turned[:, None] + late)
        return felt


@dataclass(frozen=True, slots=True)
class Triad:
    """Errors of three sensors that belong together."""

    matrix: FloatArray
    """(3, 3) readings from what happens, in the primary's axes."""
    bias: FloatArray
    """(3,) at the start of a flight."""
    thermal: FloatArray
    """(3,) a kelvin."""
    density: float
    step: float
    """Resolution."""
    range: float


@dataclass(frozen=True, slots=True)
class Thermometer:
    """Errors of what a unit logs of its temperature."""

    offset: float
    """K."""
    step: float
    """K."""
    seed: int
    """Seed of its noise."""

    def read(self, temperature: FloatArray) -> FloatArray:
        """Returns what it gives (n,) degC at temperatures (n,) degC."""
        noise = THERMOMETER_NOISE * np.random.default_rng(self.seed).standard_normal(len(temperature))
        return np.asarray(np.round((temperature + self.offset + noise) / self.step) * self.step)


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit, and what is stated of it."""

    rate_hz: float
    """Stated."""
    pace_hz: float
    """At which it samples."""
    bandwidth: float
    """Hz."""
    turn: FloatArray
    """(3, 3) sensor from primary, as stated."""
    triads: dict[TriadName, Triad]
    arm: FloatArray
    """(3,) m, in the primary's axes."""
    stated_arm: FloatArray | None
    delay: float
    """s by which its stamps are late."""
    jitter: float
    """s, 1 sigma of a stamp."""
    warming_seconds: float
    thermometer: Thermometer | None = None
    """None where it logs no temperature."""

    def aged(self, random: np.random.Generator, share: float) -> Unit:
        """Returns it as it is at the next flight: each bias elsewhere."""
        triads = {
            name: replace(
                self.triads[name], bias=self.triads[name].bias + share * size * random.standard_normal(3)
            )
            for name, size in zip(SENSORS, AGEING, strict=True)
        }
        return replace(self, triads=triads)

    def warmth(self, time: FloatArray, warming: float) -> FloatArray:
        """Returns by how many kelvins (n,) it is warmer than at the start, at times (n,) s."""
        return np.asarray(-warming * np.expm1(-time / self.warming_seconds))

    def logged_temperature(self, time: FloatArray, warming: float) -> FloatArray | None:
        """Returns the temperature (n,) degC that it logs at times (n,) s; None where it logs none."""
        if self.thermometer is None:
            return None
        return self.thermometer.read(AMBIENT + self.warmth(time, warming))

    def ideal(self, body: Body, time: FloatArray, warming: float) -> dict[TriadName, FloatArray]:
        """Returns what it reads (n, 3) without noise, vibration, resolution and range."""
        felt = dict(zip(SENSORS, body.at(time, self.arm), strict=True))
        warmth = self.warmth(time, warming)[:, None]
        return {
            name: felt[name] @ triad.matrix.T + triad.bias + warmth * triad.thermal
            for name, triad in self.triads.items()
        }


def draw_pace(random: np.random.Generator, rate_hz: float) -> float:
    """Draws the rate, Hz, at which a unit samples that states `rate_hz`: its crystal is its own."""
    return float(rate_hz * (1.0 + PACE * random.standard_normal()))


def draw_unit(random: np.random.Generator, rate_hz: float, number: int, pace_hz: float) -> Unit:
    """Draws a unit that samples at a pace; that of number 0 is the primary, which has been calibrated."""
    turn = np.eye(3) if number == 0 else _mounting(random)
    widest = rate_hz * random.uniform(*BANDWIDTH)
    bandwidth = 4.0 * rate_hz if random.random() < UNFILTERED else min(widest, LARGEST_BANDWIDTH)
    arm = np.zeros(3) if number == 0 else random.uniform(-ARM, ARM, 3)
    return Unit(
        rate_hz=rate_hz,
        pace_hz=pace_hz,
        bandwidth=bandwidth,
        turn=turn,
        triads=_triads(random, turn, number, RANGES[int(random.integers(len(RANGES)))]),
        arm=arm,
        stated_arm=None if number == 0 else arm + ARM_ERROR * random.standard_normal(3),
        delay=0.0 if number == 0 else float(random.uniform(0.0, DELAY)),
        jitter=min(JITTER / rate_hz, LARGEST_JITTER),
        warming_seconds=float(random.uniform(*WARMING_SECONDS)),
    )


def draw_thermometer(random: np.random.Generator) -> Thermometer | None:
    """Draws whether a unit logs its temperature, and how well."""
    if random.random() >= THERMOMETERS:
        return None
    return Thermometer(
        offset=float(THERMOMETER_OFFSET * random.standard_normal()),
        step=float(random.choice(THERMOMETER_STEPS)),
        seed=int(random.integers(2**32)),
    )


def _triads(
    random: np.random.Generator, turn: FloatArray, number: int, ranges: Pair
) -> dict[TriadName, Triad]:
    sizes = PRIMARY_BIAS if number == 0 else SECONDARY_BIAS
    error = PRIMARY_MATRIX if number == 0 else SECONDARY_MATRIX
    lean = np.zeros(3) if number == 0 else ALIGNMENT * random.standard_normal(3)
    found = {}
    for sensor, name in enumerate(SENSORS):
        shape = np.eye(3) + error * random.standard_normal((3, 3)) - _cross(lean)
        found[name] = Triad(
            matrix=shape @ turn,
            bias=sizes[sensor] * random.standard_normal(3),
            thermal=THERMAL[sensor] * random.standard_normal(3),
            density=NOISE_DENSITY[sensor] * float(np.exp(random.uniform(np.log(0.5), np.log(2.0)))),
            step=2.0 * ranges[sensor] / 2**BITS,
            range=ranges[sensor],
        )
    return found


def _cross(vector: FloatArray) -> FloatArray:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _mounting(random: np.random.Generator) -> FloatArray:
    """Draws one of the 24 turns of a cube onto itself, or any turn."""
    if random.random() < 0.7:
        turn = np.eye(3)[random.permutation(3)] * random.choice([-1.0, 1.0], 3)[:, None]
        return np.asarray(turn * np.linalg.det(turn))
    angle, axis = random.uniform(0.0, np.pi), _cross(direction(random))
    return np.asarray(np.eye(3) + np.sin(angle) * axis + (1.0 - np.cos(angle)) * axis @ axis)


def read(random: np.random.Generator, unit: Unit, body: Body, shaking: Shaking, warming: float) -> Samples:
    """Returns what a unit reads, before resolution and range: faults come before these."""
    count = int((body.time[-3] - 1.0 / unit.pace_hz) * unit.pace_hz)
    instants = np.asarray((np.arange(count) + random.random()) / unit.pace_hz)
    late = np.clip(random.standard_normal(count), -3.0, 3.0) * unit.jitter
    felt = body.at(instants, unit.arm)
    shaken = shaking.felt(random, body, instants, unit.bandwidth)
    warmth = unit.warmth(instants, warming)[:, None]
    readings = []
    for sensor, name in enumerate(SENSORS):
        triad = unit.triads[name]
        unstable = INSTABILITY[sensor] * _instability(random, instants)
        bias = triad.bias + warmth * triad.thermal + unstable
        noise = triad.density * np.sqrt(unit.rate_hz / 2.0) * random.standard_normal((count, 3))
        readings.append((felt[sensor] + shaken[sensor]) @ triad.matrix.T + bias + noise)
    return Samples(instants + unit.delay + late, instants, *readings)


def _instability(random: np.random.Generator, time: FloatArray) -> FloatArray:
    """Returns a sum of Gauss-Markov processes (n, 3), each of 1 sigma; worked out once a second."""
    seconds = np.arange(time[-1] + 2.0)
    found = np.zeros((len(seconds), 3))
    for constant in INSTABILITY_SECONDS:
        kept = np.exp(-1.0 / constant)
        drawn = random.standard_normal((len(seconds), 3))
        value = drawn[0]
        for second, each in enumerate(drawn):
            value = kept * value + np.sqrt(1.0 - kept**2) * each
            found[second] += value
    return np.column_stack([np.interp(time, seconds, column) for column in found.T])


def digitised(samples: Samples, unit: Unit) -> Samples:
    """Returns the samples as the unit gives them: in steps, within its range."""
    given = [
        np.clip(np.round(samples.of(name) / triad.step) * triad.step, -triad.range, triad.range)
        for name, triad in unit.triads.items()
    ]
    return replace(samples, specific_force=given[0], angular_rate=given[1])


def stalled(samples: Samples, spans: FloatArray) -> Samples:
    """Returns the samples that are left where none comes in `spans` (n, 2) s."""
    kept = np.ones(len(samples.arrival), dtype=bool)
    for start, end in spans:
        kept &= (samples.arrival < start) | (samples.arrival >= end)
    return Samples(
        samples.time[kept], samples.arrival[kept], samples.specific_force[kept], samples.angular_rate[kept]
    )
