"""Contribution of a thermal session to a calibration: temperature drift, beside the earlier contents."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tumble.calibration.contributions import TEMPERATURE_DRIFT, added
from tumble.calibration.document import Calibration
from tumble.foundation.recording import FloatArray
from tumble.procedures.thermal.result import AxisDrift, ThermalResult


def calibration_of(result: ThermalResult) -> Calibration:
    """Creates the calibration file of a unit whose drift was found, on top of what it was started from.

    M and b are left as they are: the reference of the drift is the temperature that they hold at. A triad
    that has no calibration yet is left as measured at that temperature.
    """
    found = {triad: {TEMPERATURE_DRIFT: _drift(result, result.of_triad(triad))} for triad in result.triads}
    return Calibration.model_validate(added(result, result.verdict, "thermal", "temperature drift", found))


def _drift(result: ThermalResult, axes: Sequence[AxisDrift]) -> dict[str, Any]:
    hysteresis = [axis.hysteresis for axis in axes]
    return {
        "reference": result.reference,
        "range": np.array(result.range),
        "bias": _rows([axis.bias for axis in axes], 0.0),
        "scale": _rows([axis.scale for axis in axes], 0.0),
        "bias_sigma": _rows([_sigmas(axis)[: len(axis.bias)] for axis in axes], np.nan),
        "scale_sigma": _rows([_sigmas(axis)[len(axis.bias) :][: len(axis.scale)] for axis in axes], np.nan),
        "hysteresis": np.array([each.value for each in hysteresis]),
        "hysteresis_sigma": np.array([each.sigma if each.observable else np.nan for each in hysteresis]),
    }


def _sigmas(axis: AxisDrift) -> FloatArray:
    return np.sqrt(np.diag(axis.covariance))


def _rows(powers: Sequence[FloatArray], without: float) -> tuple[FloatArray, ...]:
    """Arranges the coefficients of three axes side by side, a row for each power of any of them."""
    highest = max(len(each) for each in powers)
    return tuple(np.array([each[k] if k < len(each) else without for each in powers]) for k in range(highest))
