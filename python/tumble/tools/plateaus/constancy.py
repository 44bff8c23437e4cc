"""Tests whether the angles of a triad are constant over temperature (docs/theory/plateaus.md, eq. 9)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from tumble import _core
from tumble.foundation.error_decomposition import turn_jacobian
from tumble.foundation.recording import FloatArray
from tumble.tools.plateaus.observation import MATRIX, Observation
from tumble.tools.plateaus.result import Constancy

_LEAST_RANK = 1e-9
"""Smallest eigenvalue of the correlation of three angles: less is rounding."""
_GROUPS = (("non-orthogonality", slice(3, 6)), ("mounting", slice(6, 9)))


def constancies(observations: Sequence[Observation], matrix: FloatArray) -> Iterator[Constancy]:
    """Tests the angles of each kind about those of M (3, 3), where all sessions show M."""
    if not all(each.shown[MATRIX].all() for each in observations):
        return
    jacobian = turn_jacobian(matrix)
    t = np.array([each.temperature for each in observations])
    # Scale may change: rows of each M are brought to the lengths of those of `matrix`.
    lengths = np.linalg.norm(matrix, axis=1)
    turned = [_brought_to(each.values[MATRIX].reshape(3, 3), lengths) for each in observations]
    for name, place in _GROUPS:
        rows = jacobian[place]
        values = np.degrees([rows @ (each - matrix).ravel() for each in turned])
        spreads = np.degrees(
            np.degrees([rows @ each.covariance[MATRIX, MATRIX] @ rows.T for each in observations])
        )
        if all(_is_known(each) for each in spreads):
            yield _tested(name, t, values, spreads)


def _is_known(spread: FloatArray) -> bool:
    """Returns whether a covariance (3, 3) is one of three angles: a mounting that makes a frame has none."""
    variance = np.diag(spread)
    if not (variance > 0.0).all():
        return False
    correlation = spread / np.sqrt(np.outer(variance, variance))
    return bool(np.linalg.eigvalsh(correlation)[0] > _LEAST_RANK)


def _brought_to(matrix: FloatArray, lengths: FloatArray) -> FloatArray:
    return np.asarray(matrix * (lengths / np.linalg.norm(matrix, axis=1))[:, None])


def _tested(name: str, t: FloatArray, values: FloatArray, spreads: FloatArray) -> Constancy:
    """Tests values (n, 3), deg, with covariances (n, 3, 3)."""
    weights = np.linalg.inv(spreads)
    mean = np.linalg.solve(weights.sum(axis=0), np.einsum("nij,nj->i", weights, values))
    left = values - mean
    chi_square = float(np.einsum("ni,nij,nj->", left, weights, left))
    freedom = 3 * (len(t) - 1)
    # A straight line of each angle, with x from 0 at one end of the range to 1 at the other.
    x = (t - t.min()) / np.ptp(t)
    design = np.array([np.hstack([np.eye(3), each * np.eye(3)]) for each in x])
    normal = np.einsum("nki,nkl,nlj->ij", design, weights, design)
    line = np.linalg.solve(normal, np.einsum("nki,nkl,nl->i", design, weights, values))
    sigma = np.sqrt(np.diag(np.linalg.inv(normal)))
    return Constancy(
        group=name,
        change=line[3:],
        sigma=sigma[3:],
        chi_square=chi_square,
        degrees_of_freedom=freedom,
        probability=_core.chi_square_tail(chi_square, float(freedom)),
    )
