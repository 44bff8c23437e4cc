"""Equations of docs/theory/turntable.md, held against exact expressions and numeric derivatives."""

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

G = 9.80665
FACES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)


@pytest.fixture
def random():
    return seeded()


def mounting(to, start):
    """Equation 3 of turntable.md: rotation and offset."""
    s = (start - start.mean(0)).T @ (to - to.mean(0))
    n = np.zeros((4, 4))
    n[0, 0] = np.trace(s)
    n[0, 1:] = n[1:, 0] = s[1, 2] - s[2, 1], s[2, 0] - s[0, 2], s[0, 1] - s[1, 0]
    n[1:, 1:] = s + s.T - np.trace(s) * np.eye(3)
    w, *v = np.linalg.eigh(n)[1][:, -1]
    half_turn = cross(v)
    r = np.eye(3) + 2 * w * half_turn + 2 * half_turn @ half_turn
    return r, to.mean(0) - r @ start.mean(0)


def test_mounting_angle_is_that_of_the_singular_value_decomposition(random):
    ideal = G * FACES
    readings = ideal @ rotation(random.normal(0, 0.1, 3)).T + random.normal(0, 0.5, (6, 3))
    u, _, v_t = np.linalg.svd((readings - readings.mean(0)).T @ (ideal - ideal.mean(0)))
    found, bias = mounting(readings, ideal)
    assert np.abs(found - u @ np.diag([1, 1, np.linalg.det(u @ v_t)]) @ v_t).max() < 1e-12
    assert bias == pytest.approx(readings.mean(0))


def test_mounting_angle_follows_errors_as_its_normal_equations_state(random):
    true = rotation(random.normal(0, 0.03, 3))
    directions = random.normal(size=(9, 3))
    ideal = G * directions / np.linalg.norm(directions, axis=1)[:, None]
    errors = random.normal(0, 1e-6, ideal.shape)
    found, _ = mounting(ideal @ true.T + 0.2 + errors, ideal)
    a = (ideal - ideal.mean(0)) @ true.T
    information = np.eye(3) * (a**2).sum() - a.T @ a
    expected = np.linalg.solve(information, np.cross(a, errors).sum(0))
    assert rotation_vector(found @ true.T) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("repeats", [1, 2, 5])
