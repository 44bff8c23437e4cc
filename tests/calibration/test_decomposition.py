"""Sigmas of scale, non-orthogonality and mounting: derivatives of the decomposition."""

import numpy as np
import pytest

from tumble import _core
from tumble.foundation.error_decomposition import factors, non_orthogonality, turn_jacobian

STEP = 1e-6


def parameters(matrix, around):
    """(9,) scales, non-orthogonalities, and the turn of the mounting from that of `around`, rad."""
    turned = _core.rotation_vector(np.ascontiguousarray(factors(matrix)[2] @ factors(around)[2].T))
    return np.concatenate([np.linalg.norm(matrix, axis=1), non_orthogonality(matrix), turned])


@pytest.mark.parametrize("seed", range(20))
def test_derivatives_are_those_of_the_decomposition(seed):
    generator = np.random.default_rng(seed)
    print(f"seed {seed}")
    matrix = np.eye(3) + generator.normal(0.0, 0.2, (3, 3))
    # An axis that hardly responds has a small scale; its angles then change by large factors.
    weak = np.where(generator.uniform(size=3) < 0.5, 1e-5, 1.0)
    matrix *= weak[:, None]
    steps = STEP * weak.repeat(3)[:, None] * np.eye(9)
    numeric = [
        (parameters(matrix + step.reshape(3, 3), matrix) - parameters(matrix - step.reshape(3, 3), matrix))
        / (2.0 * step.sum())
        for step in steps
    ]
    found = turn_jacobian(matrix) * weak.repeat(3)
    assert np.allclose(found, np.array(numeric).T * weak.repeat(3), rtol=1e-6, atol=1e-8)
