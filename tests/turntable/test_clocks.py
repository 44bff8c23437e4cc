"""Clocks apart, sample rates that differ: offset and skew are found, and cost the calibration nothing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

import tumble
from tumble.foundation.recording import Recording
from turntable_sessions import (
    PARAMETERS,
    UNLIKELY,
    assert_recovered,
    assert_within_sigmas,
    calibrate,
    chi_square,
    simulate,
)

GRADES = ("consumer", "industrial", "tactical")
SEEDS = range(21, 29)


@pytest.fixture(scope="module")
def batches():
    sessions = [simulate(seed, grades=GRADES, clocks="apart") for seed in SEEDS]
    return [(session, calibrate(session)) for session in sessions]


def test_targets_with_own_clocks_are_calibrated_as_with_a_shared_one(batches):
    squares = sum(assert_recovered(session, result) for session, result in batches)
    assert_within_sigmas(squares, len(SEEDS) * len(GRADES) * 2 * PARAMETERS, "clocks apart")


def test_offset_and_skew_are_found_within_their_sigmas(batches):
    offsets, skews = [], []
    for session, result in batches:
        for unit in session.target_units:
            clock = result[unit.name].clock
            assert not clock.shared
            assert clock.turns == 5
            offsets.append((clock.offset - unit.clock.offset) / clock.offset_sigma)
            skews.append((clock.skew - unit.clock.skew) / clock.skew_sigma)
    # Eq. 17 of docs/theory/turntable.md is a bound, so that these squares may be small.
    allowed = chi2.isf(UNLIKELY, len(skews))
    assert np.sum(np.square(skews)) < allowed
    assert np.sum(np.square(offsets)) < allowed
    assert np.median(np.abs(skews)) > 0.1
    assert np.median(np.abs(offsets)) > 0.1


def test_offset_and_skew_lay_the_rests_of_both_units_on_each_other(batches):
    for _, result in batches:
        start = result.reference.trace.time[0]
        for target in result.targets:
            clock = target.clock
            for seen, felt in zip(result.reference.rests, target.rests, strict=True):
                expected = seen.start + clock.offset + clock.skew * 1e-6 * (seen.start - start)
                assert felt.start == pytest.approx(expected, abs=0.11)


def test_one_clock_for_all_is_recognised():
    result = calibrate(simulate(31, grades=GRADES))
    for target in result.targets:
        assert target.clock.shared
        assert (target.clock.offset, target.clock.skew) == (0.0, 0.0)


def test_one_clock_stated_as_two_gives_the_same_calibration():
    session = simulate(32, grades=GRADES)
    result = calibrate(session, clock="apart")
    assert_recovered(session, result)
    for target in result.targets:
        assert abs(target.clock.offset) < 5.0 * target.clock.offset_sigma
        assert abs(target.clock.skew) < 5.0 * target.clock.skew_sigma


def test_a_skew_without_an_offset_is_not_taken_for_one_clock():
    """A clock that is 200 ppm fast makes every turn seem 200 ppm slower."""
    session = simulate(33, grades=("tactical",), clocks="apart", clock_offset_seconds=0.0, clock_skew_ppm=200)
    result = calibrate(session)
    true = session.target_units[0].clock.skew
    assert abs(true) > 50.0, "the seed drew next to no skew"
    assert result["target_1"].clock.skew == pytest.approx(true, rel=0.1)
    assert_recovered(session, result)


@pytest.mark.parametrize("clocks", ["shared", "apart"])
def test_every_unit_may_have_its_own_sample_rate(clocks):
    rates = {"reference": 200.0, "target_1": 50.0, "target_2": 125.0, "target_3": 400.0}
    session = simulate(34, grades=GRADES, rate_hz=rates, clocks=clocks)
    assert_recovered(session, calibrate(session))


def test_earth_rotation_is_followed_while_one_unit_is_cut_later():
    """At different rates rests end at slightly different times; 15 deg/h for 0.1 s is 4 ppm of 90 deg."""
    rates = {"reference": 200.0, "target_1": 50.0}
    squares = 0.0
    for seed in range(35, 41):
        session = simulate(seed, grades=("reference",), rate_hz=rates)
        squares += assert_recovered(session, calibrate(session))
    assert_within_sigmas(squares, 6 * 2 * PARAMETERS, "rates apart, the best of targets")


def test_target_with_late_start_and_early_stop_uses_the_common_part():
    session = simulate(36, grades=("industrial",))
    unit = session.target_units[0]
    late = shortened(unit.samples, 7.0, 33.0)
    part = calibrate_one(session.reference, late)
    assert [rest.pose for rest in part.rests] == ["X down", "Y up", "Y down", "Z up"]
    assert any("rest 1, 6 of the reference is not a rest of this unit" in text for text in part.warnings)
    assert chi_square(unit, part, "accelerometer") < chi2.isf(UNLIKELY, PARAMETERS)
    assert part.accelerometer.degrees_of_freedom == 3 * 4 - PARAMETERS


def shortened(samples, start, end):
    kept = (samples.time > start) & (samples.time < end)
    return Recording.from_arrays(
        "late", samples.time[kept], samples.accelerometer[kept], samples.gyroscope[kept]
    )


def calibrate_one(reference, target):
    return tumble.turntable(reference, [target]).targets[0]
