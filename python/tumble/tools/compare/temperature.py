"""Differences of temperature drift of two calibrations, in the range that both cover."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tumble.calibration.document import Calibration
from tumble.calibration.temperature_drift import TemperatureDrift
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import CALIBRATED_UNITS, CalibratedTriad
from tumble.tools.compare.common import change, common_range
from tumble.tools.compare.result import Difference

_NEAR = 1.0
"""K: an edge nearer to the common temperature than this shows no drift."""


def drift_differences(
    first: Calibration, second: Calibration, triad: CalibratedTriad, temperature: float
) -> Iterator[Difference]:
    """Compares the change from the common temperature to both ends of the range that both know."""
    drifts = [each.temperature_drifts((triad,)).get(triad) for each in (first, second)]
    if drifts[0] is None or drifts[1] is None:
        return
    low, high = common_range([drifts[0], drifts[1]])
    for edge in (low, high) if low < high else ():
        if abs(edge - temperature) >= _NEAR:
            yield from _at(drifts[0], drifts[1], triad, temperature, edge)


def _at(
    first: TemperatureDrift, second: TemperatureDrift, triad: CalibratedTriad, start: float, end: float
) -> Iterator[Difference]:
    for part, unit in (("bias", CALIBRATED_UNITS[triad]), ("scale", "1")):
        values, variances = zip(*(_swing(drift, part, start, end) for drift in (first, second)), strict=True)
        if not values[0].any() and not values[1].any():
            continue
        sigmas = np.sqrt(variances[0] + variances[1])
        for k, axis in enumerate("xyz"):
            pair = float(values[0][k]), float(values[1][k])
            reason = "" if np.isfinite(sigmas[k]) else "not observable in one of them"
            if sigmas[k] == 0.0:
                reason = "neither states an uncertainty"
            name = f"{triad} {part} from {start:.0f} to {end:.0f} degC, {axis}"
            yield Difference(name, unit, *pair, pair[1] - pair[0], float(sigmas[k]), reason)


def _swing(drift: TemperatureDrift, part: str, start: float, end: float) -> tuple[FloatArray, FloatArray]:
    """(3,) change of bias or scale between two temperatures, and its variance."""
    is_bias = part == "bias"
    coefficients = drift.bias if is_bias else drift.scale
    sigmas = drift.bias_sigma if is_bias else drift.scale_sigma
    before, after = (change(coefficients, sigmas, drift, t) for t in (start, end))
    return after[0] - before[0], after[1] + before[1]
