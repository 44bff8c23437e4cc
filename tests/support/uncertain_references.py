"""References whose calibration errs within the uncertainty that it states."""

import numpy as np

from tumble.calibration.document import Calibration

MATRIX_SIGMA = 5e-4
BIASES = {"accelerometer": 2e-3, "gyroscope": 1e-5}
UNITS = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}


def stated(matrix_sigma, biases=BIASES):
    """(12, 12) covariance of [M row by row, b] of each triad, all elements independent."""
    return {triad: np.diag([matrix_sigma**2] * 9 + [biases[triad] ** 2] * 3) for triad in UNITS}


def calibration_of(covariances, drawn):
    """Calibration of a perfect reference, M = 1 and b = 0, wrong by what was `drawn`, (12,) of each triad."""
    triads = {
        triad: {
            "unit": UNITS[triad],
            "M": (np.eye(3) + drawn[triad][:9].reshape(3, 3)).tolist(),
            "b": drawn[triad][9:].tolist(),
            "covariance": covariance.tolist(),
        }
        for triad, covariance in covariances.items()
    }
    return Calibration.model_validate({"schema": "tumble-calibration/2", "name": "reference", **triads})


def draw(covariances, random):
    """An error of a calibration, drawn from its covariance."""
    return {
        triad: random.multivariate_normal(np.zeros(12), covariance)
        for triad, covariance in covariances.items()
    }


def exact(covariances):
    """No error."""
    return {triad: np.zeros(12) for triad in covariances}
