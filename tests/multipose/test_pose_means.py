"""Tables with one row a pose: their noise is what the fit leaves."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from repetitions import repetitions
from tumble.foundation.errors import TumbleError
from tumble.procedures.multipose.pose_means import MOST_ROWS

OWN = [0, 3, 4, 6, 7, 8, 9, 10, 11]
POSES = 24
NOISE = 0.003
"""m/s^2, of the mean of a pose."""
MATRIX = np.array([[0.993, 0.0, 0.0], [0.004, 1.032, 0.0], [-0.003, 0.008, 0.977]])
SI = tumble.ReadOptions(accelerometer_unit="m/s^2")
BIAS = np.array([0.26, -0.39, 0.44])


def written(path, rng, noise=NOISE):
    up = rng.normal(size=(POSES, 3))
    up *= 9.80665 / np.linalg.norm(up, axis=1, keepdims=True)
    readings = up @ MATRIX.T + BIAS + noise * rng.normal(size=up.shape)
    np.savetxt(path, readings, header="ax,ay,az", delimiter=",", comments="", fmt="%.7f")
    return path


def test_sigmas_of_means_of_poses_hold(tmp_path):
    seed, sessions = 8, repetitions(40)
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    squares = []
    for _ in range(sessions):
        found = tumble.multipose(written(tmp_path / "means.csv", rng), pose_means=True, read=SI).accelerometer
        error = np.concatenate([(found.M - MATRIX).ravel(), found.b - BIAS])[OWN]
        squares.append((error / np.sqrt(np.diag(found.covariance)[OWN])) ** 2)
    # Student's t of 15 degrees of freedom has the variance 15 / 13.
    assert np.mean(squares) == pytest.approx(15 / 13, abs=4 * 1.7 / np.sqrt(2 * sessions))


def test_noise_of_means_is_reported(tmp_path):
    found = tumble.multipose(
        written(tmp_path / "means.csv", np.random.default_rng(3)), pose_means=True, read=SI
    )
    assert any("the noise of a mean is the scatter about the fit" in warning for warning in found.warnings)
    assert len(found.poses) == POSES


def test_log_whose_rows_point_elsewhere_gets_the_option(tmp_path):
    path = written(tmp_path / "means.csv", np.random.default_rng(3))
    with pytest.raises(TumbleError, match="give --pose-means"):
        tumble.multipose(path, read=tumble.ReadOptions(rate=1.0, accelerometer_unit="m/s^2"))


def test_a_recording_given_as_means_of_poses_is_refused(tmp_path):
    path = tmp_path / "log.csv"
    rows = np.random.default_rng(3).normal([0.0, 0.0, 9.8], 0.02, (MOST_ROWS + 1, 3))
    np.savetxt(path, rows, header="ax,ay,az", delimiter=",", comments="")
    with pytest.raises(TumbleError, match="leave it out for a recording"):
        tumble.multipose(path, pose_means=True, read=SI)
