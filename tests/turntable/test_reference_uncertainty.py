"""The uncertainty of the reference goes to every target, apart from what each target has of its own."""

import json

import numpy as np
import pytest
import yaml

import tumble
from tumble.foundation.errors import ProcedureError
from turntable_sessions import calibrate, calibrated, rows, simulate, write
from uncertain_references import calibration_of, draw, exact, stated

SESSIONS = 24
WIDEST = 0.04
"""Tolerance of coverage: all parameters share the sessions' errors, so that few of them are independent."""


def against(session, matrix_sigma):
    """The first target against a perfect reference that states so much."""
    covariances = stated(matrix_sigma)
    return calibrate(session, reference_calibration=calibration_of(covariances, exact(covariances)))[0]


def matrix_variances(triad, of):
    return np.diag(getattr(triad, of))[:9].reshape(3, 3)


def test_a_gyroscope_inherits_the_matrix_of_its_reference():
    """By the closed form dM = M M_r^-1 dM_r: M times its transpose, times the variance of an element."""
    found = against(simulate(31), 2e-3).gyroscope
    expected = np.repeat(np.diag(found.M @ found.M.T)[:, None], 3, axis=1) * 2e-3**2
    assert np.allclose(matrix_variances(found, "inherited"), expected, rtol=2e-3)


def test_an_accelerometer_inherits_all_but_the_length_of_gravity():
    """On six faces a truth drawn to the sphere is free of the error along gravity, the diagonal of E."""
    inherited = matrix_variances(against(simulate(32), 2e-3).accelerometer, "inherited") / 2e-3**2
    across = ~np.eye(3, dtype=bool)
    assert np.allclose(inherited[across], 1.0, rtol=0.1), inherited
    assert inherited[~across].max() < 0.01, inherited


def test_stated_uncertainty_changes_the_sigma_and_not_the_value():
    session = simulate(33)
    sharp, vague = against(session, 1e-7), against(session, 2e-3)
    for triad in ("accelerometer", "gyroscope"):
        one, other = getattr(sharp, triad), getattr(vague, triad)
        assert np.array_equal(one.M, other.M)
        assert np.array_equal(one.covariance, other.covariance)
    few, many = ({p.name: p for p in each.gyroscope.parameters} for each in (sharp, vague))
    grown = np.sqrt(many["scale x"].sigma ** 2 - few["scale x"].sigma ** 2)
    of_scale = 2e-3 * many["scale x"].value
    assert grown == pytest.approx(of_scale, rel=0.01)
    assert many["scale x"].inherited == pytest.approx(of_scale, rel=0.01)


def test_two_targets_of_one_reference_differ_without_its_error():
    """The inherited part is the same for both, so that the covariance that compares them excludes it."""
    session = simulate(34, grades=("industrial", "industrial"))
    covariances = stated(2e-3)
    wrong = calibration_of(covariances, draw(covariances, np.random.default_rng(34)))
    found = calibrate(session, reference_calibration=wrong)
    true = [unit.gyroscope.M for unit in session.target_units]
    errors = [result.gyroscope.M - of for result, of in zip(found.targets, true, strict=True)]
    own = np.sqrt(np.diag(found[0].gyroscope.covariance)[:9] + np.diag(found[1].gyroscope.covariance)[:9])
    assert np.abs(errors[0]).max() > 10.0 * own.max()
    assert (np.abs(errors[0] - errors[1]).ravel() < 5.0 * own).all()


def test_intervals_hold_where_a_reference_errs_as_it_states():
    covariances, held = stated(5e-4), []
    for seed in range(SESSIONS):
        session = simulate(3500 + seed)
        wrong = calibration_of(covariances, draw(covariances, np.random.default_rng(seed)))
        found = calibrate(session, reference_calibration=wrong)[0]
        for triad in ("accelerometer", "gyroscope"):
            result, true = getattr(found, triad), getattr(session.target_units[0], triad)
            sigma = np.sqrt(np.diag(result.covariance) + np.diag(result.inherited))
            off = np.concatenate([(result.M - true.M).ravel(), result.b - true.b - true.drift])
            held.append(np.abs(off) < 1.96 * sigma)
    assert abs(np.mean(held) - 0.955) < WIDEST, f"{100 * np.mean(held):.1f} % hold"


