"""The evidence of values for their unit: how likely each unit makes them, given what sensors are like.

The unit that makes values likely by far is recognised. Where another makes them nearly as likely, the unit is
an assumption, which is reported, or the user is asked for it (docs/theory/units.md).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.logs.triads import whole

ASKED = math.log(20.0)
"""Logarithm of the ratio of likelihoods below which two units fit alike, and the user is asked."""
CERTAIN = math.log(1000.0)
"""The same: above it a unit is recognised without a warning."""


@dataclass(frozen=True, slots=True)
class Usual:
    """Log-normal distribution of a positive figure of sensors or of sessions, with some that are unusual."""

    median: float
    factor: float
    """Factor that is one sigma."""
    unusual: float
    """Density of the unusual ones, relative to the peak of the distribution."""

    def log_likelihood(self, value: float) -> float:
        """Returns the logarithm of the density relative to its peak."""
        sigmas = math.log(value / self.median) / math.log(self.factor)
        return max(-0.5 * sigmas * sigmas, math.log(self.unusual))  # units.md, eq. 1


IMU_RATE = Usual(100.0, 5.0, 1e-4)
"""Hz: loggers write 10 to 1000 samples a second."""
MAGNETOMETER_RATE = Usual(20.0, 5.0, 1e-4)
"""Hz: magnetometers of compasses sample at 1 to 100 Hz."""
DURATION = Usual(120.0, 8.0, 1e-4)
"""s: logs take from ten seconds to a night."""
COUNTED_IN_FRACTIONS = 0.01
"""Share of stamps with fractions that are no seconds: counters of ms, us and ns count whole ones."""
RATE_NOISE = Usual(math.radians(0.003), 5.0, 1e-2)
"""rad/s/sqrt(Hz): of data sheets of MEMS gyroscopes, tactical to cheapest; vibration makes it unusual."""
RATE_BIAS = Usual(math.radians(0.5), 4.0, 1e-4)
"""rad/s: zero-rate output of data sheets of MEMS gyroscopes."""
OPTICAL_NOISE = Usual(math.radians(1.5e-4), 5.0, 1e-2)
"""rad/s/sqrt(Hz): of data sheets of gyroscopes of fibres and lasers, 0.001 to 0.1 deg/sqrt(h)."""
OPTICAL_BIAS = Usual(math.radians(0.003), 3.0, 1e-4)
"""rad/s: these read the Earth's rotation, 0.004 deg/s at most, rather than a bias."""
OPTICAL = 0.01
"""Share of logs that are of such a gyroscope."""
RATE_UNITS = {"rad/s": 1.0, "deg/s": 1.0, "mdeg/s": 0.01}
"""Units of a gyroscope that readings may show, by how usual they are where no unit is stated: drivers of
chips write mdeg/s. mrad/s, in which most gyroscopes read nearly as in deg/s, has to be stated."""
STILL_NOISE = 0.01
"""m/s^2/sqrt(Hz): twice the largest of data sheets; what shakes more is carried, or flies."""
STILL_TURN = math.radians(0.5)
"""rad/s by which gravity turns at most where nothing moves, within its noise over a second."""


@dataclass(frozen=True, slots=True)
class StillReadings:
    """Stretch of a head in which gravity stood still, as a gyroscope reads it."""

    rate: float
    """Length of the mean reading across gravity, in the unit of the log."""
    noise: float
    """White noise of an axis, in that unit per sqrt(Hz); 0 where readings repeat."""


_STRETCH = 1.0
"""s of that stretch."""
_FEWEST = 16
"""Samples of one."""
_FEWEST_STRETCHES = 8
"""Stretches that show whether a unit sways."""
_LEVEL = 2.0
"""Ratio of the variance of their means to that of white noise below which it does not."""


