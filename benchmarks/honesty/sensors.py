"""Imperfections within a sensor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import erfc

import numpy as np

from benchmarks.honesty.motion import GRAVITY, FloatArray, Motion
from benchmarks.honesty.session import TRIADS, WHITE, Session, Unit


def _target(session: Session) -> Unit:
    return session.units[-1]


def quantise(session: Session, size: float) -> None:
    """Rounds readings to steps of so many standard deviations of noise."""
    unit = _target(session)
    steps = [size * unit.noise[triad] for triad in TRIADS]

    def rounded(_: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        _round_noise(session, unit, (force, rate), steps)
        return steps[0] * np.round(force / steps[0]), steps[1] * np.round(rate / steps[1])

    unit.rounds.append(rounded)


def print_decimals(session: Session, size: float) -> None:
    """Prints so many decimals, in m/s² and rad/s."""
    unit = _target(session)
    unit.decimals = (round(size), round(size))

    def printed(_: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        # The file has its own units.
        _round_noise(session, unit, (force, rate), [10.0 ** -round(size) / scale for scale in unit.scale])
        return force, rate

    unit.rounds.append(printed)


def _round_noise(
    session: Session, unit: Unit, read: tuple[FloatArray, FloatArray], steps: Sequence[float]
) -> None:
    """Makes the true white noise that of rounded readings: of a normal variable in cells of a step."""
    for triad, values, step in zip(TRIADS, read, steps, strict=True):
        if (triad, WHITE) not in unit.terms:
            continue
        sigma = unit.terms[triad, WHITE] * np.sqrt(session.rate_hz)
        reach = 10 + int(8.0 * sigma.max() / step)
        cells = step * np.arange(-reach, 1 + reach)[:, None]
        off = np.remainder(np.median(values, axis=0), step)
        inside = np.diff(_normal((np.vstack([cells, cells[-1:] + step]) - 0.5 * step - off) / sigma), axis=0)
        mean = (inside * cells).sum(axis=0)
        variance = (inside * (cells - mean) ** 2).sum(axis=0)
        unit.terms[triad, WHITE] = np.sqrt(variance / session.rate_hz)


def _normal(z: FloatArray) -> FloatArray:
    """Distribution function of a normal variable."""
    return 0.5 * np.asarray(np.vectorize(erfc)(-z / np.sqrt(2.0)), dtype=float)


def saturate(session: Session, size: float) -> None:
    """Cuts the accelerometer's x axis off above so many g."""

    def clipped(_: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        force[:, 0] = np.minimum(force[:, 0], size * GRAVITY)
        return force, rate

    _target(session).reads.append(clipped)


def bend(session: Session, size: float) -> None:
    """Adds a share of the square of the specific force along each axis, µg/g², of drawn sign."""
    curvature = 1e-6 * size * session.rng.choice([-1.0, 1.0], 3) / GRAVITY
    _target(session).sees.append(lambda _, force, rate: (force + curvature * force**2, rate))


def skew(session: Session, size: float) -> None:
    """Has scales of both signs differ by so many ppm; the truth is their mean."""
    half = 0.5e-6 * size
    _target(session).sees.append(
        lambda _, force, rate: (force + half * np.abs(force), rate + half * np.abs(rate))
    )


def feel_gravity(session: Session, size: float) -> None:
    """Has the gyroscope feel specific force by a drawn matrix."""
    matrix = session.rng.normal(0.0, size, (3, 3))
    _target(session).sees.append(lambda _, force, rate: (force, rate + force @ matrix.T))


def deaden(session: Session, size: float) -> None:
    """Has the gyroscope read zero below so many rad/s."""
    _target(session).reads.append(lambda _, force, rate: (force, np.where(np.abs(rate) < size, 0.0, rate)))


def spike(session: Session, size: float) -> None:
    """Adds samples that are wrong by 20 m/s² and 5 rad/s, so many a minute."""

    def spiked(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        count = session.rng.poisson(size * motion.time[-1] / 60.0)
        place = session.rng.integers(0, len(force), count)
        axis = session.rng.integers(0, 3, count)
        sign = session.rng.choice([-1.0, 1.0], count)
        force[place, axis] += 20.0 * sign
        rate[place, axis] += 5.0 * sign
        return force, rate

    _target(session).reads.append(spiked)


def grow_noise(session: Session, size: float) -> None:
    """Has noise grow evenly to so many times what it is at the begin."""
    unit = _target(session)

    def grown(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        factor = 1.0 + (size - 1.0) * motion.time / motion.time[-1]
        for triad, name in unit.terms:
            if name == WHITE:
                unit.terms[triad, name] = unit.terms[triad, name] * np.sqrt(np.mean(factor**2))
        more = np.sqrt(factor**2 - 1.0)[:, None]
        return (
            force + more * session.rng.normal(0.0, unit.noise["accelerometer"], force.shape),
            rate + more * session.rng.normal(0.0, unit.noise["gyroscope"], rate.shape),
        )

    unit.reads.append(grown)


def smooth(session: Session, size: float) -> None:
    """Filters both triads by a first-order low-pass of a time constant, s."""
    filtered = _filter(session.rate_hz, size)
    _target(session).is_filtered = True
    _target(session).sees.append(lambda _, force, rate: (filtered(force), filtered(rate)))


def filter_readings(session: Session, size: float) -> None:
    """Filters readings, noise included, by a first-order low-pass of a time constant, s."""
    filtered = _filter(session.rate_hz, size)
    _target(session).reads.append(lambda _, force, rate: (filtered(force), filtered(rate)))


def _filter(rate_hz: float, constant: float) -> Callable[[FloatArray], FloatArray]:
    share = 1.0 - np.exp(-1.0 / (rate_hz * constant))

    def filtered(values: FloatArray) -> FloatArray:
        out: FloatArray = values.copy()
        for k in range(1, len(out)):
            out[k] = out[k - 1] + share * (values[k] - out[k - 1])
        return out

    return filtered


def _added(unit: Unit, force_drift: FloatArray, rate_drift: FloatArray) -> None:
    unit.drift = {"accelerometer": force_drift.mean(axis=0), "gyroscope": rate_drift.mean(axis=0)}


RATE_OVER_FORCE = 0.05
"""rad/s of drift of a gyroscope where the accelerometer drifts by 1 m/s²."""


def wander(session: Session, size: float) -> None:
    """Has biases wander at random; the truth is their mean over the recording."""
    unit = _target(session)

    def walked(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        walk = np.cumsum(session.rng.normal(0.0, size / np.sqrt(session.rate_hz), (len(force), 6)), axis=0)
        walk[:, 3:] *= RATE_OVER_FORCE
        _added(unit, walk[:, :3], walk[:, 3:])
        return force + walk[:, :3], rate + walk[:, 3:]

    unit.reads.append(walked)


def _warming(session: Session, unit: Unit, size: float) -> None:
    direction = session.rng.normal(size=6)

    def warmed(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        shape = size * np.exp(-motion.time / 60.0)[:, None] * direction
        shape[:, 3:] *= RATE_OVER_FORCE
        _added(unit, shape[:, :3], shape[:, 3:])
        return force + shape[:, :3], rate + shape[:, 3:]

    unit.reads.append(warmed)


def warm_up(session: Session, size: float) -> None:
    """Has biases fall exponentially in a minute, as after power-on; the truth is their mean."""
    _warming(session, _target(session), size)


def drift_reference(session: Session, size: float) -> None:
    """Has the reference warm up."""
    _warming(session, session.units[0], size)


def coarsen_reference(session: Session, size: float) -> None:
    """Multiplies the noise of the reference."""
    unit = session.units[0]
    unit.noise = {triad: size * noise for triad, noise in unit.noise.items()}


def freeze(session: Session, size: float) -> None:
    """Repeats a sample of both triads for so many s, once."""

    def frozen(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        first = int(session.rng.integers(0, len(force)))
        place = slice(first, first + round(size * session.rate_hz))
        force[place], rate[place] = force[first], rate[first]
        return force, rate

    _target(session).reads.append(frozen)


def lag_behind_temperature(session: Session, size: float) -> None:
    """Has accelerometer x read so many m/s² more on average while it cools, in a loop that closes."""

    def looped(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        turn = np.sin(2.0 * np.pi * motion.time / motion.time[-1])
        # Warming and cooling differ by twice the sine, whose mean over the temperatures is pi / 4.
        force[:, 0] -= size * 0.5 * turn / (0.25 * np.pi)
        return force, rate

    unit = _target(session)
    unit.reads.append(looped)
    unit.thermal.pop(("accelerometer x", "mean hysteresis"))


def delay_temperature(session: Session, size: float) -> None:
    """Has the thermometer follow by a first-order lag of so many s."""
    filtered = _filter(session.rate_hz, size)
    _target(session).thermometer.append(lambda _, shown: filtered(shown[:, None])[:, 0])


def coarsen_temperature(session: Session, size: float) -> None:
    """Rounds temperatures to steps of so many K."""
    _target(session).thermometer.append(lambda _, shown: size * np.round(shown / size))


def write_kelvin(session: Session, _: float) -> None:
    """Writes K in a column that does not state it."""
    _target(session).thermometer.append(lambda _, shown: shown + 273.15)


def hold_temperature(session: Session, size: float) -> None:
    """Has the thermometer repeat one reading for so many s."""

    def held(motion: Motion, shown: FloatArray) -> FloatArray:
        begin = session.rng.uniform(0.0, motion.time[-1])
        within = (motion.time >= begin) & (motion.time < begin + size)
        return np.where(within, shown[np.argmax(within)], shown) if within.any() else shown

    _target(session).thermometer.append(held)


def fail_temperature(session: Session, size: float) -> None:
    """Has the thermometer read zero for so many s."""

    def failed(motion: Motion, shown: FloatArray) -> FloatArray:
        begin = session.rng.uniform(0.0, motion.time[-1])
        return np.where((motion.time >= begin) & (motion.time < begin + size), 0.0, shown)

    _target(session).thermometer.append(failed)
