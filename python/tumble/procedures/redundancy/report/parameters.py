"""The errors found of a secondary, printed: bias, scale, non-orthogonality, mounting and lever arm."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from tumble.foundation.error_decomposition import (
    PAIRS,
    factor_sigma,
    factors,
    mounting_angles,
    non_orthogonality,
)
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL, Parameter
from tumble.foundation.units import UNITS
from tumble.procedures.redundancy.result import SecondaryError
from tumble.report.parameters import ParameterGroup, printed_group

HIDDEN = "the motion did not show it"
NO_AXIS = "the unit, or the primary, lacks the axis"
HIDDEN_IN_PART = "the motion did not show all of M that it depends on"

_AXES = ("x", "y", "z")


def error_groups(error: SecondaryError) -> tuple[ParameterGroup, ...]:
    """Prints the error of one sensor. The elements of M count as independent of each other."""
    # An error from outside may leave a bias open for any reason.
    why = NO_AXIS if error.sequence else HIDDEN
    parameters: dict[str, list[Parameter]] = {
        "bias": _three("bias", UNITS[error.sensor], error.bias, error.bias_sigma, why),
        **_of_matrix(error),
    }
    if error.lever_arm is not None:
        sigma = np.full(3, math.inf) if error.lever_arm_sigma is None else error.lever_arm_sigma
        parameters["lever arm"] = _three("lever arm", "m", error.lever_arm, sigma, HIDDEN)
    return tuple(printed_group(_title(kind), found, [None] * 3) for kind, found in parameters.items())


def _title(kind: str) -> str:
    return "scale error" if kind == "scale" else kind


def _of_matrix(error: SecondaryError) -> dict[str, list[Parameter]]:
    variance = np.where(np.isfinite(error.matrix_sigma), error.matrix_sigma, np.nan).ravel() ** 2
    scale = np.linalg.norm(error.matrix, axis=1)
    # A row of zeros is a sensor that measures nothing: it has no direction, and so no angles.
    if not np.all(np.isfinite(error.matrix)) or np.linalg.matrix_rank(error.matrix) < 3:
        nothing = np.full(9, np.nan)
        return _matrix_parameters(nothing, nothing)
    angles = np.degrees(non_orthogonality(error.matrix))
    mounting = mounting_angles(factors(error.matrix)[2])
    sigma = factor_sigma(error.matrix, np.diag(variance))
    sigma[3:] = np.degrees(sigma[3:])
    return _matrix_parameters(np.concatenate([scale, angles, mounting]), sigma)


def _matrix_parameters(values: FloatArray, sigma: FloatArray) -> dict[str, list[Parameter]]:
    return {
        "scale": _three("scale", "1", values[:3], sigma[:3], HIDDEN_IN_PART),
        "non-orthogonality": _three(
            "non-orthogonality", "deg", values[3:6], sigma[3:6], HIDDEN_IN_PART, PAIRS
        ),
        "mounting": _three("mounting", "deg", values[6:], sigma[6:], HIDDEN_IN_PART),
    }


def _three(
    name: str, unit: str, values: FloatArray, sigmas: FloatArray, reason: str, endings: Iterable[str] = _AXES
) -> list[Parameter]:
    return [
        _parameter(f"{name} {ending}", unit, float(value), float(sigma), reason)
        for ending, value, sigma in zip(endings, values, sigmas, strict=True)
    ]


def _parameter(name: str, unit: str, value: float, sigma: float, reason: str) -> Parameter:
    if not (math.isfinite(value) and math.isfinite(sigma)):
        return Parameter(name, unit, 0.0, math.inf, -math.inf, math.inf, observable=False, reason=reason)
    half = INTERVAL * sigma
    return Parameter(name, unit, value, sigma, value - half, value + half)
