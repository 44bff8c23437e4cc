"""A calibration in the axes of a log, or of another program, that states others.

With R the rotation from the axes of a calibration to those wanted, `y' = R y` and `u' = R u` turn
`y = (1 + s) M u + b + d + G f + c I` into `M' = R M R^T`, `G' = R G R^T`, `b' = R b`, `d' = R d`,
`c' = R c`. R exchanges axes and changes signs, so that no digit is lost.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeVar

import numpy as np

from tumble.calibration.contributions import NOISE, NOISE_FOR_FILTERS
from tumble.calibration.document import (
    Calibration,
    GyroscopeCalibration,
    MagnetometerCalibration,
    TriadCalibration,
)
from tumble.calibration.temperature_drift import TemperatureDrift
from tumble.foundation.body_axes import rotation
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import CALIBRATED_TRIADS

_OF_ONE_AXES = (
    "K",
    "L",
    "Q",
    "angles",
    "sigma",
    "residuals",
    "constant_rates",
    "g_sensitivity_sigma",
    "current_sigma",
    "budget",
)
"""Keys of a triad that corrects nothing, and that hold in the axes of its log alone."""
_AnyTriad = TypeVar("_AnyTriad", bound=TriadCalibration)


def turned(calibration: Calibration, to: str) -> Calibration:
    """Returns a calibration of known axes in axes `to`, as far as it corrects readings."""
    assert calibration.axes is not None, "axes are known"
    matrix = np.array(rotation(to, calibration.axes), dtype=np.float64)
    sections: dict[str, TriadCalibration] = {
        triad: _turned(section, matrix)
        for triad in CALIBRATED_TRIADS
        if (section := getattr(calibration, triad)) is not None
    }
    return calibration.model_copy(update={**sections, "axes": to})


def in_axes(calibration: Calibration, axes: str | None) -> Calibration:
    """Returns a calibration in the axes of what it is used on, if both are known; else as it is."""
    if not axes or calibration.axes in (None, axes):
        return calibration
    return turned(calibration, axes)


def on_axes(calibration: Calibration, axes: str | None) -> Iterator[str]:
    """Yields a notice where a calibration is turned before it is used."""
    if in_axes(calibration, axes) is not calibration:
        yield f"the calibration {calibration.name} holds in {calibration.axes} and is turned into {axes}"


def _turned(section: _AnyTriad, matrix: FloatArray) -> _AnyTriad:
    known = {key for key in _OF_ONE_AXES if key in type(section).model_fields}
    update: dict[str, Any] = {key: type(section).model_fields[key].get_default() for key in known}
    update |= {"M": matrix @ section.M @ matrix.T, "b": matrix @ section.b}
    order = np.abs(matrix).argmax(axis=1)
    update |= {
        key: values[order]
        for key in (*NOISE, *NOISE_FOR_FILTERS)
        if (values := getattr(section, key)) is not None
    }
    if isinstance(section, GyroscopeCalibration) and section.g_sensitivity is not None:
        update["g_sensitivity"] = matrix @ section.g_sensitivity @ matrix.T
    if isinstance(section, MagnetometerCalibration) and section.current is not None:
        update["current"] = matrix @ section.current
    if section.temperature_drift is not None:
        update["temperature_drift"] = _turned_drift(section.temperature_drift, matrix)
    if section.covariance is not None:
        update["covariance"] = _turned_covariance(section.covariance, matrix)
    if section.inherited is not None:
        covariance = _turned_covariance(section.inherited.covariance, matrix)
        update["inherited"] = section.inherited.model_copy(update={"covariance": covariance})
    return section.model_copy(update=update)


def _turned_drift(drift: TemperatureDrift, matrix: FloatArray) -> TemperatureDrift:
    order = np.abs(matrix).argmax(axis=1)
    return TemperatureDrift(
        reference=drift.reference,
        range=drift.range,
        bias=tuple(matrix @ power for power in drift.bias),
        scale=tuple(power[order] for power in drift.scale),
    )


def _turned_covariance(covariance: FloatArray, matrix: FloatArray) -> FloatArray:
    """Turns (12, 12) of [M row by row, b]; gaps, NaN, goes where their parameter goes."""
    whole = np.zeros((12, 12))
    whole[:9, :9] = np.kron(matrix, matrix)
    whole[9:, 9:] = matrix
    order = np.abs(whole).argmax(axis=1)
    signs = whole[np.arange(12), order]
    moved: FloatArray = covariance[np.ix_(order, order)] * np.outer(signs, signs)
    return moved
