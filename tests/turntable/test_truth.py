"""A good session gives back the truth, within the sigmas stated, whatever the grade, mounting or clock."""

from __future__ import annotations

import numpy as np
import pytest

from turntable_sessions import (
    PARAMETERS,
    assert_recovered,
    assert_within_sigmas,
    calibrate,
    chi_square,
    errors,
    simulate,
)

GRADES = ("consumer", "industrial", "tactical", "reference")
SESSIONS = 12


@pytest.fixture(scope="module")
def batches():
    """Sessions of every grade, with what was found."""
    sessions = [simulate(seed, grades=GRADES) for seed in range(1, 1 + SESSIONS)]
    return [(session, calibrate(session)) for session in sessions]


@pytest.mark.parametrize("triad", ["accelerometer", "gyroscope"])
@pytest.mark.parametrize("number", range(len(GRADES)), ids=GRADES)
def test_every_grade_is_calibrated_to_the_truth_within_its_sigmas(batches, number, triad):
    squares = [
        chi_square(session.target_units[number], result.targets[number], triad) for session, result in batches
    ]
    assert_within_sigmas(sum(squares), PARAMETERS * SESSIONS, f"{GRADES[number]} {triad}, {SESSIONS} seeds")


def test_no_parameter_is_far_from_the_truth(batches):
    for session, result in batches:
        for unit, found in zip(session.target_units, result.targets, strict=True):
            for triad in ("accelerometer", "gyroscope"):
                sigmas = np.sqrt(np.diag(getattr(found, triad).covariance))
                far = np.abs(errors(unit, found, triad) / sigmas).max()
                assert far < 5.5, f"seed {session.scenario.seed} {unit.name} {triad}: {far:.1f} sigma"


def test_the_95_percent_intervals_of_what_people_read_hold_the_truth(batches):
    """Bias, scale, non-orthogonality and mounting, by name, of 96 triads."""
    held = [
        parameter.low <= true <= parameter.high
        for session, result in batches
        for unit, found in zip(session.target_units, result.targets, strict=True)
        for triad in ("accelerometer", "gyroscope")
        for parameter, true in zip(
            getattr(found, triad).parameters, true_parameters(getattr(unit, triad)), strict=True
        )
    ]
    assert len(held) == 96 * PARAMETERS
    share = float(np.mean(held))
    assert 0.93 < share < 0.985, f"95 % intervals hold the truth in {share:.1%}"


def true_parameters(truth):
    """In the order and units of `TriadResult.parameters`."""
    return np.concatenate(
        [
            truth.b + truth.drift,
            np.diag(truth.K),
            np.degrees(truth.non_orthogonality),
            np.degrees(truth.mounting),
        ]
    )


def test_the_bias_of_the_reference_and_its_mounting_angle_are_found(batches):
    off, sigmas = [], []
    for session, result in batches:
        off += [*(result.reference.bias - session.reference_unit.accelerometer.b)]
        sigmas += [*result.reference.bias_sigma]
    assert_within_sigmas(float(np.sum(np.square(off) / np.square(sigmas))), len(off), "bias of the reference")
    # The mounting angle carries the errors of the table, of which twelve sessions of six poses have 72.
    angles = [
        (result.reference.mounting.rotation_vector - np.degrees(session.mounting))
        / result.reference.mounting.sigma
        for session, result in batches
    ]
    assert_within_sigmas(float(np.sum(np.square(angles))), np.size(angles), "mounting angle")


def test_bias_instability_widens_the_sigmas_as_much_as_bias_moves():
    seeds, grades = range(61, 65), GRADES[:3]
    squares = 0.0
    for seed in seeds:
        session = simulate(seed, grades=grades, bias_instability=True, rest_seconds=6.0)
        squares += assert_recovered(session, calibrate(session))
    assert_within_sigmas(squares, len(seeds) * len(grades) * 2 * PARAMETERS, "with bias instability")


@pytest.mark.parametrize("rate", [20.0, 30.0, 40.0])
def test_a_slow_table_that_starts_softly_is_no_hindrance(rate):
    """Half a second after a turn of 20 deg/s at most has begun, its rate is 0.15 deg/s."""
    session = simulate(
        18, grades=("consumer", "tactical"), turn_rate_dps=rate, turn_acceleration_dps2=2.0 * rate
    )
    result = calibrate(session)
    assert_recovered(session, result)
    for target in result.targets:
        assert [rest.pose for rest in target.rests] == [rest.pose for rest in session.rests]


MOUNTINGS = {
    "90 deg about x": (90.0, 0.0, 0.0),
    "90 deg about y": (0.0, 90.0, 0.0),
    "180 deg about z": (0.0, 0.0, 180.0),
    "180 deg about x": (180.0, 0.0, 0.0),
    "120 deg about the diagonal": (69.282, 69.282, 69.282),
    "45 deg about z": (0.0, 0.0, 45.0),
}


@pytest.mark.parametrize("mounting", MOUNTINGS.values(), ids=MOUNTINGS.keys())
def test_a_target_may_be_screwed_on_in_any_attitude(mounting):
    session = simulate(10, grades=("industrial",), target_mounting_deg=mounting)
    result = calibrate(session)
    assert_recovered(session, result)
    found = result["target_1"].accelerometer
    turned = np.degrees(np.linalg.norm(rotation_vector(found.Q)))
    assert turned == pytest.approx(np.linalg.norm(mounting), abs=1.5)


def rotation_vector(rotation):
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(rotation).as_rotvec()


