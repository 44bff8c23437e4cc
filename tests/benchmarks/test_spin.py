"""The bound of a spin is derived right, and the benchmarks of spins run, on next to nothing."""

from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]

from benchmarks import results, spin_bound, spin_chart, spin_enough  # noqa: E402
from benchmarks.spin_session import Course, Motion, course, draw_unit, fit, ideal, play  # noqa: E402

SEED = 61_523
MOTION = Motion(turns=(0.6, -0.4), uneven=True, rest=1.0, rate=20.0, tilt=0.05)
NOISE = (0.03, 0.004)


def random_spin():
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    return course(MOTION), draw_unit(MOTION.tilt, random)


def derivative(function, unknowns):
    """Central differences, one column an unknown."""
    step = 1e-5
    columns = [(function(d) - function(-d)) / (2.0 * step) for d in step * np.eye(unknowns)]
    return np.moveaxis(np.array(columns), 0, -1)


def measured(there, true, change):
    """Noise-free force (n, 3), rates about forward and left, mean rate about up, by unknowns and headings.

    Rates are those of the gyroscope, rid of the estimated scale and bias.
    """
    unit = spin_bound.moved(true, change[: spin_bound.UNKNOWNS])
    up = true.floor[2]
    heading = there.heading + change[spin_bound.UNKNOWNS :]
    wrong = (unit.gyroscope_bias - true.gyroscope_bias) @ up
    scale = (1.0 + true.scale) / (1.0 + unit.scale)
    rate = scale * there.rate - wrong / (1.0 + unit.scale)
    force, _ = ideal(Course(there.time, heading, rate, scale * there.change, there.rest), unit)
    across = (np.outer(there.rate, unit.floor[2]) + unit.gyroscope_bias) @ true.floor[:2].T
    along = (1.0 + unit.scale) * np.diff(heading) * MOTION.rate + unit.gyroscope_bias @ up
    return force + unit.accelerometer_bias, across, along


def test_rows_of_the_bound_are_derivatives_of_the_measurements():
    there, unit = random_spin()
    total = spin_bound.UNKNOWNS + len(there.time)
    found = spin_bound.rows(there, unit, NOISE, MOTION.rate)
    force, across, along = (
        derivative(lambda x, k=k: measured(there, unit, x)[k], total) / NOISE[min(k, 1)] for k in range(3)
    )
    known = spin_bound.UNKNOWNS
    np.testing.assert_allclose(found.force.T, force[..., :known], atol=1e-4)
    np.testing.assert_allclose(found.across.T, across[..., :known], atol=1e-4)
    np.testing.assert_allclose(found.along.T, along[..., :known], atol=1e-4)
    own = np.arange(len(there.time))
    np.testing.assert_allclose(found.force_by_heading.T, force[own, :, known + own], atol=1e-4)
    np.testing.assert_allclose(found.along_by_heading, along[own[:-1], known + own[1:]], rtol=1e-6)


def test_bound_is_the_inverse_of_all_information_with_every_heading():
    there, unit = random_spin()
    known = spin_bound.UNKNOWNS
    total = known + len(there.time)
    jacobian = np.vstack(
        [
            derivative(lambda x, k=k: measured(there, unit, x)[k].ravel(), total) / NOISE[min(k, 1)]
            for k in range(3)
        ]
    )
    used = np.r_[:known, known + there.rest : total]
    information = jacobian[:, used].T @ jacobian[:, used]
    information[:known, :known] += np.diag(spin_bound.KNOWN_BEFOREHAND**-2)
    unit_size = 1.0 / np.sqrt(np.diag(information))
    expected = (np.linalg.inv(information * np.outer(unit_size, unit_size)) * np.outer(unit_size, unit_size))[
        :known, :known
    ]
    found = spin_bound.covariance(there, unit, NOISE, MOTION.rate)
    sigma = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(found / np.outer(sigma, sigma), expected / np.outer(sigma, sigma), atol=1e-5)


def test_rest_alone_bounds_the_bias_about_the_axis_by_its_mean():
    played = play(Motion(rate=50.0), np.random.default_rng(SEED), NOISE)
    least = spin_bound.covariance(played.course, played.unit, NOISE, 50.0)[3:6, 3:6]
    up = played.unit.floor[2]
    np.testing.assert_allclose(np.sqrt(up @ least @ up), NOISE[1] / np.sqrt(played.course.rest), rtol=1e-2)


def test_without_noise_the_estimator_finds_the_simulated_truth():
    played = play(Motion(tilt=0.03, rate=200.0), np.random.default_rng(SEED), (1e-5, 1e-6))
    found, unit = fit(played), played.unit
    np.testing.assert_allclose(found["level_free"]["value"], unit.accelerometer_bias, atol=1e-4)
    np.testing.assert_allclose(found["lever_arm"], unit.lever_arm, atol=1e-4)
    assert found["heading_scale"][0] == pytest.approx(unit.scale, abs=1e-4)


def test_the_chart_is_the_same_in_every_run_and_follows_the_figures():
    figures = results.load("spin_enough")
    drawn = spin_chart.chart(figures)
    assert drawn == spin_chart.chart(figures)
    figures["motions"][0]["stated"][0] *= 1.5
    assert drawn != spin_chart.chart(figures)


def test_sufficient_amount_is_measured_and_close_to_the_bound():
    motion = spin_enough.USUAL
    found = spin_enough.sigmas((motion, 1, 3))
    for stated, least in zip(found["stated"], found["bound"], strict=True):
        assert 0.8 * least < stated < 1.5 * least
