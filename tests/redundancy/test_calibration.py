"""The calibration of a secondary is its error against the primary, combined with the primary's own."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tumble.calibration.document import Calibration
from tumble.foundation.errors import ProcedureError
from tumble.procedures.redundancy.result import UNKNOWN, RedundancyResult, SecondaryError

SENSORS = ("accelerometer", "gyroscope")


def matrix_near(generator, rotation, size=0.03):
    return (np.eye(3) + size * generator.standard_normal((3, 3))) @ rotation


def error_of(generator, sensor, rotation, **changes):
    fields = {
        "matrix": matrix_near(generator, rotation),
        "bias": 0.3 * generator.standard_normal(3),
        "matrix_sigma": 1e-4 * (1.0 + generator.random((3, 3))),
        "bias_sigma": 1e-3 * (1.0 + generator.random(3)),
        "lever_arm": np.array([0.01, 0.02, 0.03]) if sensor == "accelerometer" else None,
        "lever_arm_sigma": np.array([1e-3, np.inf, 1e-3]) if sensor == "accelerometer" else None,
    }
    fitted = {"unit": "imu2", "sensor": sensor, "fit_model": "affine", "directions": 3, "pairs": 400}
    return SecondaryError(**(UNKNOWN | {"residual": 0.01, "sequence": 2} | fitted | fields | changes))


def result_of(errors, primary=None):
    return RedundancyResult(
        primary="imu1",
        secondaries=("imu2",),
        start=0.0,
        end=40.0,
        settings={"gravity": 9.81},
        events=(),
        errors=tuple(errors),
        window_time=np.empty(0),
        traces=(),
        selected=(),
        replay_rate=1.0,
        calibration_hash=primary.hash() if primary else "",
        applied=primary.content() if primary else {},
        serials={"imu1": "A1", "imu2": "B2"},
    )


def primary_of(generator, covariance=True, **gyroscope):
    def triad():
        known = {"covariance": np.diag(1e-8 * (1.0 + generator.random(12)))} if covariance else {}
        return {"M": matrix_near(generator, np.eye(3)), "b": 0.1 * generator.standard_normal(3), **known}

    return Calibration.model_validate(
        {"name": "imu1", "accelerometer": triad(), "gyroscope": {**triad(), **gyroscope}}
    )


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=30)
def test_calibration_maps_the_secondary_to_truth_in_the_primary_frame(seed, calibrated):
    print(f"seed {seed}")
    generator = np.random.default_rng(seed)
    rotation = Rotation.random(random_state=generator).as_matrix()
    errors = {sensor: error_of(generator, sensor, rotation) for sensor in SENSORS}
    primary = primary_of(generator) if calibrated else None
    found = result_of(errors.values(), primary).calibration_of("imu2")
    truth = {
        "accelerometer": 10.0 * generator.standard_normal((5, 3)),
        "gyroscope": generator.standard_normal((5, 3)),
    }
    said = {}
    for sensor in SENSORS:
        first = truth[sensor]
        if primary is not None:
            triad = getattr(primary, sensor)
            first = first @ triad.M.T + triad.b
        said[sensor] = first @ errors[sensor].matrix.T + errors[sensor].bias
    corrected = found.correct(said["accelerometer"], said["gyroscope"])
    for sensor, values in zip(SENSORS, corrected, strict=True):
        np.testing.assert_allclose(values, truth[sensor], atol=1e-9)


def test_its_factors_multiply_to_its_matrix_with_relative_mounting():
    generator = np.random.default_rng(3)
    turn = np.radians([120.0, -40.0, 10.0])
    error = error_of(
        generator, "accelerometer", np.eye(3), matrix=1.02 * Rotation.from_rotvec(turn).as_matrix()
    )
    triad = result_of([error]).calibration_of("imu2").accelerometer
    np.testing.assert_allclose(triad.K @ triad.L @ triad.Q, triad.M, atol=1e-12)
    np.testing.assert_allclose(triad.angles.mounting, np.degrees(turn), atol=1e-9)
    np.testing.assert_allclose(np.diag(triad.K), 1.02, atol=1e-12)
    assert triad.estimated == ("bias", "matrix")


@pytest.mark.parametrize("calibrated", [False, True])
def test_its_sigmas_are_those_of_a_thousand_draws(calibrated):
    seed = 4
    print(f"seed {seed}")
    generator = np.random.default_rng(seed)
    rotation = Rotation.from_rotvec([0.2, -0.4, 2.9]).as_matrix()
    error = error_of(generator, "accelerometer", rotation)
    primary = primary_of(generator) if calibrated else None
    sigma = result_of([error], primary).calibration_of("imu2").accelerometer.sigma
    draws = [_drawn(generator, error, primary) for _ in range(1000)]
    spread = np.std(draws, axis=0)
    told = [*sigma.bias, *sigma.scale, *_pairs(sigma.non_orthogonality), *sigma.mounting]
    # 1000 draws know a sigma to 2 %; the largest of twelve strays by three times that.
    np.testing.assert_allclose(told, spread, rtol=0.08)


def _pairs(angles):
    return [angles.xy, angles.yz, angles.zx]


def _drawn(generator, error, primary):
    """Parameters for newly drawn errors."""
    relation = error.matrix + error.matrix_sigma * generator.standard_normal((3, 3))
    bias = error.bias + error.bias_sigma * generator.standard_normal(3)
    first, first_bias = np.eye(3), np.zeros(3)
    if primary is not None:
        triad = primary.accelerometer
        off = generator.multivariate_normal(np.zeros(12), triad.covariance)
        first, first_bias = triad.M + off[:9].reshape(3, 3), triad.b + off[9:]
    matrix = relation @ first
    axes = matrix / np.linalg.norm(matrix, axis=1)[:, None]
    angles = np.degrees(np.arcsin([axes[0] @ axes[1], axes[1] @ axes[2], axes[2] @ axes[0]]))
    turned = Rotation.from_matrix(_mounting(matrix)).as_rotvec(degrees=True)
    return [*(relation @ first_bias + bias), *np.linalg.norm(matrix, axis=1), *angles, *turned]


def _mounting(matrix):
    """Gram-Schmidt over the rows: x stays, y is turned within the plane of x and y."""
    x = matrix[0] / np.linalg.norm(matrix[0])
    y = matrix[1] - (matrix[1] @ x) * x
    y /= np.linalg.norm(y)
    return np.array([x, y, np.cross(x, y)])


def test_direction_without_motion_has_no_sigma_and_is_named():
    generator = np.random.default_rng(5)
    sigma = np.full((3, 3), 1e-3)
    sigma[:, 2] = np.inf
    error = error_of(generator, "gyroscope", np.eye(3), matrix=np.eye(3), matrix_sigma=sigma)
    triad = result_of([error]).calibration_of("imu2").gyroscope
    assert triad.estimated == ("bias",)
    assert triad.K is None
    assert triad.rank == 9
    assert "response to angular rate about case axis z: the motion did not show it" in triad.unobservable
    assert np.isnan(triad.sigma.scale[2])
    assert np.isfinite(triad.sigma.scale[:2]).all()
    assert np.isnan(triad.sigma.mounting).any()


def test_an_offset_alone_says_nothing_of_the_matrix():
    generator = np.random.default_rng(6)
    error = error_of(
        generator, "accelerometer", np.eye(3), matrix=np.eye(3), matrix_sigma=np.full((3, 3), np.inf)
    )
    triad = result_of([error]).calibration_of("imu2").accelerometer
    assert np.isfinite(triad.sigma.bias).all()
    assert np.isnan(triad.sigma.scale).all()
    assert triad.sigma.non_orthogonality.xy is None


def test_uncalibrated_primary_is_stated_as_the_truth_in_the_file():
    error = error_of(np.random.default_rng(7), "accelerometer", np.eye(3))
    found = result_of([error]).calibration_of("imu2")
    assert found.accelerometer.unobservable == (
        "errors of the accelerometer of the primary imu1 itself: it is assumed to be right",
    )
    assert found.gyroscope is None
    assert (found.reference.name, found.reference.serial, found.serial) == ("imu1", "A1", "B2")
    assert found.method.options["frame"] == "case of imu1"
    assert found.method.options["accelerometer"]["lever_arm_sigma"] == [1e-3, None, 1e-3]


def test_primary_without_covariance_is_stated_as_without_sigma():
    generator = np.random.default_rng(8)
    primary = primary_of(generator, covariance=False)
    error = error_of(generator, "gyroscope", np.eye(3))
    triad = result_of([error], primary).calibration_of("imu2").gyroscope
    assert "how far the calibration of the primary imu1 is right: its file does not say" in triad.unobservable


def test_the_g_sensitivity_of_the_primary_is_carried_on():
    generator = np.random.default_rng(9)
    primary = primary_of(generator, g_sensitivity=1e-3 * generator.standard_normal((3, 3)))
    errors = [error_of(generator, sensor, np.eye(3)) for sensor in SENSORS]
    found = result_of(errors, primary).calibration_of("imu2")
    expected = errors[1].matrix @ primary.gyroscope.g_sensitivity
    np.testing.assert_allclose(found.gyroscope.g_sensitivity, expected, atol=1e-12)


def test_it_is_saved_and_read_back_as_it_was(tmp_path):
    generator = np.random.default_rng(10)
    errors = [error_of(generator, sensor, np.eye(3)) for sensor in SENSORS]
    found = result_of(errors).calibration_of("imu2")
    found.save(tmp_path / "imu2.yaml")
    assert Calibration.load(tmp_path / "imu2.yaml") == found


def test_a_secondary_that_was_never_calibrated_has_no_file():
    with pytest.raises(ProcedureError, match="imu2: has no stored error"):
        result_of([]).calibration_of("imu2")
