"""The Cramer-Rao bound of a turntable session, from true values, in numpy alone: nothing of the core is used.

Data are means over the true intervals, `y = M u + b + n` for the target and `r = u + b_r + n_r` for the
reference; b and b_r are mean biases over the recording, n and n_r what remains, its covariance that of
`noise.py`. The bound is the inverse of the Fisher information `J^T C^-1 J`, nuisance unknowns included,
carried over to bias, scale, non-orthogonality and mounting by a numeric Jacobian.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from tumble.foundation.recording import FloatArray

EARTH_RATE = 7.292115e-5
"""rad/s (WGS 84)."""

PARAMETERS = tuple(
    f"{group} {axis}"
    for group, axes in (
        ("bias", ("x", "y", "z")),
        ("scale", ("x", "y", "z")),
        ("non-orthogonality", ("xy", "yz", "zx")),
        ("mounting", ("x", "y", "z")),
    )
    for axis in axes
)
GROUPS = ("bias", "scale", "non-orthogonality", "mounting")
TRIADS = ("accelerometer", "gyroscope")


@dataclass(frozen=True, slots=True)
class Bound:
    """Cramér-Rao bound, and the linear estimate that reaches it."""

    sigma: FloatArray
    """(12,) of bias, scale, non-orthogonality and mounting, SI and rad."""
    gain: FloatArray
    """(12, data): error of the efficient estimate, to first order, for a given noise of the data."""


@dataclass(frozen=True, slots=True)
class NoiseCovariance:
    """Covariance of the means over the intervals, one axis, less the mean over the recording."""

    reference: FloatArray
    """(k, k)."""
    target: FloatArray
    """(k, k)."""


def parts(matrix: FloatArray, bias: FloatArray) -> FloatArray:
    """(12,) bias, scale, non-orthogonality `asin(s_i . s_j)` of xy, yz, zx, rotation vector of mounting."""
    scale = np.linalg.norm(matrix, axis=1)
    axes = matrix / scale[:, None]
    orthogonal, triangular = np.linalg.qr(axes.T)
    rotation = (orthogonal * np.sign(np.diag(triangular))).T
    sines = np.array([axes[0] @ axes[1], axes[1] @ axes[2], axes[2] @ axes[0]])
    return np.concatenate([bias, scale, np.arcsin(sines), Rotation.from_matrix(rotation).as_rotvec()])


def _jacobian_of_parts(matrix: FloatArray, bias: FloatArray) -> FloatArray:
    """(12, 12) of `parts` by [M row by row, b], by central differences."""
    x = np.concatenate([matrix.ravel(), bias])
    step = 1e-6
    columns = []
    for i in range(12):
        change = np.zeros(12)
        change[i] = step
        ahead, behind = x + change, x - change
        difference = parts(ahead[:9].reshape(3, 3), ahead[9:]) - parts(behind[:9].reshape(3, 3), behind[9:])
        columns.append(difference / (2 * step))
    jacobian: FloatArray = np.array(columns).T
    return jacobian


def _solve(
    jacobian: FloatArray,
    covariance: NoiseCovariance,
    prior: FloatArray,
    matrix: FloatArray,
    bias: FloatArray,
) -> Bound:
    """Inverts the information; `prior` is the information on each unknown beforehand, M and b come first."""
    precision = block_diag(
        np.kron(np.linalg.inv(covariance.reference), np.eye(3)),
        np.kron(np.linalg.inv(covariance.target), np.eye(3)),
    )
    weighted = jacobian.T @ precision
    # Unknowns of the same size: what is inverted are angles and numbers near one beside rates of the Earth.
    information = weighted @ jacobian + np.diag(prior)
    unit = 1.0 / np.sqrt(np.diag(information))
    inverse = unit[:, None] * np.linalg.inv(information * np.outer(unit, unit)) * unit
    to_parts = _jacobian_of_parts(matrix, bias)
    spread = to_parts @ inverse[:12, :12] @ to_parts.T
    return Bound(np.sqrt(np.diag(spread)), to_parts @ (inverse @ weighted)[:12])


def _by_matrix_and_bias(u: FloatArray) -> FloatArray:
    """(3, 12) of `M u + b` by [M row by row, b]."""
    return np.hstack([np.kron(np.eye(3), u), np.eye(3)])


def accelerometer_bound(
    matrix: FloatArray, bias: FloatArray, forces: FloatArray, covariance: NoiseCovariance
) -> Bound:
    """Rests of true specific force `forces` (k, 3), length known: unknown are M, b, b_r and k directions."""
    rests = len(forces)
    columns = 15 + 2 * rests
    reference = np.zeros((3 * rests, columns))
    target = np.zeros((3 * rests, columns))
    for k, force in enumerate(forces):
        rows, own = slice(3 * k, 3 * k + 3), slice(15 + 2 * k, 17 + 2 * k)
        # The last two right singular vectors span the plane across the force: length is g and known.
        across = np.linalg.svd(force[None])[2][1:].T * np.linalg.norm(force)
        reference[rows, 12:15] = np.eye(3)
        reference[rows, own] = across
        target[rows, :12] = _by_matrix_and_bias(force)
        target[rows, own] = matrix @ across
    return _solve(np.vstack([reference, target]), covariance, np.zeros(columns), matrix, bias)


def gyroscope_bound(
    matrix: FloatArray,
    bias: FloatArray,
    attitudes: FloatArray,
    earth_rate: FloatArray,
    turn_rates: FloatArray,
    stretch: FloatArray,
    covariance: NoiseCovariance,
) -> Bound:
    """Rests and turns: unknown are M, b, b_r, the Earth's rate at the first rest, the mean rate of each turn.

    `attitudes` (k, 3, 3): case frame at rest k from that at the first; `turn_rates` (j, 3) rad/s true means;
    `stretch` (j,): samples of the reference cover this much more time than those of the target.
    Intervals come in this order: all rests, all turns. The Earth's rate has an isotropic prior.
    """
    rests, turns = len(attitudes), len(turn_rates)
    columns = 18 + 3 * turns
    reference = np.zeros((3 * (rests + turns), columns))
    target = np.zeros_like(reference)
    reference[:, 12:15] = np.tile(np.eye(3), (rests + turns, 1))
    for k, attitude in enumerate(attitudes):
        rows = slice(3 * k, 3 * k + 3)
        reference[rows, 15:18] = attitude
        target[rows, :12] = _by_matrix_and_bias(attitude @ earth_rate)
        target[rows, 15:18] = matrix @ attitude
    for j, rate in enumerate(turn_rates):
        rows, own = slice(3 * (rests + j), 3 * (rests + j) + 3), slice(18 + 3 * j, 21 + 3 * j)
        reference[rows, own] = np.eye(3)
        target[rows, :12] = _by_matrix_and_bias(stretch[j] * rate)
        target[rows, own] = stretch[j] * matrix
    prior = np.zeros(columns)
    prior[15:18] = 3.0 / EARTH_RATE**2
    return _solve(np.vstack([reference, target]), covariance, prior, matrix, bias)


def attitudes_of(forces: FloatArray, earth_rates: FloatArray) -> FloatArray:
    """(k, 3, 3) case frame at rest k from that at the first, by true force and true rate of the Earth."""

    def frame(force: FloatArray, rate: FloatArray) -> FloatArray:
        east = np.cross(rate, force)
        basis = np.array([force, east, np.cross(force, east)])
        axes: FloatArray = (basis / np.linalg.norm(basis, axis=1)[:, None]).T
        return axes

    first = frame(forces[0], earth_rates[0])
    return np.array([frame(f, w) @ first.T for f, w in zip(forces, earth_rates, strict=True)])
