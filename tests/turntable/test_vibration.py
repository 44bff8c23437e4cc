"""Tables that shake: sigmas of the accelerometer as large as its errors."""

import numpy as np
import pytest
from tests.support.repetitions import repetitions
from tests.support.turntable_sessions import errors, simulate

import tumble
from tumble.foundation.recording import Recording


def shaken(session, frequency, size, random):
    """Recordings of one structure on which each axis shakes by a tone."""
    phases = random.uniform(0.0, 2.0 * np.pi, 3)
    for unit in session.units:
        samples = unit.samples
        tone = np.sqrt(2.0) * size * np.sin(2.0 * np.pi * frequency * samples.time[:, None] + phases)
        yield Recording.from_arrays(
            unit.name,
            samples.time,
            samples.accelerometer + tone @ unit.accelerometer.M.T,
            samples.gyroscope,
            clock="turntable",
        )


@pytest.mark.parametrize(
    ("frequency", "size", "rate"), [(17.3, 0.3, 200.0), (30.0, 1.0, 200.0), (123.0, 1.0, 200.0)]
)
def test_sigmas_are_those_of_the_errors_where_the_table_shakes(frequency, size, rate):
    found = []
    for seed in range(6100, 6100 + repetitions(32)):
        session = simulate(seed, grades=("industrial",), rate_hz=rate, rest_seconds=8.0)
        reference, target = shaken(session, frequency, size, np.random.default_rng(seed))
        result = tumble.turntable(reference, [target]).targets[0]
        sigma = np.sqrt(np.diag(result.accelerometer.covariance))
        found.append(errors(session.target_units[0], result, "accelerometer") / sigma)
    spread = np.sqrt(np.mean(np.square(found)))
    assert 1.0 / 1.5 < spread < 1.5, spread


def rocking(session, frequency, size, random):
    """Recordings of one structure that rocks by a tone about each axis."""
    phases = random.uniform(0.0, 2.0 * np.pi, 3)
    for unit in session.units:
        samples = unit.samples
        tone = np.sqrt(2.0) * size * np.sin(2.0 * np.pi * frequency * samples.time[:, None] + phases)
        rate = samples.gyroscope + tone @ unit.gyroscope.M.T
        yield Recording.from_arrays(unit.name, samples.time, samples.accelerometer, rate, clock="turntable")


@pytest.mark.parametrize(("frequency", "size"), [(17.3, 0.01), (30.0, 0.03), (123.0, 0.03)])
def test_gyroscope_sigmas_are_those_of_the_errors_in_vibration(frequency, size):
    found = []
    for seed in range(6200, 6200 + repetitions(32)):
        session = simulate(seed, grades=("industrial",), rate_hz=200.0, rest_seconds=8.0)
        reference, target = rocking(session, frequency, size, np.random.default_rng(seed))
        result = tumble.turntable(reference, [target]).targets[0]
        sigma = np.sqrt(np.diag(result.gyroscope.covariance))
        found.append(errors(session.target_units[0], result, "gyroscope") / sigma)
    spread = np.sqrt(np.mean(np.square(found)))
    assert 1.0 / 1.5 < spread < 1.5, spread
