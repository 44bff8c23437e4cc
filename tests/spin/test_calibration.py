"""A spin as a calibration: it corrects logs, and adds to one of the turntable."""

from __future__ import annotations

import json

import numpy as np

import tumble
from spin_sessions import record, still, turn
from tumble.procedures.spin.procedure import spin
from turntable_sessions import one_line, typed

MOVES = (still(), turn(3), still(3), turn(-3), still())
SIGMAS = 5.0


def recording(session, name="robot"):
    return tumble.Recording.from_arrays(name, session.time, session.accelerometer, session.gyroscope)


def calibration(folder, **sections):
    """A calibration file as the turntable leaves it, with the sections given."""
    made = tumble.Calibration.model_validate({"schema": "tumble-calibration/1", "name": "robot"} | sections)
    path = folder / "turntable.yaml"
    made.save(path)
    return path


def matrix(seed, size=0.02):
    generator = np.random.default_rng(seed)
    return np.eye(3) + generator.uniform(-size, size, (3, 3))


def covariance(sigma_m, sigma_b):
    return np.diag([sigma_m**2] * 9 + [sigma_b**2] * 3)


def corrupted(session, force_matrix, rate_matrix, sensitivity=None):
    """The log of a unit whose scale and axes are not perfect: y = M u + b, M to come in before the bias."""
    force_bias, rate_bias = map(np.array, (session.robot.accelerometer_bias, session.robot.gyroscope_bias))
    force = session.accelerometer - force_bias
    session.accelerometer = force @ force_matrix.T + force_bias
    session.gyroscope = (session.gyroscope - rate_bias) @ rate_matrix.T + rate_bias
    if sensitivity is not None:
        session.gyroscope = session.gyroscope + force @ sensitivity.T
    return session


def test_a_corrected_log_has_no_bias_left(tmp_path):
    session = record(MOVES, 81)
    log = session.write(tmp_path / "robot.csv")
    assert typed("spin", log, "-o", tmp_path / "out").code == 0
    corrected = tmp_path / "corrected.csv"
    done = typed("apply", tmp_path / "out/robot.spin.yaml", log, "-o", corrected)
    assert done.code == 0, done.err
    again = typed("spin", corrected, "-o", tmp_path / "again", "--json")
    found = json.loads(again.out)
    for bias in ("accelerometer_bias", "gyroscope_bias"):
        left = np.abs(np.array(found[bias]["value"]))
        # Rounding and new weights leave a rest; the noise is the same.
        assert np.all(left < 0.2 * np.array(found[bias]["sigma"])), left


def test_applying_a_calibration_whose_purpose_is_bias_raises_no_alarm(tmp_path):
    log = record(MOVES, 82).write(tmp_path / "robot.csv", "time,ax,ay,az,gx_radps,gy_radps,gz_radps")
    assert typed("spin", log, "-o", tmp_path / "out").code == 0
    done = typed("apply", tmp_path / "out/robot.spin.yaml", log, "-o", tmp_path / "corrected.csv")
    assert done.code == 0
    assert done.err == ""


def test_spin_alone_has_an_identity_matrix_that_is_not_claimed(tmp_path):
    result = spin(recording(record(MOVES, 83)))
    made = result.calibration
    for triad in (made.accelerometer, made.gyroscope):
        np.testing.assert_array_equal(triad.M, np.eye(3))
        assert triad.estimated == ("bias",)
        assert np.isnan(triad.sigma.scale).all()
        assert np.isnan(triad.covariance[:9]).all()
        assert np.isnan(triad.covariance[:, :9]).all()
        assert "bias only" in triad.unobservable[0]
    np.testing.assert_array_equal(made.accelerometer.covariance[9:, 9:], result.covariance[:3, :3])
    np.testing.assert_array_equal(made.gyroscope.covariance[9:, 9:], result.covariance[3:, 3:])
    assert "bias only" in repr(made)


def test_the_file_reads_back_as_it_was_written(tmp_path):
    made = spin(recording(record(MOVES, 84))).calibration
    made.save(tmp_path / "robot.yaml")
    assert tumble.Calibration.load(tmp_path / "robot.yaml") == made


def test_new_bias_is_that_of_the_raw_sensor_after_a_calibration(tmp_path):
    force_matrix, rate_matrix = matrix(1), matrix(2)
    session = corrupted(record(MOVES, 85), force_matrix, rate_matrix)
    before = calibration(
        tmp_path,
        accelerometer={
            "unit": "m/s^2",
            "M": force_matrix,
            "b": [0.1, 0.1, 0.1],
            "estimated": ("bias", "matrix"),
        },
        gyroscope={"unit": "rad/s", "M": rate_matrix, "b": [0.01, 0.0, 0.0], "estimated": ("bias", "matrix")},
    )
    log = session.write(tmp_path / "robot.csv")
    done = typed("spin", log, "-o", tmp_path / "out", "--calibration", before)
    assert done.code == 0, done.err
    made = tumble.Calibration.load(tmp_path / "out/robot.spin.yaml")
    for triad, truth, kept in (
        (made.accelerometer, session.robot.accelerometer_bias, force_matrix),
        (made.gyroscope, session.robot.gyroscope_bias, rate_matrix),
    ):
        np.testing.assert_array_equal(triad.M, kept)
        assert set(triad.estimated) == {"bias", "matrix"}
        assert np.all(np.abs(triad.b - truth) < SIGMAS * triad.sigma.bias)
    assert "scale error" not in done.text


