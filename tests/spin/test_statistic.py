"""Chi-square and intervals of spins, live and from the log, over drawn sessions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmarks import spin_live

from repetitions import repetitions
from tumble.foundation.recording import Chunk
from tumble.tools.simulate import simulate_spin

SEED = 5_000
SESSIONS = repetitions(240)


@pytest.fixture(scope="module")
def outcomes():
    """(n, 2, 8) of sessions, live and as logs, as of `benchmarks.spin_live.both_ways`."""
    print(f"seeds from {SEED}")
    return np.array([spin_live.both_ways(SEED + number) for number in range(SESSIONS)])


@pytest.mark.parametrize("way", range(2), ids=spin_live.WAYS)
def test_chi_square_is_on_average_its_degrees_of_freedom(outcomes, way):
    figures = spin_live.figures(outcomes[:, way])
    chance = 4.0 * figures["reduced_chi_square_error"]
    assert abs(figures["reduced_chi_square"] - 1.0) < chance + spin_live.LARGEST_REDUCED


@pytest.mark.parametrize("way", range(2), ids=spin_live.WAYS)
def test_intervals_hold_the_truth_as_often_as_they_say(outcomes, way):
    for share in spin_live.figures(outcomes[:, way])["coverage"].values():
        # The three axes of a session have a rest in common.
        chance = 4.0 * np.sqrt(0.95 * 0.05 / SESSIONS)
        assert spin_live.COVERAGE[0] - chance < share < spin_live.COVERAGE[1] + chance


def test_sound_spin_is_not_reported_as_slipping():
    session = simulate_spin(seed=7, plan=spin_live.PLAN, floor_tilt_deg=1.0)
    found = spin_live.live(session)
    assert found.fits
    assert not [line for line in found.warnings if "slipping" in line]


def test_unexplained_gravity_residual_widens_sigmas_and_is_reported():
    session = simulate_spin(
        seed=3, plan=spin_live.PLAN, floor_tilt_deg=1.0, vibration=0.0, bias_instability=False
    )
    time, force = session.samples.time, session.samples.accelerometer.copy()
    # Once a turn it is pushed forward, and nothing to the left goes with it, as gravity's would.
    force[:, 0] += 0.03 * np.sin(time) * (time > 6.0)
    bent = Chunk(time, force, session.samples.gyroscope)
    found, clean = (spin_live.live(replace(session, samples=each)) for each in (bent, session.samples))
    assert found.widening > 1.5
    assert clean.widening == 1.0
    assert not found.fits
    assert any(
        f"the sigmas of specific force are widened {found.widening:.1f} times" in line
        for line in found.warnings
    )
    assert (found.accelerometer_bias.sigma > clean.accelerometer_bias.sigma).all()
