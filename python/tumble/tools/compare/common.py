"""Conversion of calibrations to one temperature and one frame (docs/theory/compare.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tumble.calibration.document import Calibration
from tumble.calibration.temperature_drift import TemperatureDrift
from tumble.foundation.error_decomposition import factors, propagated
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import CALIBRATED_TRIADS, CalibratedTriad
from tumble.tools.compare.unit import PLACES, UnitModel, jacobian

ACCELEROMETER, GYROSCOPE, MAGNETOMETER = CALIBRATED_TRIADS
_SKEW = 1e-12
"""Elements of M above its diagonal that are rounding, where the frame is that of the accelerometer's axes."""


def common_temperature(calibrations: Sequence[Calibration], triad: CalibratedTriad) -> float | None:
    """Chooses the temperature, degC, to compare a triad at; None where no calibration knows its drift.

    It is that at which those were made that know no drift, as far as they state it, or else the reference of
    the first that does, and lies within the ranges of all if these have any temperature in common.
    """
    known = [each.temperature_drifts((triad,)) for each in calibrations]
    drifts = [each[triad] for each in known if triad in each]
    if not drifts:
        return None
    fixed = [
        each.temperature.mean
        for each, drift in zip(calibrations, known, strict=True)
        if triad not in drift and each.temperature is not None
    ]
    wanted = float(np.mean(fixed)) if fixed else drifts[0].reference
    low, high = common_range(drifts)
    return wanted if low > high else min(max(wanted, low), high)


def common_range(drifts: Sequence[TemperatureDrift]) -> tuple[float, float]:
    """Lowest and highest temperature, degC, that all were seen at; the first is larger if there is none."""
    return max(drift.range[0] for drift in drifts), min(drift.range[1] for drift in drifts)


def brought_to(
    unit: UnitModel, triad: CalibratedTriad, drift: TemperatureDrift, temperature: float
) -> UnitModel:
    """Returns a unit as it is at another temperature, degC, eq. 2 and 3."""
    bias, bias_variance = change(drift.bias, drift.bias_sigma, drift, temperature)
    scale, scale_variance = change(drift.scale, drift.scale_sigma, drift, temperature)
    matrix = unit.matrix(triad)
    gain = np.kron(np.diag(1.0 + scale), np.eye(3))
    values, covariance = unit.values.copy(), unit.covariance.copy()
    place = PLACES[triad]
    values[place] = np.concatenate([gain @ matrix.ravel(), unit.bias(triad) + bias])
    whole = np.eye(len(values))
    whole[place, place][:9, :9] = gain
    covariance = propagated(whole, covariance)
    added = np.zeros(covariance.shape)
    rows = [variance * np.outer(row, row) for variance, row in zip(scale_variance, matrix, strict=True)]
    for k, row in enumerate(rows):
        start = place.start + 3 * k
        added[start : start + 3, start : start + 3] = row
    added[place.start + 9 : place.stop, place.start + 9 : place.stop] = np.diag(bias_variance)
    return replace(unit, values=values, covariance=covariance + added)


def change(
    coefficients: Sequence[FloatArray],
    sigmas: Sequence[FloatArray] | None,
    drift: TemperatureDrift,
    temperature: float,
) -> tuple[FloatArray, FloatArray]:
    """(3,) change from the reference to a temperature, degC, and its variance; held at the edge of the range.

    Most files keep no covariance of coefficients, so their errors count as independent, which is on the safe
    side: those of odd powers, and those of even ones, mostly cancel.
    """
    t = float(np.clip(temperature, *drift.range)) - drift.reference
    powers = t ** np.arange(1, len(coefficients) + 1)[:, None]
    if not len(coefficients) or t == 0.0:
        return np.zeros(3), np.zeros(3)
    changed = (powers * np.array(coefficients)).sum(axis=0)
    variance = np.zeros(3) if sigmas is None else ((powers * np.array(sigmas)) ** 2).sum(axis=0)
    return changed, variance


def in_own_axes(unit: UnitModel) -> bool:
    """Returns whether the frame is that of the accelerometer's axes: M of it is lower triangular."""
    matrix = unit.matrix(ACCELEROMETER)
    return bool(np.abs(np.triu(matrix, 1)).max() <= _SKEW * np.abs(matrix).max())


def turned_to_own_axes(unit: UnitModel) -> UnitModel:
    """Returns a unit in the frame of its accelerometer's axes, eq. 4."""

    def turned(values: FloatArray) -> FloatArray:
        matrices = [values[PLACES[triad]][:9].reshape(3, 3) for triad in CALIBRATED_TRIADS]
        case_from_frame = factors(matrices[0])[2].T
        parts = [
            part
            for triad, matrix in zip(CALIBRATED_TRIADS, matrices, strict=True)
            for part in ((matrix @ case_from_frame).ravel(), values[PLACES[triad]][9:])
        ]
        return np.concatenate(parts)

    case_from_frame = factors(unit.matrix(ACCELEROMETER))[2].T
    return replace(
        unit,
        values=turned(unit.values),
        covariance=propagated(jacobian(turned, unit.values), unit.covariance),
        response=None if unit.response is None else unit.response @ case_from_frame,
        response_sigma=np.sqrt(unit.response_sigma**2 @ case_from_frame**2),
    )
