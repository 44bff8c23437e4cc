"""Equations of docs/theory/model.md and noise.md, held against exact expressions and numeric derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from theory_formulas import (
    PAIRS,
    cross,
    mean_log,
    neighbours,
    non_orthogonality,
    numeric,
    rotation,
    rotation_vector,
    seeded,
)


@pytest.fixture
def random():
    return seeded()


def decompose(m):
    """Equation 3 of model.md: scale, L, Q."""
    k = np.linalg.norm(m, axis=1)
    s = m / k[:, None]
    q1 = s[0]
    l21 = s[1] @ q1
    across = s[1] - l21 * q1
    l22 = np.linalg.norm(across)
    q2 = across / l22
    q3 = np.cross(q1, q2)
    lower = np.array([[1, 0, 0], [l21, l22, 0], [s[2] @ q1, s[2] @ q2, s[2] @ q3]])
    return k, lower, np.array([q1, q2, q3])


def as_read(m):
    """Scales, non-orthogonality, mounting: nine numbers."""
    k, _, q = decompose(m)
    return np.concatenate([k, non_orthogonality(m), rotation_vector(q)])


def jacobian(m):
    """Equations 5 to 8 of model.md."""
    k, lower, q = decompose(m)
    s = m / k[:, None]
    turn = [(np.eye(3) - np.outer(s[i], s[i])) / k[i] for i in range(3)]
    j = np.zeros((9, 9))
    for i in range(3):
        j[i, 3 * i : 3 * i + 3] = s[i]
    for row, (a, b) in enumerate(PAIRS):
        cosine = np.sqrt(1 - (s[a] @ s[b]) ** 2)
        j[3 + row, 3 * a : 3 * a + 3] = turn[a] @ s[b] / cosine
        j[3 + row, 3 * b : 3 * b + 3] = turn[b] @ s[a] / cosine
    omega = np.zeros((3, 9))  # omega_23, omega_13, omega_12
    omega[2, :3], omega[1, :3] = turn[0] @ q[1], turn[0] @ q[2]
    omega[0, 3:6] = turn[1] @ q[2] / lower[1, 1]
    omega[0] -= lower[1, 0] / lower[1, 1] * omega[1]
    phi = rotation_vector(q)
    angle = np.linalg.norm(phi)
    factor = (1 - angle / 2 / np.tan(angle / 2)) / angle**2
    inverse_left = np.eye(3) - 0.5 * cross(phi) + factor * cross(phi) @ cross(phi)
    j[6:] = -inverse_left @ (np.array([1, -1, 1])[:, None] * omega)
    return j


def random_matrix(random):
    return (
        np.diag(random.uniform(0.5, 2, 3))
        @ (np.eye(3) + random.uniform(-0.2, 0.2, (3, 3)))
        @ rotation(random.normal(0, 0.8, 3))
    )


def test_scale_non_orthogonality_and_mounting_multiply_to_the_matrix(random):
    for _ in range(100):
        m = random_matrix(random)
        k, lower, q = decompose(m)
        assert np.abs(np.diag(k) @ lower @ q - m).max() < 1e-14
        assert np.abs(q @ q.T - np.eye(3)).max() < 1e-14
        assert np.linalg.det(q) == pytest.approx(1)
        assert np.linalg.norm(lower, axis=1) == pytest.approx([1, 1, 1])


def test_the_jacobian_of_the_numbers_people_read_is_the_numeric_one(random):
    for _ in range(100):
        m = random_matrix(random)
        found = numeric(lambda x: as_read(x.reshape(3, 3)), m.ravel())
        assert np.abs(jacobian(m) - found).max() < 1e-7


def flicker_covariance(intervals, session):
    """Equation 4 of noise.md for N = 0, B = 1."""
    of_session = np.array([mean_log(a, session) for a in intervals])
    between = np.array([[mean_log(a, b) for b in intervals] for a in intervals])
    return -(between - of_session[:, None] - of_session + mean_log(session, session)) / np.pi


@pytest.mark.parametrize("tau", [1e-3, 1.0, 40.0])
def test_generalised_covariance_gives_flicker_noise_its_allan_floor(tau):
    intervals = [(5.0, 5.0 + tau), (5.0 + tau, 5.0 + 2 * tau)]
    same = -mean_log(intervals[0], intervals[0]) / np.pi
    next_to_it = -mean_log(intervals[0], intervals[1]) / np.pi
    assert same - next_to_it == pytest.approx(2 * np.log(2) / np.pi, rel=1e-6)


def test_the_mean_of_the_logarithm_is_its_second_difference():
    nodes, weights = np.polynomial.legendre.leggauss(60)
    a, b = (1.0, 3.5), (4.0, 9.0)
    s = a[0] + (a[1] - a[0]) * (nodes + 1) / 2
    t = b[0] + (b[1] - b[0]) * (nodes + 1) / 2
    by_quadrature = weights @ np.log(t[None, :] - s[:, None]) @ weights / 4
    assert mean_log(a, b) == pytest.approx(by_quadrature, rel=1e-12)


def test_deviations_from_the_session_mean_cancel_in_their_covariance(random):
    edges = np.concatenate([[0.0], np.cumsum(random.uniform(1, 20, 12))])
    intervals = neighbours(edges)
    covariance = flicker_covariance(intervals, (0.0, edges[-1]))
    lengths = np.diff(edges)
    assert np.linalg.eigvalsh(covariance)[0] > -1e-12
    assert np.abs(covariance @ lengths).max() < 1e-10


def test_pairs_of_the_allan_ladder_are_independent_for_white_noise():
    """Every octave is a row of the Haar transform: the rows are orthogonal."""
    octaves = []
    means = np.eye(16)
    while len(means) > 1:
        octaves.append(means[1::2] - means[::2])
        means = (means[1::2] + means[::2]) / 2
    haar = np.vstack(octaves)
    gram = haar @ haar.T
    assert np.abs(gram - np.diag(np.diag(gram))).max() < 1e-15


def test_merged_moments_are_those_of_all_samples(random):
    x, y = random.normal(3, 1, 17), random.normal(-2, 5, 40)
    whole = np.concatenate([x, y])
    n, m = len(x), len(y)
    apart = y.mean() - x.mean()
    mean = x.mean() + apart * m / (n + m)
    squares = x.var() * n + y.var() * m + apart**2 * n * m / (n + m)
    assert mean == pytest.approx(whole.mean())
    assert squares == pytest.approx(whole.var() * (n + m))