def test_table_errors_leave_two_degrees_of_freedom_a_pose_minus_five(repeats):
    faces = np.tile(FACES, (repeats, 1))
    across = np.kron(np.eye(len(faces)), np.zeros((3, 3)))
    for k, n in enumerate(faces):
        across[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = np.eye(3) - np.outer(n, n)
    design = np.vstack([np.hstack([-cross(n), np.eye(3)]) for n in faces])
    left = np.eye(len(across)) - design @ np.linalg.pinv(design)
    assert np.trace(left @ across) == pytest.approx(2 * len(faces) - 5)
    assert np.trace(left) == pytest.approx(3 * len(faces) - 6)


def test_table_errors_tip_each_pair_of_axes_as_one_pose_errs():
    """Section 4: with truth from the list, a non-orthogonality errs by sigma of the table."""
    design = np.hstack([FACES, np.ones((6, 1))])
    solve = np.linalg.pinv(design)
    variance = 0.0
    for k, n in enumerate(FACES):
        for axis in np.eye(3):
            matrix_error = (solve[:3, [k]] @ np.cross(axis, n)[None, :]).T
            variance += (matrix_error[0, 1] + matrix_error[1, 0]) ** 2
    assert variance == pytest.approx(1)


def draw_to_sphere(reading, bias, covariance, model_variance=0.0):
    """Equation 8 of turntable.md: truth, gain, direction."""
    seen = reading - bias
    length = np.linalg.norm(seen)
    direction = seen / length
    gain = covariance @ direction / (direction @ covariance @ direction + model_variance)
    return seen - gain * (length - G), gain, direction


def test_sphere_truth_lies_on_it_and_keeps_no_noise_along_gravity(random):
    root = random.normal(0, 1e-4, (3, 3))
    covariance = root @ root.T
    reading = G * np.array([0.48, 0.6, 0.64]) + 1e-4
    u, gain, direction = draw_to_sphere(reading, np.zeros(3), covariance)
    kept = covariance - np.outer(gain, covariance @ direction)
    assert np.linalg.norm(u) == pytest.approx(G, rel=1e-9)
    assert np.abs(kept @ direction).max() < 1e-12 * np.abs(covariance).max()
    remainder = np.eye(3) - np.outer(gain, direction)
    assert np.abs(remainder @ covariance @ direction).max() < 1e-12 * np.abs(covariance).max()


@pytest.mark.parametrize("model_variance", [0.0, 1e-7])
def test_truth_follows_the_reference_bias_by_its_sensitivity(random, model_variance):
    root = random.normal(0, 1e-4, (3, 3))
    covariance = root @ root.T
    reading = G * np.array([0.48, 0.6, 0.64])
    _, gain, direction = draw_to_sphere(reading, np.zeros(3), covariance, model_variance)
    found = numeric(lambda b: draw_to_sphere(reading, b, covariance, model_variance)[0], np.zeros(3))
    assert np.abs(np.outer(gain, direction) - np.eye(3) - found).max() < 1e-6


def test_sphere_bias_ignores_scale_and_gravity_for_opposite_poses(random):
    true = random.normal(0, 0.3, 3)
    readings = 1.001 * G * FACES + true
    bias = np.zeros(3)
    for _ in range(6):
        seen = readings - bias
        length = np.linalg.norm(seen, axis=1)
        directions = seen / length[:, None]
        bias = np.linalg.lstsq(directions, directions @ bias + length - G, rcond=None)[0]
    assert bias == pytest.approx(true, abs=1e-12)


def test_turn_relates_integrals_for_any_clock_offset_and_bandwidth(random):
    """Equation 14 of turntable.md, by a first-order filter and a delay."""
    rate = 2000.0
    t = np.arange(0, 8, 1 / rate)
    axis = np.array([0.6, 0.0, 0.8])
    turning = np.where((t > 2) & (t < 4), np.sin(np.pi * (t - 2) / 2) ** 2, 0.0)[:, None] * axis
    turning += np.where((t > 2.5) & (t < 5), np.sin(np.pi * (t - 2.5) / 2.5) ** 2, 0.0)[:, None] * axis[::-1]
    m = np.eye(3) + random.uniform(-0.1, 0.1, (3, 3))
    b = random.normal(0, 0.1, 3)
    smeared = np.zeros_like(turning)
    for k in range(1, len(t)):
        smeared[k] = smeared[k - 1] + (turning[k - 1] - smeared[k - 1]) / (0.1 * rate)
    delayed = np.roll(smeared, 150, axis=0)
    y = delayed @ m.T + b
    left = y.sum(0) / rate
    right = m @ (turning.sum(0) / rate) + b * t.size / rate
    assert left == pytest.approx(right, abs=1e-9)


def test_the_centre_of_a_turn_does_not_depend_on_mounting_or_scale(random):
    t = np.linspace(0, 5, 501)
    shape = np.exp(-((t - 2.2) ** 2)) * (1 + 0.3 * t)
    rate = shape[:, None] * np.array([0.2, -0.9, 0.4])

    def centre(omega):
        n = omega.sum(0) / np.linalg.norm(omega.sum(0))
        return (t * (omega @ n)).sum() / (omega @ n).sum()

    m = np.diag([1.02, 0.99, 1.03]) @ rotation(random.normal(0, 1, 3))
    assert centre(rate @ m.T) == pytest.approx(centre(rate), abs=1e-12)


def test_white_and_flicker_noise_move_the_turn_centre_by_their_shares():
    """Section 6, for a turn of one second through one rad: N^2 / 12 and B^2 / (16 pi)."""
    n = 400
    edges = np.linspace(-0.5, 0.5, n + 1)
    intervals = neighbours(edges)
    lever = (edges[1:] + edges[:-1]) / 2 / n
    white = (lever**2).sum() * n
    cells = np.array([mean_log(intervals[0], (x, x + 1 / n)) for x in edges[:-1]])
    covariance = -cells[np.abs(np.subtract.outer(np.arange(n), np.arange(n)))] / np.pi
    assert white == pytest.approx(1 / 12, rel=1e-4)
    assert lever @ covariance @ lever == pytest.approx(1 / (16 * np.pi), rel=1e-4)


def test_rows_minus_their_prediction_are_independent(random):
    """Equation 19 with every row kept."""
    root = random.normal(size=(7, 7))
    covariance = root @ root.T
    whiten = np.eye(7)
    variances = np.zeros(7)
    for k in range(7):
        before = slice(0, k)
        weights = np.linalg.solve(covariance[before, before], covariance[before, k])
        whiten[k, before] = -weights
        variances[k] = covariance[k, k] - weights @ covariance[before, k]
    assert np.abs(whiten @ covariance @ whiten.T - np.diag(variances)).max() < 1e-10


def published(m, rho):
    """Equation 21 of turntable.md: what the published compensation makes of M."""
    return rotation(rho).T @ m @ rotation(rho)


def first_order(scale, nu, rho):
    """Equation 24: changes of non-orthogonality (xy, yz, zx) and scale."""
    (kx, ky, kz), (xy, yz, zx), (rx, ry, rz) = scale, nu, rho
    angles = [
        2 * rz * (ky - kx) + rx * zx - ry * yz,
        2 * rx * (kz - ky) + ry * xy - rz * zx,
        2 * ry * (kx - kz) + rz * yz - rx * xy,
    ]
    scales = [rz * xy - ry * zx, rx * yz - rz * xy, ry * zx - rx * yz]
    return np.array(angles), np.array(scales)


def target(scale, nu):
    """A matrix with these scale errors and, exactly, this non-orthogonality."""
    gram = np.eye(3)
    for angle, (i, j) in zip(nu, PAIRS, strict=True):
        gram[i, j] = gram[j, i] = np.sin(angle)
    return np.diag(1 + scale) @ np.linalg.cholesky(gram)


def test_published_compensation_errs_by_mounting_times_measurand(random):
    """The error of equation 24 is of third order: with all errors a tenth, it is a thousandth."""
    scale, nu, rho = random.normal(0, 0.01, 3), random.normal(0, 0.01, 3), random.normal(0, 0.02, 3)

    def leading_and_rest(size):
        m = target(size * scale, size * nu)
        turned = published(m, size * rho)
        angles, scales = first_order(size * scale, size * nu, size * rho)
        rest_of_angles = non_orthogonality(turned) - non_orthogonality(m) - angles
        rest_of_scales = np.linalg.norm(turned, axis=1) - np.linalg.norm(m, axis=1) - scales
        return np.abs(angles).max(), np.array([np.abs(rest_of_angles).max(), np.abs(rest_of_scales).max()])

    leading, rest = leading_and_rest(1.0)
    _, rest_of_a_tenth = leading_and_rest(0.1)
    assert np.all(rest < 0.1 * leading)
    assert np.all(rest_of_a_tenth < 2e-3 * rest)


def test_published_compensation_turns_the_bias_without_residuals(random):
    m = target(random.normal(0, 0.01, 3), random.normal(0, 0.01, 3)) @ rotation(random.normal(0, 0.02, 3))
    b, rho = random.normal(0, 0.3, 3), random.normal(0, 0.02, 3)
    turn = rotation(rho)
    readings = (G * FACES @ turn.T) @ m.T + b
    design = np.hstack([G * FACES, np.ones((6, 1))])
    fit, *_ = np.linalg.lstsq(design, readings @ turn, rcond=None)
    assert np.abs(fit[:3].T - published(m, rho)).max() < 1e-12
    assert fit[3] == pytest.approx(turn.T @ b, abs=1e-12)
    assert np.abs(design @ fit - readings @ turn).max() < 1e-12
    assert fit[3] - b == pytest.approx(-np.cross(rho, b), abs=np.linalg.norm(rho) ** 2 * np.linalg.norm(b))


def test_published_compensation_errs_by_half_a_mrad_at_one_degree(random):
    """The figure of section 8: mounting 1 deg, scale 1 %, non-orthogonality 0.5 deg."""
    runs, theta, sigma_scale, sigma_nu = 4000, np.radians(1), 0.01, np.radians(0.5)
    squares = 0.0
    for _ in range(runs):
        axis = random.normal(size=3)
        m = target(random.normal(0, sigma_scale, 3), random.normal(0, sigma_nu, 3))
        turned = published(m, theta * axis / np.linalg.norm(axis))
        squares += ((non_orthogonality(turned) - non_orthogonality(m)) ** 2).sum() / runs
    closed = theta * np.sqrt(8 * sigma_scale**2 + 2 * sigma_nu**2)
    assert closed == pytest.approx(0.539e-3, abs=5e-7)
    assert np.sqrt(squares) == pytest.approx(closed, rel=0.03)
