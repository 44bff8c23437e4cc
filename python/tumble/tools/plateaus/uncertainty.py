"""Covariance of a fit, widened where sessions scatter by more than their sigmas (docs/theory/plateaus.md).

Switching a unit on changes its bias, and a fixture its mounting: each group of parameters is widened by
itself, so that one does not disturb the others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tumble import _core
from tumble.foundation.error_decomposition import factor_jacobian
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL
from tumble.tools.plateaus.fit import Fit
from tumble.tools.plateaus.observation import BIAS, ELEMENTS, MATRIX, Observation

UNLIKELY = 0.1
"""Chance of chi-square below which sigmas are widened; it is not small, as biases do wander."""
GROUPS: Mapping[str, slice] = {
    "scale": slice(0, 3),
    "non-orthogonality": slice(3, 6),
    "mounting": slice(6, 9),
    "bias": slice(9, 12),
}
"""Places among [scale, non-orthogonality, mounting, bias]."""


def widenings(found: Fit, observations: Sequence[Observation]) -> dict[str, float]:
    """Factors on the sigmas of each group, 1 where its scatter is that of its sigmas, eq. 8."""
    sums = dict.fromkeys(GROUPS, 0.0)
    freedoms = dict.fromkeys(GROUPS, 0.0)
    for each in observations:
        values, derivatives = found.at(each.temperature, each.leg)
        groups = _decomposition(values)
        left = each.values - values
        for name, place in GROUPS.items():
            rows = groups[place]
            if not each.shown[np.abs(rows).max(axis=0) > 0.0].all():
                continue
            own = rows @ np.nan_to_num(each.covariance) @ rows.T
            if not (np.diag(own) > 0.0).all():
                continue
            weight = np.linalg.pinv(own, hermitian=True)
            of_model = rows @ derivatives @ found.covariance @ derivatives.T @ rows.T
            sums[name] += float(left @ rows.T @ weight @ rows @ left)
            freedoms[name] += float(np.trace(weight @ (own - of_model)))
    return {name: _widening(sums[name], freedoms[name]) for name in GROUPS}


def _widening(chi_square: float, freedom: float) -> float:
    if freedom < 1.0 or _core.chi_square_tail(chi_square, freedom) > UNLIKELY:
        return 1.0
    # The scatter is itself known from few sessions.
    reach = _core.student_quantile(0.975, freedom) / INTERVAL
    return max(1.0, float(np.sqrt(chi_square / freedom) * reach))


def widened(found: Fit, factors: Mapping[str, float]) -> FloatArray:
    """Covariance of the solution with the sigmas of each group widened."""
    change = np.eye(len(found.solution))
    change[:ELEMENTS, :ELEMENTS] = _decomposition(found.solution)
    by_group = np.ones(len(found.solution))
    for name, place in GROUPS.items():
        by_group[place] = factors[name]
    for term, (part, _, _) in enumerate(found.terms.places(), start=ELEMENTS):
        by_group[term] = factors["scale" if part == "scale" else "bias"]
    whole = np.linalg.inv(change) @ np.diag(by_group) @ change
    return np.asarray(whole @ found.covariance @ whole.T)


def _decomposition(values: FloatArray) -> FloatArray:
    """(12, 12) derivatives of scale, non-orthogonality, mounting and bias by [M, b]."""
    jacobian = np.eye(ELEMENTS)
    jacobian[MATRIX, MATRIX] = factor_jacobian(values[MATRIX].reshape(3, 3))
    jacobian[BIAS, BIAS] = np.eye(3)
    return jacobian
