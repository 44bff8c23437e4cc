"""Readings that repeat for a while: all of them, or those of one channel."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from tumble.acquisition.standstills import standstills
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Chunk, Recording
from tumble.foundation.units import TRIADS

RATE = 50.0


def still(seconds=60.0, step=0.0):
    """Samples of a unit that lies still, of noise of 0.02 m/s^2 and 0.002 rad/s, rounded to steps."""
    rng = np.random.default_rng(5)
    count = int(RATE * seconds)
    force = np.array([0.0, 0.0, 9.8]) + rng.normal(0.0, 0.02, (count, 3))
    rate = rng.normal(0.0, 0.002, (count, 3))
    if step:
        force, rate = step * np.round(force / step), 0.1 * step * np.round(rate / (0.1 * step))
    return Chunk(np.arange(count) / RATE, force, rate)


def frozen(samples, first, last):
    force, rate = samples.accelerometer.copy(), samples.gyroscope.copy()
    force[first:last], rate[first:last] = force[first], rate[first]
    return Chunk(samples.time, force, rate)


def test_a_stretch_in_which_all_readings_repeat_is_left_out():
    found = standstills(frozen(still(), 1000, 1100), TRIADS)
    assert found.frozen == ((1000, 1099),)
    assert found.stuck == ()
    kept = found.moving(still())
    assert len(kept) == len(still()) - 99


def test_a_coarse_sensor_shows_no_standstill():
    for step in (0.02, 0.05, 0.1, 0.5):
        found = standstills(still(step=step), TRIADS)
        assert (found.frozen, found.stuck) == ((), ()), step


@pytest.mark.parametrize("procedure", [tumble.noise, tumble.spin])
def test_a_channel_that_repeats_alone_is_refused_by_name(procedure):
    samples = still()
    force = samples.accelerometer.copy()
    force[1500:, 1] = force[1500, 1]
    log = Recording.from_arrays("still", samples.time, force, samples.gyroscope)
    with pytest.raises(ProcedureError, match=r"accelerometer y is stuck at .* from 30.0 to 60.0 s"):
        procedure(log)


def test_noise_of_a_log_that_stood_still_is_that_of_the_rest():
    samples = frozen(still(), 1000, 1500)
    log = Recording.from_arrays("still", samples.time, samples.accelerometer, samples.gyroscope)
    found = tumble.noise(log)
    assert any("stood still from 20.0 to 30.0 s" in warning for warning in found.warnings)
    term = found["accelerometer x"].term("white noise")
    assert term.low < 0.02 / np.sqrt(RATE) < term.high