@pytest.mark.parametrize("angle", [0.0, 3.0, 8.0])
def test_mounting_angle_of_the_structure_does_not_reach_the_targets(angle):
    session = simulate(11, grades=("consumer", "tactical"), mounting_angle_deg=angle)
    assert_recovered(session, calibrate(session))


@pytest.mark.parametrize("error", [0.0, 0.05, 0.2])
def test_errors_of_the_table_do_not_reach_the_targets(error):
    session = simulate(12, grades=("industrial", "tactical"), table_error_deg=error)
    assert_recovered(session, calibrate(session))


def test_published_formula_errs_where_the_reference_as_truth_does_not():
    """Rotating the measurement rotates the target's own bias and axes with it: right to first order only."""
    session = simulate(13, grades=("tactical",), mounting_angle_deg=3.0, table_error_deg=0.0)
    unit = session.target_units[0]
    worst = {
        truth: np.abs(errors(unit, calibrate(session, truth=truth)["target_1"], "accelerometer")[:9]).max()
        for truth in ("reference", "rotate-truth", "rotate-measurement", "ideal")
    }
    assert worst["reference"] < 1e-4
    assert worst["rotate-truth"] < 1e-4
    assert 2.0 * worst["reference"] < worst["rotate-measurement"] < 0.1 * worst["ideal"]
    assert worst["ideal"] == pytest.approx(np.radians(3.0), rel=0.5)


def test_rotate_truth_is_exact_for_a_table_that_is():
    session = simulate(14, grades=("consumer", "industrial"), table_error_deg=0.0)
    assert_recovered(session, calibrate(session, truth="rotate-truth"))


def test_rotate_truth_includes_table_errors_in_its_sigmas():
    session = simulate(15, grades=("tactical",), table_error_deg=0.1)
    by_truth = {truth: calibrate(session, truth=truth)["target_1"] for truth in ("reference", "rotate-truth")}
    sigma = {
        truth: np.sqrt(np.diag(found.accelerometer.covariance))[:9].mean()
        for truth, found in by_truth.items()
    }
    assert sigma["rotate-truth"] > 10.0 * sigma["reference"]
    assert_recovered(session, calibrate(session, truth="rotate-truth"))


def test_gravity_sets_the_scale_where_the_poses_are_the_truth():
    session = simulate(16, grades=("tactical",), gravity=9.7803, table_error_deg=0.0)
    assert_recovered(session, calibrate(session, gravity=9.7803, truth="rotate-truth"))
    wrong = calibrate(session, truth="rotate-truth")["target_1"].accelerometer
    ratio = np.diag(wrong.K) / np.diag(session.target_units[0].accelerometer.K)
    np.testing.assert_allclose(ratio, 9.7803 / 9.80665, atol=1e-4)


def test_good_reference_detects_wrong_gravity_and_widens_the_sigmas():
    """Standard gravity at the equator is 0.3 % off; the reference, whose scale is right, shows that."""
    session = simulate(16, grades=("tactical",), gravity=9.7803)
    right, wrong = calibrate(session, gravity=9.7803), calibrate(session)
    assert right.warnings == ()
    (warning,) = wrong.warnings
    assert "reference: |f| deviates from 9.80665 m/s^2 by 0.026 m/s^2" in warning
    assert "--latitude" in warning
    assert_recovered(session, right)
    off = np.abs(errors(session.target_units[0], wrong["target_1"], "accelerometer"))
    sigmas = np.sqrt(np.diag(wrong["target_1"].accelerometer.covariance))
    assert (off < 3.0 * sigmas).all()
    assert sigmas[0] == pytest.approx(0.0027, rel=0.05)


def test_g_sensitivity_is_found_where_it_is_asked_for():
    session = simulate(17, grades=("consumer", "industrial"), g_sensitivity=True)
    result = calibrate(session, g_sensitivity=True)
    for unit in session.target_units:
        found = result[unit.name].gyroscope
        off = (found.g_sensitivity - unit.gyroscope.g_sensitivity) / found.g_sensitivity_sigma
        assert np.abs(off).max() < 5.0
        assert np.abs(unit.gyroscope.g_sensitivity / found.g_sensitivity_sigma).max() > 5.0
    assert_recovered(session, result)


def test_g_sensitivity_is_fitted_where_the_residuals_show_it():
    session = simulate(17, grades=("industrial",), g_sensitivity=True)
    found = calibrate(session)["target_1"]
    asked_for = calibrate(session, g_sensitivity=True)["target_1"]
    assert [each for each in found.warnings if "responds to specific force" in each]
    assert np.array_equal(found.gyroscope.g_sensitivity, asked_for.gyroscope.g_sensitivity)
    assert asked_for.warnings == ()


def test_g_sensitivity_is_left_out_on_request():
    session = simulate(17, grades=("industrial",), g_sensitivity=True)
    found = calibrate(session, g_sensitivity=False)["target_1"]
    assert found.gyroscope.g_sensitivity is None
    assert found.gyroscope.widening > 1.0
    scale = found.gyroscope.parameters[0]
    assert scale.high - scale.low > 2.0 * 1.96 * scale.sigma * 1.01, "not of Student's t"


def test_g_sensitivity_that_a_gyroscope_lacks_is_not_fitted():
    sessions = [simulate(seed, grades=("consumer", "tactical")) for seed in range(170, 182)]
    found = [target for session in sessions for target in calibrate(session).targets]
    assert sum(target.gyroscope.g_sensitivity is not None for target in found) <= 1
