"""Rotations and distributions of the core against scipy, which works them out in other ways."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import special
from scipy.spatial.transform import Rotation

from tumble import _core

CHANCE = st.floats(1e-6, 1.0 - 1e-6)
LOG_FREEDOM = st.floats(0.0, 12.0)
ANGLE = st.floats(-1.8, 1.8)


@given(CHANCE, LOG_FREEDOM)
def test_chi_square(tail, log_freedom):
    freedom = int(np.exp(log_freedom))
    quantile = special.chdtri(freedom, tail)
    # A tail close to one holds what is left of one to a few of its last digits only, and so the quantile.
    rounding = 4.0 * np.finfo(float).eps / (1.0 - tail)
    assert _core.chi_square_quantile(tail, freedom) == pytest.approx(quantile, rel=1e-11 + rounding)
    assert _core.chi_square_tail(quantile, freedom) == pytest.approx(
        special.chdtrc(freedom, quantile), rel=1e-11
    )


@given(st.floats(-0.5, 20.0))
def test_students_t(log_freedom):
    freedom = float(np.exp(log_freedom))
    assert _core.student_quantile(0.975, freedom) == pytest.approx(special.stdtrit(freedom, 0.975), rel=1e-12)


@given(ANGLE, ANGLE, ANGLE, st.sampled_from([1.0, 1e-4, 1e-9]))
def test_rotations(x, y, z, size):
    vector = size * np.array([x, y, z])
    matrix = Rotation.from_rotvec(vector).as_matrix()
    assert _core.rotation_matrix(vector) == pytest.approx(matrix, abs=1e-14)
    # Matrices hold small turns only as differences from the identity.
    if np.linalg.norm(vector) < np.pi - 1e-3:
        assert _core.rotation_vector(matrix) == pytest.approx(vector, rel=1e-11, abs=1e-15)
