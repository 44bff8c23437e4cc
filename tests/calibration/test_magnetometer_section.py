"""The magnetometer of a calibration file, and files of the version before it."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from tests.support.calibration_files import VERSION_2, load

from tumble.calibration.document import Calibration
from tumble.foundation.errors import ArrayError, CalibrationFileError

M = np.array([[1.1, 0.02, -0.03], [0.01, 0.9, 0.04], [-0.02, 0.05, 1.2]])
B = np.array([12.0, -35.0, 4.5])
C = np.array([0.8, -0.3, 2.0])


def magnetometer(**extra):
    section = {"unit": "uT", "M": M, "b": B, "current": C, "current_sigma": [0.1, np.nan, 0.1]} | extra
    return Calibration.model_validate({"name": "compass", "magnetometer": section})


def test_version_2_file_reads_as_version_3_with_its_hash(tmp_path):
    read = load(tmp_path, VERSION_2)
    assert read.text().splitlines()[3] == "schema: tumble-calibration/3"
    assert read.hash() == "317bc4b5fe901f874e14bf9442e826246a905c9660726cdc8355815fa782bc3d"
    assert load(tmp_path, read.text()).hash() == read.hash()


def test_version_2_file_with_a_magnetometer_is_refused(tmp_path):
    text = magnetometer().text().replace("calibration/3", "calibration/2")
    with pytest.raises(CalibrationFileError, match=r"magnetometer is none of the keys of .*/2"):
        load(tmp_path, text)


def test_a_magnetometer_survives_the_file_and_gaps_are_null(tmp_path):
    dip = {"value": 64.2, "sigma": 0.3, "source": "found"}
    covariance = np.full((12, 12), np.nan)
    covariance[9:, 9:] = np.eye(3)
    saved = magnetometer(dip=dip, covariance=covariance)
    read = load(tmp_path, saved.text())
    assert read == saved
    assert read.magnetometer.M.tobytes() == M.tobytes()
    section = yaml.safe_load(saved.text())["magnetometer"]
    assert section["current_sigma"] == [0.1, None, 0.1]
    assert section["covariance"][0][0] is None
    assert section["dip"] == dip


def test_correction_undoes_the_magnetic_forward_model():
    rng = np.random.default_rng(3)
    truth, current = rng.normal(0.0, 50.0, (20, 3)), rng.normal(0.0, 10.0, 20)
    readings = truth @ M.T + B + current[:, np.newaxis] * C
    found = magnetometer().correct_magnetic(readings, current)
    assert found == pytest.approx(truth, abs=1e-10)
    one = magnetometer().correct_magnetic(list(readings[0]), float(current[0]))
    assert one == pytest.approx(truth[0], abs=1e-10)


def test_unknown_current_leaves_its_effect():
    readings = np.array([[20.0, 10.0, -40.0], [20.0, 10.0, -40.0]])
    found = magnetometer().correct_magnetic(readings, [np.nan, 1.0])
    assert found[0] == pytest.approx(np.linalg.solve(M, readings[0] - B))
    assert not np.allclose(found[0], found[1])


def test_currents_need_as_many_values_as_readings():
    with pytest.raises(ArrayError, match="current"):
        magnetometer().correct_magnetic(np.zeros((3, 3)), [1.0, 2.0])


def test_field_without_a_calibration_stays_as_it_is(tmp_path):
    assert load(tmp_path, VERSION_2).correct_magnetic([1.0, 2.0, 3.0]).tolist() == [1.0, 2.0, 3.0]
