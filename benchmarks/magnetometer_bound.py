"""The Cramér-Rao bound of a magnetometer by the Earth's field, in numpy, independent of the core.

Each rest has an attitude that nobody knows, three angles, beside the unknowns of both triads and the dip. The
information of the six mean readings is summed over rests, less that of the attitudes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray
from tumble.tools.simulate import SimulatedMagnetometer
from tumble.tools.simulate.magnetometer.procedure import FORCE_NOISE

PAIRS = ((0, 1), (1, 2), (2, 0))
_LOWER = np.tril_indices(3)


def values(matrix: FloatArray, bias: FloatArray) -> FloatArray:
    """(12,) bias, scale, non-orthogonality and mounting of M and b, angles in rad."""
    scale = np.linalg.norm(matrix, axis=1)
    axes = matrix / scale[:, None]
    angles = [np.arcsin(axes[i] @ axes[j]) for i, j in PAIRS]
    turned, lower = np.linalg.qr(axes.T)
    rotation = (turned * np.sign(np.diag(lower))).T
    return np.concatenate([bias, scale, angles, _rotation_vector(rotation)])


def rest_bound(played: SimulatedMagnetometer) -> tuple[FloatArray, FloatArray]:
    """(13,) truth and least sigma of the parameters of the magnetometer and of the dip, rad."""
    scenario = played.scenario
    (force_M, force_b), (M, b) = played.force_model, played.model
    dip = np.radians(scenario.dip)
    truth = np.concatenate([M.ravel(), b, [dip], force_M[_LOWER], force_b])
    samples = round(scenario.still * scenario.rate)
    weight = np.repeat([samples / FORCE_NOISE**2, samples / scenario.noise**2], 3)

    def readings(x: FloatArray, attitude: FloatArray, turn: FloatArray) -> FloatArray:
        matrix = np.zeros((3, 3))
        matrix[_LOWER] = x[13:19]
        up = attitude @ np.array([0.0, 0.0, STANDARD_GRAVITY])
        field = attitude @ (scenario.strength * np.array([np.cos(x[12]), 0.0, -np.sin(x[12])]))
        force, field = (vector + np.cross(turn, vector) for vector in (up, field))
        return np.concatenate([matrix @ force + x[19:], x[:9].reshape(3, 3) @ field + x[9:12]])

    information = np.zeros((22, 22))
    for quaternion in played.attitudes:
        attitude = _matrix(quaternion)
        by_truth = jacobian(lambda x, a=attitude: readings(x, a, np.zeros(3)), truth)  # type: ignore[misc]
        by_turn = jacobian(lambda turn, a=attitude: readings(truth, a, turn), np.zeros(3))  # type: ignore[misc]
        information += without(by_truth, by_turn, weight)
    covariance = np.linalg.inv(information)[:13, :13]

    def shown(x: FloatArray) -> FloatArray:
        return np.append(values(x[:9].reshape(3, 3), x[9:12]), x[12])

    by_state = jacobian(shown, truth[:13])
    return shown(truth[:13]), np.sqrt(np.diag(by_state @ covariance @ by_state.T))


def turned_bound(played: SimulatedMagnetometer) -> tuple[FloatArray, FloatArray]:
    """(9,) truth and least sigma of bias, scale and non-orthogonality, by all samples."""
    scenario = played.scenario
    M, b = played.model
    scale = np.linalg.norm(M, axis=1)
    turned, lower = np.linalg.qr((M / scale[:, None]).T)
    sign = np.sign(np.diag(lower))
    # Both frames differ by a rotation, which no length shows.
    lower_M = M @ (turned * sign)
    track = played.track
    fields = np.linalg.solve(M, (track.field - b).T).T
    lengths = np.linalg.norm(fields, axis=1)
    directions = fields / lengths[:, None]
    own = directions @ (turned * sign) * scenario.strength
    responses = np.linalg.solve(lower_M.T, own.T).T / scenario.strength
    rows = np.hstack([-(responses[:, :, None] * own[:, None, :])[:, _LOWER[0], _LOWER[1]], -responses])
    sigma = scenario.noise * np.linalg.norm(responses, axis=1)
    covariance = np.linalg.inv((rows / sigma[:, None]).T @ (rows / sigma[:, None]))

    def shown(x: FloatArray) -> FloatArray:
        matrix = np.zeros((3, 3))
        matrix[_LOWER] = x[:6]
        return values(matrix, x[6:])[:9]

    x = np.concatenate([lower_M[_LOWER], b])
    by_state = jacobian(shown, x)
    return shown(x), np.sqrt(np.diag(by_state @ covariance @ by_state.T))


def without(by_truth: FloatArray, by_turn: FloatArray, weight: FloatArray) -> FloatArray:
    """Information of readings on the truth, less what the attitude takes (Schur)."""
    whole = by_truth.T * weight
    cross = whole @ by_turn
    return np.asarray(whole @ by_truth - cross @ np.linalg.solve((by_turn.T * weight) @ by_turn, cross.T))


def jacobian(function: Callable[[FloatArray], FloatArray], x: FloatArray) -> FloatArray:
    """Returns the derivatives of a function at x, a column for each element, by central differences."""
    steps = 1e-6 * np.maximum(np.abs(x), 1.0)
    columns = [
        (function(x + step * row) - function(x - step * row)) / (2.0 * step)
        for step, row in zip(steps, np.eye(len(x)), strict=True)
    ]
    return np.column_stack(columns)


def _matrix(quaternion: FloatArray) -> FloatArray:
    w, x, y, z = quaternion
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def _rotation_vector(rotation: FloatArray) -> FloatArray:
    angle = np.arccos(np.clip(0.5 * (np.trace(rotation) - 1.0), -1.0, 1.0))
    axis = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    return np.asarray(axis * (0.5 if angle < 1e-9 else 0.5 * angle / np.sin(angle)))
