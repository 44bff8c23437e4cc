"""Intervals of spins that are not as the model has them."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks import spin_disturbed
from benchmarks.spin_bound import GROUPS
from benchmarks.spin_session import Motion

import tumble
from repetitions import repetitions
from spin_sessions import record, still, turn
from tumble.foundation.recording import Recording
from tumble.foundation.results import INTERVAL

SEED = 7_200
SESSIONS = repetitions(800)


def errors(motion, disturbance):
    """(n, 13) errors over sigma, and (n,) whether sigmas were widened."""
    print(f"seeds {SEED}, 0 to {SESSIONS - 1}")
    outcomes = [spin_disturbed.judged(motion, disturbance, (SEED, number)) for number in range(SESSIONS)]
    return np.abs([off for off, _ in outcomes]), np.array([said for _, said in outcomes])


def test_wheel_slip_at_the_start_is_within_the_widened_sigmas():
    motion = Motion(turns=(3.0,), tilt=spin_disturbed.TILT)
    off, said = errors(motion, spin_disturbed.Disturbance(slip=spin_disturbed.SLIP))
    assert said.mean() > 0.97
    # A slip that chance might have made is widened in part.
    known = off[np.isfinite(off)]
    assert (known < 4.0).mean() > 0.99
    assert known.max() < 6.5
    assert (off[said][:, GROUPS["accelerometer bias"]] < 3.0).mean() > 0.98
    assert (off[said][:, GROUPS["floor tilt"]] < 3.0).mean() > 0.98


@pytest.mark.parametrize("turns", [(3.0,), (3.0, -3.0)], ids=["one way", "both ways"])
def test_intervals_of_turns_at_four_radians_a_second_hold(turns):
    motion = Motion(turns=turns, tilt=spin_disturbed.TILT, speed=4.0)
    off, said = errors(motion, spin_disturbed.Disturbance())
    for group, columns in GROUPS.items():
        known = off[:, columns][np.isfinite(off[:, columns])]
        assert (known <= INTERVAL).mean() > 0.92, group
        assert known.max() < 5.0, group
    assert said.mean() < 0.05


@pytest.mark.parametrize("turns", [(3.0,), (3.0, -3.0)], ids=["one way", "both ways"])
@pytest.mark.parametrize("noise", [0.02, 0.2], ids=["one value", "few values"])
def test_intervals_hold_whatever_the_resolution_of_the_gyroscope(turns, noise, monkeypatch):
    monkeypatch.setattr(spin_disturbed, "QUIET", noise)
    motion = Motion(turns=turns, tilt=spin_disturbed.TILT)
    steps = np.radians(np.geomspace(0.01, 1.0, SESSIONS))
    print(f"seeds {SEED}, 0 to {len(steps) - 1}")
    off = np.abs(
        [
            spin_disturbed.judged(motion, spin_disturbed.Disturbance(step=float(step)), (SEED, number))[0]
            for number, step in enumerate(steps)
        ]
    )
    fewest = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / len(off))
    for group, columns in GROUPS.items():
        known = off[:, columns][np.isfinite(off[:, columns])]
        assert (known <= INTERVAL).mean() > fewest, group
        assert known.max() < 6.0, group


def test_misfit_of_the_accelerometer_widens_no_sigma_of_the_gyroscope():
    print(f"seeds {SEED} to {SEED + 11}")
    widened = 0
    for seed in range(SEED, SEED + 12):
        session = record((still(), turn(3), still()), seed)
        plain, pulled = (tumble.spin(recorded(session, pull)) for pull in (0.0, 0.1))
        if pulled.spins[0].widening < 1.5:
            continue
        widened += 1
        assert (pulled.accelerometer_bias.sigma > 1.3 * plain.accelerometer_bias.sigma).any()
        assert (pulled.gyroscope_bias.sigma < 1.1 * plain.gyroscope_bias.sigma).all()
        off = (pulled.gyroscope_bias.value - session.robot.gyroscope_bias) / pulled.gyroscope_bias.sigma
        assert np.abs(off).max() < 4.0
    assert widened >= 3


def recorded(session, pull):
    """The recording of a robot that is pulled, m/s^2, in the first third of its turn."""
    turning = np.flatnonzero(np.abs(session.gyroscope[:, 2]) > 0.3)
    force = session.accelerometer.copy()
    force[turning[: len(turning) // 3]] += pull * np.array([1.0, 0.5, 0.0])
    return Recording.from_arrays("robot", session.time, force, session.gyroscope)
