"""A target beside the turning centre feels another specific force than the reference does."""

from dataclasses import replace

import numpy as np
import pytest
from tests.support.turntable_sessions import assert_within_sigmas, calibrate, chi_square, simulate

from tumble.tools.simulate.grade import Grade

SEEDS = range(60, 66)
QUIET = Grade.named("industrial")
COUPLED = replace(QUIET, name="coupled", gyroscope=replace(QUIET.gyroscope, g_sensitivity=2e-4))
"""Quiet, with the response of a consumer gyroscope, rad/s per m/s^2."""


@pytest.mark.parametrize("arm", [(0.0, 0.0, 0.0), (0.15, 0.0, 0.0), (0.0, 0.1, 0.2)])
def test_a_response_to_specific_force_is_of_the_place_of_the_target(arm):
    """With the force at the reference, 0.1 m away, biases erred by 6 to 10 sigmas at 200 deg/s."""
    squares = 0.0
    for seed in SEEDS:
        session = simulate(
            seed,
            grades=(COUPLED,),
            g_sensitivity=True,
            rates_dps=(30, 100, 200),
            seconds_per_rate=10.0,
            lever_arm_m={"target_1": arm},
        )
        unit, found = session.target_units[0], calibrate(session).targets[0]
        assert found.verdict == "calibrated"
        squares += chi_square(unit, found, "gyroscope")
        assert np.abs(found.gyroscope.b - unit.gyroscope.b - unit.gyroscope.drift).max() < 2e-4
    assert_within_sigmas(squares, 12 * len(SEEDS), f"arm {arm}")
