"""Sections of a calibration file from triads whose M and b a procedure found."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from tumble.foundation.error_decomposition import (
    PAIRS,
    factor_sigma,
    factors,
    mounting_angles,
    non_orthogonality,
)
from tumble.foundation.plain import finite_or_none
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadResult


class HasTriads(Protocol):
    """Result of one unit whose M and b were found."""

    @property
    def temperature(self) -> tuple[float, float, float] | None:
        """Lowest, mean and highest, degC."""

    @property
    def accelerometer(self) -> TriadResult | None:
        """None where it was not calibrated."""

    @property
    def gyroscope(self) -> TriadResult | None:
        """None where it was not calibrated."""


def triads_content(result: HasTriads) -> dict[str, Any]:
    """Returns temperature and triads of a unit whose M and b were found."""
    content: dict[str, Any] = {}
    if result.temperature is not None:
        low, mean, high = result.temperature
        content["temperature"] = {"low": low, "mean": mean, "high": high}
    for kind, triad in (("accelerometer", result.accelerometer), ("gyroscope", result.gyroscope)):
        if triad is not None:
            content[kind] = triad_content(triad)
    return content


def triad_content(triad: TriadResult) -> dict[str, Any]:
    """Returns the section of one triad."""
    value = {parameter.name: parameter.value for parameter in triad.parameters}
    sigma = {p.name: p.sigma if p.observable and np.isfinite(p.sigma) else np.nan for p in triad.parameters}
    residuals = zip(triad.residual_labels, triad.residuals, triad.residual_sigma, strict=True)
    # K, L and Q of a matrix that the data showed in part would be numbers nobody measured.
    parts = {"K": triad.K, "L": triad.L, "Q": triad.Q} if "matrix" in triad.estimated else {}
    content: dict[str, Any] = {
        "unit": triad.unit,
        "M": triad.M,
        "b": triad.b,
        **parts,
        "angles": {
            "non-orthogonality": _by_pair(value),
            "mounting": _by_axis(value, "mounting"),
        },
        "sigma": _sigma(sigma),
        "estimated": triad.estimated,
        "unobservable": triad.unobservable,
        "rank": triad.rank,
        "chi_square": finite_or_none(triad.chi_square),
        "degrees_of_freedom": triad.degrees_of_freedom,
        **({"widening": triad.widening} if triad.widening > 1.0 else {}),
        "noise_density": triad.noise_density,
        "bias_instability": triad.bias_instability,
        "residuals": [{"label": label, "value": mean, "sigma": spread} for label, mean, spread in residuals],
        "covariance": triad.covariance,
    }
    if triad.g_sensitivity is not None:
        content |= {"g_sensitivity": triad.g_sensitivity, "g_sensitivity_sigma": triad.g_sensitivity_sigma}
    return content


def magnetometer_content(triad: TriadResult, source: str) -> dict[str, Any]:
    """Returns the section of a magnetometer; `source` states what it inherits."""
    content = triad_content(triad)
    # Nothing of its noise over time is known from means.
    for key in ("noise_density", "bias_instability"):
        del content[key]
    if triad.inherited is not None:
        content["inherited"] = inherited_content(triad, source)
    return content


def inherited_content(triad: TriadResult, source: str) -> dict[str, Any]:
    """Returns what reference or gravity, stated by `source`, leave on all targets alike."""
    sigma = {p.name: np.nan if p.inherited is None else p.inherited for p in triad.parameters}
    return {"source": source, "sigma": _sigma(sigma), "covariance": triad.inherited}


def sigma_content(matrix: FloatArray, covariance: FloatArray) -> dict[str, Any]:
    """Returns the 1-sigma of what people read off M (3, 3) and b, by the covariance (12, 12) of both."""
    sigma = factor_sigma(matrix, covariance[:9, :9])
    angles = np.degrees(sigma[3:])
    return {
        "bias": np.sqrt(np.diag(covariance)[9:]),
        "scale": sigma[:3],
        "non-orthogonality": dict(zip(PAIRS, map(finite_or_none, angles[:3]), strict=True)),
        "mounting": angles[3:],
    }


def factors_content(matrix: FloatArray) -> dict[str, Any]:
    """Returns K, L and Q of M (3, 3), and the angles in them, deg."""
    K, L, Q = factors(matrix)
    degrees = np.degrees(non_orthogonality(matrix))
    angles = {
        "non-orthogonality": dict(zip(PAIRS, map(float, degrees), strict=True)),
        "mounting": mounting_angles(Q),
    }
    return {"K": K, "L": L, "Q": Q, "angles": angles}


def _sigma(sigma: dict[str, float]) -> dict[str, Any]:
    return {
        "bias": _by_axis(sigma, "bias"),
        "scale": _by_axis(sigma, "scale"),
        "non-orthogonality": _by_pair(sigma),
        "mounting": _by_axis(sigma, "mounting"),
    }


def _by_axis(values: dict[str, float], group: str) -> FloatArray:
    return np.array([values[f"{group} {axis}"] for axis in "xyz"])


def _by_pair(values: dict[str, float]) -> dict[str, float | None]:
    return {pair: finite_or_none(values[f"non-orthogonality {pair}"]) for pair in PAIRS}
