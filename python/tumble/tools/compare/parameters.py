"""Parameters of two calibrations, side by side: bias, scale, angles, g-sensitivity."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tumble import _core
from tumble.foundation.error_decomposition import (
    PAIRS,
    factors,
    non_orthogonality,
    propagated,
    turn_jacobian,
)
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import GROUPS
from tumble.foundation.units import CALIBRATED_TRIADS, CALIBRATED_UNITS, CalibratedTriad
from tumble.tools.compare.common import ACCELEROMETER, GYROSCOPE, MAGNETOMETER
from tumble.tools.compare.result import Difference
from tumble.tools.compare.unit import OF_A_TRIAD, PLACES, UnitModel

_AXES = ("x", "y", "z")
_MATRIX = slice(3, OF_A_TRIAD)
"""Elements of M among twelve parameters: scale, non-orthogonality, mounting."""
_MOUNTING = slice(9, OF_A_TRIAD)
_TO_DEGREES = np.repeat([1.0, np.degrees(1.0)], [6, 6])


@dataclass(frozen=True, slots=True)
class Differences:
    """Differences of the comparable parameters of two units, with their covariance."""

    rows: tuple[Difference, ...]
    covariance: FloatArray
    """(n, n) of the differences, in the units of the rows."""


def parameters_of(unit: UnitModel, triad: CalibratedTriad) -> FloatArray:
    """(12,) bias, scale, non-orthogonality and mounting; angles in deg."""
    matrix = unit.matrix(triad)
    Q = factors(matrix)[2]
    angles = np.concatenate([non_orthogonality(matrix), _core.rotation_vector(np.ascontiguousarray(Q))])
    return np.concatenate([unit.bias(triad), np.linalg.norm(matrix, axis=1), np.degrees(angles)])


def parameter_covariance(unit: UnitModel) -> FloatArray:
    """(36, 36) covariance of the parameters of all triads, eq. 5; the mounting's is that of a small turn."""
    jacobian = np.zeros(unit.covariance.shape)
    for triad, place in PLACES.items():
        block = np.zeros((OF_A_TRIAD, OF_A_TRIAD))
        block[:3, 9:] = np.eye(3)
        block[_MATRIX, :9] = turn_jacobian(unit.matrix(triad))
        jacobian[place, place] = _TO_DEGREES[:, None] * block
    return propagated(jacobian, unit.covariance)


def parameter_names(triad: CalibratedTriad) -> list[tuple[str, str]]:
    """Names and unit of the twelve parameters of a triad."""
    units = (CALIBRATED_UNITS[triad], "1", "deg", "deg")
    return [
        (f"{triad} {group} {axis}", unit)
        for group, unit in zip(GROUPS, units, strict=True)
        for axis in (PAIRS if group == "non-orthogonality" else _AXES)
    ]


def differences(first: UnitModel, second: UnitModel, own_axes: bool) -> Differences:
    """Compares two units, in one frame and at one temperature, with each other."""
    covariances = parameter_covariance(first), parameter_covariance(second)
    covariance = covariances[0] + covariances[1]
    seen = [np.isfinite(np.diag(each)) for each in covariances]
    rows: list[Difference] = []
    places: list[int] = []
    for triad in CALIBRATED_TRIADS:
        if first.says_nothing_of(triad) or second.says_nothing_of(triad):
            continue
        found, reasons = _differences(first, second, triad), _reasons(first, second, triad)
        names, start = parameter_names(triad), PLACES[triad].start
        sigmas = np.sqrt(np.diag(covariance)[PLACES[triad]])
        pair = parameters_of(first, triad), parameters_of(second, triad)
        for k, (name, unit) in enumerate(names):
            # The frame of an accelerometer's own axes is where its mounting is none.
            if own_axes and triad == ACCELEROMETER and k >= _MOUNTING.start:
                continue
            unseen = [unit.label for unit, s in zip((first, second), seen, strict=True) if not s[start + k]]
            reason = reasons[k] or (f"not known in {' and '.join(unseen)}" if unseen else "")
            values = (float(pair[0][k]), float(pair[1][k]), float(found[k]))
            rows.append(Difference(name, unit, *values, sigma=float(sigmas[k]), reason=reason))
            places.append(start + k)
    joint = covariance[np.ix_(places, places)]
    responses = (*_responses(first, second), *_currents(first, second))
    whole = np.zeros((len(rows) + len(responses),) * 2)
    whole[: len(rows), : len(rows)] = joint
    whole[len(rows) :, len(rows) :] = np.diag([each.sigma**2 for each in responses])
    return Differences((*rows, *responses), whole)


def _differences(first: UnitModel, second: UnitModel, triad: CalibratedTriad) -> FloatArray:
    """(12,) second less first; of the mounting the turn from one to the other."""
    found = parameters_of(second, triad) - parameters_of(first, triad)
    turn = factors(second.matrix(triad))[2] @ factors(first.matrix(triad))[2].T
    found[_MOUNTING] = np.degrees(_core.rotation_vector(np.ascontiguousarray(turn)))
    return found


def _reasons(first: UnitModel, second: UnitModel, triad: CalibratedTriad) -> list[str]:
    """Describes why each of twelve parameters is unknown; empty where it is known."""
    if {triad} <= first.stated & second.stated:
        return ["neither states an uncertainty"] * OF_A_TRIAD
    reasons = [""] * OF_A_TRIAD
    if not first.stated | second.stated >= {triad}:
        taken_over = "taken over: stands in both alike"
        if np.array_equal(first.bias(triad), second.bias(triad)):
            reasons[: _MATRIX.start] = [taken_over] * _MATRIX.start
        if np.array_equal(first.matrix(triad), second.matrix(triad)):
            reasons[_MATRIX] = [taken_over] * (OF_A_TRIAD - _MATRIX.start)
    return reasons


def parameter_variance(unit: UnitModel) -> FloatArray:
    """(36,) variances of the parameters; NaN where one is not observable."""
    return np.diag(parameter_covariance(unit))


def _responses(first: UnitModel, second: UnitModel) -> Iterator[Difference]:
    """Compares the g-sensitivity, where both hold one."""
    if first.response is None or second.response is None:
        return
    sigma = np.hypot(first.response_sigma, second.response_sigma)
    for i, j in np.ndindex(3, 3):
        name = f"{GYROSCOPE} g-sensitivity {_AXES[i]}{_AXES[j]}"
        pair = float(first.response[i, j]), float(second.response[i, j])
        yield _alone(name, "rad/s per m/s^2", pair, float(sigma[i, j]))


def _currents(first: UnitModel, second: UnitModel) -> Iterator[Difference]:
    """Compares the effect of current, where both hold one of the same unit."""
    if first.current is None or second.current is None or first.current_unit != second.current_unit:
        return
    sigma = np.hypot(first.current_sigma, second.current_sigma)
    for k, axis in enumerate(_AXES):
        pair = float(first.current[k]), float(second.current[k])
        yield _alone(f"{MAGNETOMETER} current {axis}", first.current_unit, pair, float(sigma[k]))


def _alone(name: str, unit: str, values: tuple[float, float], sigma: float) -> Difference:
    """Compares a parameter whose errors are independent of those of all others."""
    reason = "" if np.isfinite(sigma) else "not observable in one of them"
    if sigma == 0.0:
        reason = "neither states an uncertainty"
    return Difference(name, unit, *values, values[1] - values[0], sigma, reason)