def rest_in(specific_force: FloatArray, readings: FloatArray, interval: float) -> StillReadings | None:
    """Returns the stretch in which (n, 3) specific force varies least; None where it is no rest.

    `readings` are (n, 3) of the gyroscope in any unit, `interval` is that of samples, s.
    """
    if math.isnan(interval):
        return None
    numbers = whole(specific_force) & whole(readings)
    force, rate = specific_force[numbers], readings[numbers]
    length = max(_FEWEST, round(_STRETCH / interval))
    length = min(length, len(force))
    if length < _FEWEST:
        return None
    count = len(force) // length
    stretches = force[: count * length].reshape(count, length, 3)
    best = int(np.argmin(stretches.var(axis=1).sum(axis=1)))
    chosen = slice(best * length, (best + 1) * length)
    half = length // 2
    first, last = (_direction(part) for part in (stretches[best, :half], stretches[best, -half:]))
    up = _direction(stretches[best])
    # d up/dt = -rate x up, so that up x d up/dt is minus the rate across it.
    turned = float(np.linalg.norm(np.cross(first, last))) / ((length - half) * interval)  # units.md, eq. 3
    noise = _white_noise(stretches[best], interval)
    # Readings without any noise are those of a unit that repeats one, which shows nothing.
    if turned > STILL_TURN or noise == 0.0:
        return None
    if noise >= STILL_NOISE and not _holds_level(stretches, noise, length * interval):
        return None
    mean = rate[chosen].mean(axis=0)
    return StillReadings(
        float(np.linalg.norm(mean - up * float(mean @ up))), _white_noise(rate[chosen], interval)
    )


def _holds_level(stretches: FloatArray, noise: float, duration: float) -> bool:
    """Returns whether means of successive stretches (n, k, 3) of that many s differ as white noise does.

    A unit of large noise at a low rate shakes as much as one that is carried, but does not sway.
    """
    if len(stretches) < _FEWEST_STRETCHES:
        return False
    apart = np.diff(stretches.mean(axis=1), axis=0)
    return bool(np.mean(apart**2) / 2.0 < _LEVEL * noise**2 / duration)  # units.md, eq. 1a


def _white_noise(values: FloatArray, interval: float) -> float:
    """Returns that of an axis of (n, 3), from successive differences, which slow motion leaves alone."""
    return math.sqrt(float(np.mean(np.diff(values, axis=0) ** 2)) / 2.0 * interval)  # units.md, eq. 2


def _direction(force: FloatArray) -> FloatArray:
    mean = force.mean(axis=0)
    return np.asarray(mean / max(float(np.linalg.norm(mean)), 1e-300))


def log_likelihood_of_rate_unit(rest: StillReadings, unit: float) -> float:
    """Returns that of a unit of the gyroscope, rad/s, relative to the likeliest readings of any gyroscope.

    A body that turns about an axis across gravity takes gravity with it: at rest such a rate is bias, or the
    Earth's rotation.
    """
    kinds = (
        (math.log1p(-OPTICAL), RATE_NOISE, RATE_BIAS),
        (math.log(OPTICAL), OPTICAL_NOISE, OPTICAL_BIAS),
    )
    found = [share + _of_kind(rest, unit, noise, bias) for share, noise, bias in kinds]
    return float(np.logaddexp.reduce(found))  # units.md, eq. 4


def _of_kind(rest: StillReadings, unit: float, noise: Usual, bias: Usual) -> float:
    figures = ((noise, rest.noise * unit), (bias, rest.rate * unit))
    return sum(usual.log_likelihood(figure) for usual, figure in figures if figure > 0.0)


def log_likelihood_of_step(step: float, samples: int | None, rates: Usual) -> float:
    """Returns that of a step of s between samples, of which a log holds that many, where it is known."""
    found = rates.log_likelihood(1.0 / step)  # units.md, eq. 5
    return found if samples is None else found + DURATION.log_likelihood(step * max(samples, 1))


def ordered(likelihoods: Mapping[str, float]) -> list[tuple[str, float]]:
    """Returns names, the likeliest first, each with how much less likely it is than that, in logarithms."""
    names = sorted(likelihoods, key=lambda name: -likelihoods[name])
    return [(name, likelihoods[names[0]] - likelihoods[name]) for name in names]
