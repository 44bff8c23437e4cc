"""A damaged channel is named by every procedure, whichever it is."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from tumble.acquisition.duplicate_sensors import FEWEST_DIFFERENT, SensorHead
from tumble.foundation.errors import TumbleError
from tumble.foundation.recording import Recording
from tumble.tools.simulate import simulate_multipose, simulate_spin, simulate_thermal, simulate_turntable

SEED = 3


def changed(recording, change):
    """The same samples with something done to specific force and rate, (n, 3) each, in place."""
    chunks = list(recording.chunks())
    time, force, rate = (
        np.concatenate([getattr(chunk, name) for chunk in chunks])
        for name in ("time", "accelerometer", "gyroscope")
    )
    warmth = None if chunks[0].temperature is None else np.concatenate([c.temperature for c in chunks])
    force, rate = force.copy(), rate.copy()
    change(force, rate)
    return Recording.from_arrays(recording.name, time, force, rate, temperature=warmth)


def still():
    random = np.random.default_rng(SEED)
    time = np.arange(12_000) / 100.0
    force = random.normal([0.0, 0.0, 9.8], 0.02, (len(time), 3))
    return Recording.from_arrays("still", time, force, random.normal(0.0, 0.002, (len(time), 3)))


SESSIONS = {
    "noise": lambda change: tumble.noise(changed(still(), change)),
    "thermal": lambda change: tumble.thermal(
        changed(simulate_thermal(seed=SEED, rate_hz=10.0, duration=1800.0).recording, change)
    ),
    "multipose": lambda change: tumble.multipose(changed(simulate_multipose(seed=SEED).recording, change)),
    "spin": lambda change: tumble.spin(changed(simulate_spin(seed=SEED).recording, change)),
    "align": lambda change: tumble.align(*_two(change)),
}


def _two(change):
    session = simulate_turntable(seed=SEED)
    return session.reference, changed(session.targets[0], change)


def copy_an_axis(force, rate):
    rate[:, 1] = rate[:, 0]


def freeze_an_axis(force, rate):
    force[len(force) // 2 :, 1] = force[len(force) // 2, 1]


def double_forces(force, rate):
    force *= 2.0


@pytest.mark.parametrize("procedure", SESSIONS)
def test_an_axis_that_is_another_one_is_refused(procedure):
    with pytest.raises(TumbleError, match="two axes of the gyroscope read the same; check the columns"):
        SESSIONS[procedure](copy_an_axis)


@pytest.mark.parametrize("procedure", ["multipose", "spin", "align"])
def test_an_axis_that_froze_is_refused(procedure):
    with pytest.raises(TumbleError, match="accelerometer y is stuck at"):
        SESSIONS[procedure](freeze_an_axis)


@pytest.mark.parametrize("procedure", ["thermal", "multipose", "spin"])
def test_forces_of_twice_gravity_are_refused(procedure):
    with pytest.raises(TumbleError, match=r"accelerometer reads 19\.\d+ m/s\^2 at rest"):
        SESSIONS[procedure](double_forces)


def test_noise_remarks_on_forces_of_twice_gravity():
    assert any("2.00 of gravity" in line for line in SESSIONS["noise"](double_forces).warnings)


def test_axes_too_coarse_to_differ_decide_nothing():
    head = SensorHead()
    coarse = np.arange(1000) % (FEWEST_DIFFERENT - 1)
    head.push(np.column_stack([coarse, coarse, coarse]).astype(float))
    assert not head.has_axis_twice()
    finer = SensorHead()
    finer.push(np.column_stack([np.arange(1000), np.arange(1000), np.zeros(1000)]).astype(float))
    assert finer.has_axis_twice()
