"""Effect of a difference of calibrations in motion (docs/theory/compare.md, eq. 9 to 11)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import CALIBRATED_TRIADS, CALIBRATED_UNITS, CalibratedTriad
from tumble.tools.compare.common import ACCELEROMETER, GYROSCOPE, MAGNETOMETER
from tumble.tools.compare.result import MotionError
from tumble.tools.compare.unit import PLACES, UnitModel
from tumble.tools.exchange.calibration_parts import TYPICAL


def motion_errors(first: UnitModel, second: UnitModel, largest_rate: float) -> Iterator[MotionError]:
    """Returns the error of the first where the second is right, of each triad in both.

    `largest_rate`, rad/s, is that of the turns. Both units are in one frame and at one temperature.
    """
    for triad in CALIBRATED_TRIADS:
        if first.says_nothing_of(triad) or second.says_nothing_of(triad):
            continue
        rms, expected = _rms(first, second, triad, largest_rate)
        yield MotionError(triad, CALIBRATED_UNITS[triad], motion_of(triad, largest_rate), rms, expected)


def motion_of(triad: CalibratedTriad, largest_rate: float) -> str:
    """Names the motion."""
    if triad == ACCELEROMETER:
        return "rests in all orientations"
    if triad == MAGNETOMETER:
        return f"all orientations in a field of {TYPICAL[triad]:g} uT"
    return f"turns about all axes at up to {largest_rate:g} rad/s"


def _rms(
    first: UnitModel, second: UnitModel, triad: CalibratedTriad, largest_rate: float
) -> tuple[float, float]:
    """Root mean square of the error, and what the uncertainties would make of it; NaN if one is not known."""
    # Directions are even over the sphere, rates even from zero to the largest.
    square = largest_rate**2 / 9.0 if triad == GYROSCOPE else TYPICAL[triad] ** 2 / 3.0
    correction = np.linalg.inv(first.matrix(triad))
    matrix = correction @ (second.matrix(triad) - first.matrix(triad))
    bias = correction @ (second.bias(triad) - first.bias(triad))
    mean_square = square * np.sum(matrix**2) + np.sum(bias**2)  # eq. 9
    weight = correction.T @ correction
    covariance = (first.covariance + second.covariance)[PLACES[triad], PLACES[triad]]
    expected = np.trace(np.kron(weight, square * np.eye(3)) @ covariance[:9, :9])  # eq. 11
    expected += np.trace(weight @ covariance[9:, 9:])
    if triad == GYROSCOPE and first.response is not None and second.response is not None:
        response = correction @ (second.response - first.response)
        mean_square += STANDARD_GRAVITY**2 / 3.0 * np.sum(response**2)  # eq. 10
        expected += STANDARD_GRAVITY**2 / 3.0 * _response_variance(first, second, weight)
    known = np.isfinite(expected) and not {triad} <= first.stated & second.stated
    return float(np.sqrt(mean_square)), float(np.sqrt(expected)) if known else np.nan


def _response_variance(first: UnitModel, second: UnitModel, weight: FloatArray) -> float:
    variance = first.response_sigma**2 + second.response_sigma**2
    return float(np.diag(weight) @ variance.sum(axis=1))
