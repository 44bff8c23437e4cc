"""Several spins of one unit become one bias: weighted, if they agree, and else the last."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spin_sessions import record, still, turn
from tumble.foundation.recording import Recording
from tumble.procedures.spin.combination import combine
from tumble.procedures.spin.procedure import spin
from tumble.procedures.spin.result import BiasEstimate


@pytest.fixture(scope="module")
def pattern():
    """A spin, to be given other biases."""
    session = record((still(), turn(2), still()), 101)
    recording = Recording.from_arrays("robot", session.time, session.accelerometer, session.gyroscope)
    return spin(recording).spins[0]


def spin_with(pattern, values, covariance, label="spin"):
    """A spin that found these six numbers."""
    sigma = np.sqrt(np.diag(covariance))
    return replace(
        pattern,
        label=label,
        method="level-free",
        level_free=BiasEstimate(values[:3], sigma[:3], observable=True),
        gyroscope_bias=BiasEstimate(values[3:], sigma[3:], observable=True),
        covariance=covariance,
        by_earth=np.zeros((3, 3)),
    )


def without_accelerometer(spin):
    """The same spin, as if it had been too small a turn."""
    covariance = np.full((6, 6), np.nan)
    covariance[3:, 3:] = spin.covariance[3:, 3:]
    hidden = BiasEstimate(np.full(3, np.nan), np.full(3, np.inf), observable=False, reason="too small a turn")
    return replace(spin, level_free=hidden, covariance=covariance)


def random_covariance(generator, scale):
    root = generator.standard_normal((6, 6))
    both = root @ root.T + 6.0 * np.eye(6)
    sizes = scale * np.array([1e-3] * 3 + [1e-5] * 3)
    return both * np.outer(sizes, sizes)


def draw(pattern, generator, count, truth):
    covariances = [random_covariance(generator, generator.uniform(0.5, 2.0)) for _ in range(count)]
    return [
        spin_with(pattern, generator.multivariate_normal(truth, covariance), covariance, f"spin {k + 1}")
        for k, covariance in enumerate(covariances)
    ]


TRUTH = np.array([0.2, -0.1, 0.3, 0.01, 0.02, -0.03])


def test_one_spin_is_its_own_mean(pattern):
    generator = np.random.default_rng(102)
    (alone,) = draw(pattern, generator, 1, TRUTH)
    combined = combine([alone])
    np.testing.assert_allclose(combined.accelerometer_bias.value, alone.level_free.value)
    np.testing.assert_allclose(combined.covariance, alone.covariance)
    assert not combined.agreement.observable
    assert combined.warnings == ()


def test_equal_spins_halve_the_variance(pattern):
    (alone,) = draw(pattern, np.random.default_rng(103), 1, TRUTH)
    combined = combine([alone, alone])
    np.testing.assert_allclose(combined.covariance, 0.5 * alone.covariance, rtol=1e-9)
    np.testing.assert_allclose(combined.gyroscope_bias.value, alone.gyroscope_bias.value)
    assert combined.agreement.value == pytest.approx(0.0, abs=1e-9)


def test_over_many_draws_the_covariance_is_that_of_the_errors(pattern):
    generator = np.random.default_rng(104)
    print("seed 104")
    squares, agreements = [], []
    for _ in range(300):
        spins = draw(pattern, generator, 3, TRUTH)
        combined = combine(spins)
        values = np.concatenate([combined.accelerometer_bias.value, combined.gyroscope_bias.value])
        off = values - TRUTH
        squares.append(off @ np.linalg.solve(combined.covariance, off))
        agreements.append(combined.agreement.value)
    # Sums of 300 chi-squares of 6 and of 12 degrees of freedom, to four of their sigmas.
    assert np.mean(squares) == pytest.approx(6.0, abs=4.0 * np.sqrt(2.0 * 6.0 / 300.0))
    assert np.mean(agreements) == pytest.approx(12.0, abs=4.0 * np.sqrt(2.0 * 12.0 / 300.0))


def test_contradictory_spins_leave_the_last_one_and_a_warning(pattern):
    generator = np.random.default_rng(105)
    spins = draw(pattern, generator, 2, TRUTH)
    warmer = TRUTH + np.array([0.0, 0.0, 0.0, 0.003, 0.0, 0.0])
    spins.append(spin_with(pattern, warmer, random_covariance(generator, 1.0), "spin 3"))
    combined = combine(spins)
    np.testing.assert_array_equal(combined.gyroscope_bias.value, spins[2].gyroscope_bias.value)
    np.testing.assert_allclose(combined.gyroscope_bias.sigma, spins[2].gyroscope_bias.sigma)
    (warning,) = combined.warnings
    assert "gyroscope" in warning
    assert "spin 3" in warning
    assert combined.agreement.value > combined.agreement.high
    # The accelerometers agree, and need not suffer for the gyroscope.
    assert np.all(combined.accelerometer_bias.sigma < spins[2].level_free.sigma)


def test_a_spin_that_does_not_show_a_bias_has_no_weight_in_it(pattern):
    generator = np.random.default_rng(106)
    shown, other = draw(pattern, generator, 2, TRUTH)
    combined = combine([shown, without_accelerometer(other)])
    np.testing.assert_allclose(combined.accelerometer_bias.value, shown.level_free.value)
    np.testing.assert_allclose(combined.covariance[:3, :3], shown.covariance[:3, :3])
    assert np.all(combined.gyroscope_bias.sigma < shown.gyroscope_bias.sigma)


def test_a_bias_that_no_spin_shows_is_no_number(pattern):
    (alone,) = draw(pattern, np.random.default_rng(107), 1, TRUTH)
    combined = combine([without_accelerometer(alone)])
    assert not combined.accelerometer_bias.observable
    assert np.isnan(combined.accelerometer_bias.value).all()
    assert combined.accelerometer_bias.reason == "too small a turn"
    assert np.isnan(combined.covariance[:3]).all()
    assert np.isfinite(combined.covariance[3:, 3:]).all()


def test_spins_have_the_earths_rotation_in_common(pattern):
    """Noise averages out over ten spins of one robot, the rotation of the Earth does not."""
    share = np.diag([3e-10, 2e-10, 1e-10])
    covariance = np.diag([1e-4] * 3 + [1e-10] * 3)
    covariance[3:, 3:] += share
    each = replace(spin_with(pattern, np.zeros(6), covariance), by_earth=share)
    found = combine([each] * 10).covariance[3:, 3:]
    np.testing.assert_allclose(found, share + 1e-11 * np.eye(3), rtol=1e-6, atol=1e-16)
