"""Formulas shared by tests of docs/theory: rotations, non-orthogonality, the mean of a logarithm."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

SEED = 20_250_117
PAIRS = ((0, 1), (1, 2), (2, 0))


def seeded():
    """Random numbers, and their seed on the screen."""
    print(f"seed {SEED}")
    return np.random.default_rng(SEED)


def cross(v):
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def rotation(v):
    """Rodrigues' formula, with coefficients that hold at zero."""
    angle = np.linalg.norm(v)
    k = cross(v)
    return np.eye(3) + np.sinc(angle / np.pi) * k + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * k @ k


def rotation_vector(r):
    twice_sine = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    angle = np.arctan2(np.linalg.norm(twice_sine), np.trace(r) - 1)
    return 0.5 * twice_sine / np.sinc(angle / np.pi)


def non_orthogonality(m):
    s = m / np.linalg.norm(m, axis=1)[:, None]
    return np.array([np.arcsin(s[i] @ s[j]) for i, j in PAIRS])


def numeric(function, x, step=1e-6):
    columns = [
        (function(x + step * unit) - function(x - step * unit)) / (2 * step)
        for unit in np.eye(x.size).reshape(-1, *x.shape)
    ]
    return np.array(columns).T


def second_antiderivative(x):
    """F of noise.md: its second derivative is ln |x|."""
    x = np.abs(x)
    return 0.0 if x == 0 else 0.5 * x**2 * np.log(x) - 0.75 * x**2


def mean_log(a, b):
    """Equation 3 of noise.md."""
    f = second_antiderivative
    second_difference = f(b[1] - a[0]) - f(b[1] - a[1]) - f(b[0] - a[0]) + f(b[0] - a[1])
    return second_difference / ((a[1] - a[0]) * (b[1] - b[0]))


def neighbours(edges):
    """Intervals from edge to edge."""
    return list(pairwise(edges))