def test_an_earlier_bias_does_not_change_the_new_one(tmp_path):
    session = record(MOVES, 86)
    found = []
    for bias in (0.0, 0.5):
        before = calibration(
            tmp_path, accelerometer={"unit": "m/s^2", "M": np.eye(3), "b": [bias, -bias, 0.2 * bias]}
        )
        result = spin(recording(session), calibration=before)
        found.append(result.calibration.accelerometer.b)
    np.testing.assert_allclose(found[0], found[1], atol=1e-5)


def test_bias_of_a_g_sensitive_gyroscope_is_free_of_that_effect(tmp_path):
    sensitivity = np.array([[1e-3, 2e-3, -1e-3], [5e-4, 0.0, 2e-3], [-1e-3, 1e-3, 3e-4]])
    session = corrupted(record(MOVES, 87), np.eye(3), np.eye(3), sensitivity)
    before = calibration(
        tmp_path,
        accelerometer={"unit": "m/s^2", "M": np.eye(3), "b": [0.0, 0.0, 0.0]},
        gyroscope={"unit": "rad/s", "M": np.eye(3), "b": [0.0, 0.0, 0.0], "g_sensitivity": sensitivity},
    )
    result = spin(recording(session), calibration=before)
    made = result.calibration
    miss = (made.gyroscope.b - session.robot.gyroscope_bias) / made.gyroscope.sigma.bias
    assert np.all(np.abs(miss) < SIGMAS), miss
    np.testing.assert_array_equal(made.gyroscope.g_sensitivity, sensitivity)


def test_uncertainty_of_the_matrix_is_in_the_sigma_of_the_bias(tmp_path):
    session = record(MOVES, 88)
    sigmas = {}
    for sigma in (1e-6, 1e-3):
        before = calibration(
            tmp_path,
            accelerometer={
                "unit": "m/s^2",
                "M": np.eye(3),
                "b": np.zeros(3),
                "covariance": covariance(sigma, 0.1),
                "estimated": ("bias", "matrix"),
            },
        )
        result = spin(recording(session), calibration=before)
        made = result.calibration.accelerometer
        sigmas[sigma] = made.sigma.bias
        eigenvalues = np.linalg.eigvalsh(made.covariance)
        assert eigenvalues.min() > -1e-12 * eigenvalues.max()
    # dM u with u = g up: 1e-3 of every element is 9.8 mm/s^2, against which the spin's own sigma is small.
    np.testing.assert_allclose(sigmas[1e-3], 9.80665e-3, rtol=0.05)
    assert np.all(sigmas[1e-6] < 2e-3)


def test_corrected_force_at_rest_has_the_joint_covariance(tmp_path):
    """Law: at the attitude of the spin errors of M and of the new b cancel, but for the spin's own noise."""
    before = calibration(
        tmp_path,
        accelerometer={
            "unit": "m/s^2",
            "M": np.eye(3),
            "b": np.zeros(3),
            "covariance": covariance(1e-3, 0.1),
            "estimated": ("bias", "matrix"),
        },
    )
    result = spin(recording(record(MOVES, 89)), calibration=before)
    made = result.calibration.accelerometer
    response = np.hstack([np.kron(np.eye(3), result.gravity * result.spins[-1].up), np.eye(3)])
    at_rest = response @ made.covariance @ response.T
    np.testing.assert_allclose(at_rest, result.covariance[:3, :3], rtol=1e-6, atol=1e-15)


def test_a_calibration_of_one_triad_serves_that_one(tmp_path):
    before = calibration(tmp_path, gyroscope={"unit": "rad/s", "M": matrix(3), "b": np.zeros(3)})
    result = spin(recording(corrupted(record(MOVES, 91), np.eye(3), matrix(3))), calibration=before)
    made = result.calibration
    np.testing.assert_array_equal(made.accelerometer.M, np.eye(3))
    np.testing.assert_array_equal(made.gyroscope.M, matrix(3))


def test_a_bad_calibration_file_is_one_line_before_the_log_is_read(tmp_path):
    bad = tmp_path / "bad.yaml"
    bad.write_text("schema: tumble-calibration/1\n")
    done = typed("spin", tmp_path / "no_such.csv", "-o", tmp_path / "out", "--calibration", bad)
    assert done.code == 2
    assert "bad.yaml" in one_line(done.err)
