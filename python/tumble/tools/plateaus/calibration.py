"""The calibration file of a unit over temperature."""

from __future__ import annotations

from typing import Any

import numpy as np

from tumble.calibration.document import Calibration
from tumble.calibration.triad_content import factors_content, sigma_content
from tumble.foundation.plain import finite_or_none, plain
from tumble.foundation.units import CALIBRATED_TRIADS
from tumble.tools.plateaus.result import PlateausResult, TriadOverTemperature

_ELEMENTS = 12


def calibration_of(result: PlateausResult) -> Calibration:
    """Creates the file: M and b at the reference, and the change of bias and scale with temperature."""
    low, high = result.range
    content: dict[str, Any] = {
        **{key: value for key, value in result.base.items() if key not in CALIBRATED_TRIADS},
        "name": result.name,
        "serial": result.serial,
        "software": result.software,
        **result.provenance.content(),
        "verdict": "model not met" if result.verdict == "model not met" else "calibrated",
        "method": {"procedure": "plateaus", "options": _options(result)},
        "temperature": {"low": low, "mean": result.reference, "high": high},
    }
    for triad in result.triads:
        content[triad.triad] = _section(triad, result.base[triad.triad])
    return Calibration.model_validate(content)


def _options(result: PlateausResult) -> dict[str, Any]:
    plateaus = [
        {"name": each.name, "sha256": each.hash, "temperature": each.temperature} for each in result.plateaus
    ]
    return {**{key: plain(value) for key, value in result.options.items()}, "plateaus": plateaus}


def _section(triad: TriadOverTemperature, base: Any) -> dict[str, Any]:  # noqa: ANN401 - plain content
    covariance = triad.covariance[:_ELEMENTS, :_ELEMENTS]
    section: dict[str, Any] = {**base, "M": triad.M, "b": triad.b, "covariance": covariance}
    inherited = base.get("inherited")
    total = covariance if inherited is None else covariance + inherited["covariance"]
    if "matrix" in base.get("estimated", ()):
        section |= factors_content(triad.M)
    if inherited is not None:
        sigma = sigma_content(triad.M, inherited["covariance"])
        section["inherited"] = {**inherited, "sigma": sigma}
    return section | {
        "sigma": sigma_content(triad.M, total),
        "chi_square": triad.chi_square,
        "degrees_of_freedom": triad.degrees_of_freedom,
        "temperature_drift": _drift(triad),
        **({"widening": widest} if (widest := max(triad.widening.values())) > 1.0 else {}),
    }


def _drift(triad: TriadOverTemperature) -> dict[str, Any]:
    sigma = np.sqrt(np.diag(triad.covariance))[_ELEMENTS:]
    # A power that was not fitted has no sigma.
    rows = np.where(sigma > 0.0, sigma, np.nan).reshape(-1, 3)
    p = len(triad.bias)
    return {
        "reference": triad.reference,
        "range": np.array(triad.range),
        "bias": tuple(triad.bias),
        "scale": tuple(triad.scale),
        "bias_sigma": tuple(rows[:p]),
        "scale_sigma": tuple(rows[p:]),
        "covariance": tuple(tuple(map(finite_or_none, row)) for row in triad.covariance),
        "hysteresis": triad.hysteresis,
        "hysteresis_sigma": triad.hysteresis_sigma,
    }
