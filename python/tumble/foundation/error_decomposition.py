"""Scale, non-orthogonality and mounting in a matrix M of three sensors, with their sigmas.

`M = K L Q` as in docs/conventions.md: K diagonal scale, L lower triangular with unit rows, Q a rotation.
"""

from __future__ import annotations

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray

PAIRS = ("xy", "yz", "zx")
"""Axes between which the three non-orthogonalities are."""

_STEP = 1e-6
"""Change of an element of M over which derivatives are taken."""
_NO_EFFECT = 1e-6
"""Derivative below which the uncertainty of one number does not affect another."""


def factors(matrix: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """K, L and Q of M = K L Q, by the QR decomposition of M^T."""
    Q, R = np.linalg.qr(matrix.T)
    signs = np.sign(np.diag(R))
    lower = R.T * signs
    scale = np.linalg.norm(lower, axis=1)
    # Adding zero turns -0.0, which a file would show, into 0.0.
    return np.diag(scale), lower / scale[:, None] + 0.0, signs[:, None] * Q.T + 0.0


def non_orthogonality(matrix: FloatArray) -> FloatArray:
    """(3,) of xy, yz and zx, rad: asin(s_i . s_j) of the unit sensing axes."""
    x, y, z = matrix / np.linalg.norm(matrix, axis=1)[:, None]
    angles: FloatArray = np.arcsin([x @ y, y @ z, z @ x])
    return angles


def mounting_angles(Q: FloatArray) -> FloatArray:
    """(3,) rotation vector of the mounting, deg."""
    return np.degrees(_core.rotation_vector(np.ascontiguousarray(Q))) + 0.0


def factor_sigma(matrix: FloatArray, covariance: FloatArray) -> FloatArray:
    """(9,) 1-sigma of three scales, three non-orthogonalities and the rotation vector of the mounting, rad.

    `covariance` (9, 9) is that of M row by row; what depends on something not finite there is NaN.
    """
    sigma: FloatArray = np.sqrt(np.diag(propagated(factor_jacobian(matrix), covariance)))
    return sigma


def factor_jacobian(matrix: FloatArray) -> FloatArray:
    """(9, 9) derivatives of the numbers of `factor_sigma` by M row by row (model.md, eq. 5 to 8)."""
    found = turn_jacobian(matrix)
    vector = _core.rotation_vector(np.ascontiguousarray(factors(matrix)[2]))
    found[6:] = _core.inverse_left_jacobian(vector) @ found[6:]  # eq. 8
    return found


def turn_jacobian(matrix: FloatArray) -> FloatArray:
    """(9, 9) as `factor_jacobian`, with a small turn of the mounting, rad, for its rotation vector."""
    steps = _STEP * np.eye(9).reshape(9, 3, 3)
    derivatives = [
        (_factor_parameters(matrix + step, matrix) - _factor_parameters(matrix - step, matrix))
        / (2.0 * _STEP)
        for step in steps
    ]
    found: FloatArray = np.array(derivatives).T
    return found


def propagated(jacobian: FloatArray, covariance: FloatArray) -> FloatArray:
    """J C J^T; what depends on something unknown is NaN, what does not stays known."""
    known = np.isfinite(np.diag(covariance))
    inner = np.where(np.outer(known, known), covariance, 0.0)
    found: FloatArray = jacobian @ np.nan_to_num(inner) @ jacobian.T
    lost = (np.abs(jacobian[:, ~known]) > _NO_EFFECT).any(axis=1)
    found[lost, :] = np.nan
    found[:, lost] = np.nan
    return found


def _factor_parameters(matrix: FloatArray, around: FloatArray) -> FloatArray:
    """(9,) scales, non-orthogonalities and the turn of the mounting from that of `around`, rad."""
    _, _, Q = factors(matrix)
    _, _, Q_around = factors(around)
    turned = _core.rotation_vector(Q @ Q_around.T)
    return np.concatenate([np.linalg.norm(matrix, axis=1), non_orthogonality(matrix), turned])