def test_a_grade_stands_in_where_no_calibration_states_it():
    found = calibrate(simulate(36), reference_grade="tactical")
    assert found.reference.uncertainty.gyroscope == "grade tactical"
    (scale,) = (p for p in found[0].gyroscope.parameters if p.name == "scale x")
    assert scale.inherited == pytest.approx(5e-4, rel=0.02)
    with pytest.raises(ProcedureError, match="consumer, industrial, tactical"):
        calibrate(simulate(36), reference_grade="marvellous")


def test_a_result_whose_reference_states_nothing_is_relative_to_it(tmp_path):
    logs = write(simulate(37), tmp_path)
    out = calibrated(*logs, "-o", tmp_path / "out").text
    sentence = "Scale and non-orthogonality of the accelerometer and gyroscope are relative to the reference"
    assert sentence in out
    assert sentence in " ".join((tmp_path / "out/target_1.html").read_text("utf-8").split())
    content = json.loads(calibrated(*logs, "-o", tmp_path / "out", "--json").out)
    assert content["reference"]["uncertainty"] == {"accelerometer": "not stated", "gyroscope": "not stated"}


def test_file_and_summary_keep_the_share_of_the_reference_apart(tmp_path):
    logs = write(simulate(38), tmp_path)
    graded = calibrated(*logs, "--reference-grade", "industrial", "-o", tmp_path / "out")
    assert "stated of its accelerometer and gyroscope by its grade industrial" in graded.text
    assert "in common" in (tmp_path / "out/target_1.html").read_text("utf-8")
    row = rows(tmp_path / "out")["target_1"]
    of_reference = float(row["sigma in common gyroscope scale x"])
    assert 0.0 < of_reference < float(row["sigma gyroscope scale x"])
    file = tumble.Calibration.load(tmp_path / "out/target_1.yaml")
    inherited = file.gyroscope.inherited
    assert inherited.source == "grade industrial"
    assert inherited.sigma.scale[0] == pytest.approx(of_reference, rel=1e-6)
    assert np.allclose(file.gyroscope.total_covariance, file.gyroscope.covariance + inherited.covariance)
    written = yaml.safe_load((tmp_path / "out/target_1.yaml").read_text("utf-8"))
    assert written["reference"]["uncertainty"]["gyroscope"] == "grade industrial"


def test_a_target_calibrated_is_a_reference_with_all_its_uncertainty(tmp_path):
    """A chain of two calibrations: the second inherits what the first found, and what that inherited."""
    covariances = stated(1e-3)
    first = calibrate(
        simulate(39), reference_calibration=calibration_of(covariances, exact(covariances))
    ).save(tmp_path)
    chained = tumble.Calibration.load(first["target_1"]).model_copy(update={"serial": ""})
    found = calibrate(simulate(39), reference_calibration=chained)[0].gyroscope
    own = np.sqrt(chained.gyroscope.covariance[0, 0])
    assert own < 2e-4
    assert np.sqrt(found.inherited[0, 0]) == pytest.approx(1e-3, rel=0.05)


def test_a_reference_within_what_it_states_is_no_cause_for_a_warning():
    covariances = stated(1e-3)
    wrong = calibration_of(covariances, draw(covariances, np.random.default_rng(40)))
    silent = calibration_of(stated(1e-7), draw(covariances, np.random.default_rng(40)))
    session = simulate(40)
    assert not any(
        "|f| deviates" in each for each in calibrate(session, reference_calibration=wrong).warnings
    )
    assert any("|f| deviates" in each for each in calibrate(session, reference_calibration=silent).warnings)
