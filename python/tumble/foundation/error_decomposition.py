"""Scale, non-orthogonality and mounting in a matrix M of three sensors, with their sigmas.

`M = K L Q` as in docs/conventions.md: K diagonal scale, L lower triangular with unit rows, Q a rotation.
"""

from __future__ import annotations

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray

PAIRS = ("xy", "yz", "zx")
"""Axes between which the three non-orthogonalities are."""

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
    scale, lower, Q = factors(matrix)
    axes = lower @ Q
    turned = (np.eye(3) - axes[:, :, None] * axes[:, None, :]) / np.diag(scale)[:, None, None]  # eq. 5: ds
    found: FloatArray = np.zeros((3, 3, 3, 3))
    of_scale, of_angles, of_mounting = found
    for i, axis in enumerate(axes):
        of_scale[i, i] = axis  # eq. 5: dk
    for angle, (i, j) in zip(of_angles, ((0, 1), (1, 2), (2, 0)), strict=True):
        cosine = np.sqrt(1.0 - (axes[i] @ axes[j]) ** 2)
        angle[i], angle[j] = turned[i] @ axes[j] / cosine, turned[j] @ axes[i] / cosine  # eq. 6
    (l21, l22), (_, q2, q3) = lower[1, :2], Q
    omega_12, omega_13 = turned[0] @ q2, turned[0] @ q3  # eq. 7
    of_mounting[0, 0], of_mounting[0, 1] = omega_13 * (l21 / l22), -turned[1] @ q3 / l22  # eq. 7: -Omega_23
    of_mounting[1, 0], of_mounting[2, 0] = omega_13, -omega_12
    return found.reshape(9, 9)


def propagated(jacobian: FloatArray, covariance: FloatArray) -> FloatArray:
    """J C J^T; what depends on something unknown is NaN, what does not stays known."""
    known = np.isfinite(np.diag(covariance))
    inner = np.where(np.outer(known, known), covariance, 0.0)
    found: FloatArray = jacobian @ np.nan_to_num(inner) @ jacobian.T
    lost = (np.abs(jacobian[:, ~known]) > _NO_EFFECT).any(axis=1)
    found[lost, :] = np.nan
    found[:, lost] = np.nan
    return found
