"""Properties of any two calibrations: chance, frames, temperatures, motion."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.compare import calibrated, session, session_of
from scipy.stats import chi2

from compare_units import UNITS, drawn, truth
from repetitions import repetitions
from theory_formulas import numeric
from tumble import Calibration, compare
from tumble.foundation.error_decomposition import factor_jacobian
from tumble.tools.compare.history import line_through
from tumble.tools.compare.unit import jacobian

UNLIKELY = 1e-4
GRAVITY = 9.80665


def seeded(seed=5):
    print(f"seed {seed}")
    return np.random.default_rng(seed)


def pair(first, second, **options):
    return compare([first, second], **options).pairs[0]


def changed(calibration, triad, **sections):
    """The calibration with parts of a triad replaced."""
    content = calibration.content()
    content[triad] = {**content[triad], **sections}
    return Calibration.model_validate(content)


def test_statistic_of_one_truth_is_chi_square_distributed():
    generator, count = seeded(), repetitions(200)
    found = []
    for _ in range(count):
        unit = truth(generator)
        found.append(pair(drawn(generator, unit), drawn(generator, unit, 3e-3)))
    assert {each.joint.degrees_of_freedom for each in found} == {24}
    total = sum(each.joint.statistic for each in found)
    low, high = chi2.ppf([UNLIKELY, 1.0 - UNLIKELY], 24 * count)
    assert low < total < high
    # Those taken to differ, of so many that do not: 5 of 100, within four sigmas of that.
    differing = sum(each.verdict == "differ" for each in found)
    assert abs(differing - 0.05 * count) < 4.0 * np.sqrt(0.05 * 0.95 * count)


def test_a_change_of_eight_sigmas_is_found_and_named():
    generator = seeded(6)
    for triad, place, name in (
        ("accelerometer", 11, "accelerometer bias z"),
        ("gyroscope", 9, "gyroscope bias x"),
    ):
        unit, shift = truth(generator), np.zeros(12)
        first = drawn(generator, unit)
        sigma = np.sqrt(2.0 * getattr(first, triad).covariance[place, place])
        shift[place] = 8.0 * sigma
        found = pair(first, drawn(generator, unit, **{triad: shift}))
        assert found.verdict == "differ"
        assert found.farthest.name == name


def test_sessions_of_one_unit_agree_and_another_unit_differs():
    unit = session(31)
    units = [calibrated(each) for each in (unit.recording, session_of(unit, 32))]
    found = pair(*units)
    assert found.verdict == "same"
    # Three turns of the accelerometer are none in its own axes.
    assert found.joint.degrees_of_freedom == 21
    assert pair(units[0], calibrated(session(33).recording)).verdict == "differ"


def test_a_calibration_and_itself_are_the_same():
    unit = drawn(seeded(), truth(seeded()))
    assert pair(unit, unit).verdict == "same"
    assert pair(unit, unit).identical


def test_turning_one_unit_into_its_own_axes_changes_only_mounting():
    generator = seeded(8)
    unit = truth(generator)
    first, second = drawn(generator, unit), drawn(generator, unit)
    turned = _in_own_axes(second)
    before, after = pair(first, second), pair(first, turned)
    assert "axes of its accelerometer" in " ".join(after.notes)
    assert not any(each.name.startswith("accelerometer mounting") for each in after.differences)
    rows = {each.name: each for each in after.differences}
    for each in before.differences:
        if "mounting" not in each.name:
            assert rows[each.name].value == pytest.approx(each.value, abs=1e-9)
            assert rows[each.name].sigma == pytest.approx(each.sigma, rel=1e-4)
    assert after.joint.degrees_of_freedom == 21
    assert after.verdict == "same"


def _in_own_axes(calibration):
    """The same calibration in the frame in which the matrix of its accelerometer is lower triangular."""
    turned, upper = np.linalg.qr(calibration.accelerometer.M.T)
    back = turned * np.sign(np.diag(upper))
    content = calibration.content()

    def values(x):
        force, rate = x[:9].reshape(3, 3), x[12:21].reshape(3, 3)
        q, r = np.linalg.qr(force.T)
        q = q * np.sign(np.diag(r))
        return np.concatenate([(force @ q).ravel(), x[9:12], (rate @ q).ravel(), x[21:]])

    sections = [getattr(calibration, triad) for triad, _, _ in UNITS]
    at = np.concatenate([np.concatenate([each.M.ravel(), each.b]) for each in sections])
    whole = np.zeros((24, 24))
    for k, each in enumerate(sections):
        whole[12 * k : 12 * k + 12, 12 * k : 12 * k + 12] = each.covariance
    slopes = numeric(values, at)
    whole = slopes @ whole @ slopes.T
    for k, (triad, _, _) in enumerate(UNITS):
        matrix = getattr(calibration, triad).M @ back
        content[triad]["M"] = np.tril(matrix) if k == 0 else matrix
        content[triad]["covariance"] = whole[12 * k : 12 * k + 12, 12 * k : 12 * k + 12]
    return Calibration.model_validate(content)


@pytest.mark.parametrize("rate", [0.5, 3.0])
def test_the_error_in_motion_is_the_mean_over_that_motion(rate):
    generator = seeded(9)
    unit = truth(generator)
    first, second = drawn(generator, unit, 2e-2), drawn(generator, unit, 2e-2)
    first = changed(
        first, "gyroscope", g_sensitivity=1e-4 * np.eye(3), g_sensitivity_sigma=np.full((3, 3), 1e-5)
    )
    second = changed(
        second, "gyroscope", g_sensitivity=3e-4 * np.eye(3), g_sensitivity_sigma=np.full((3, 3), 1e-5)
    )
    way = generator.normal(size=(2, 200_000, 3))
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    force, turn = GRAVITY * way[0], rate * generator.uniform(size=(200_000, 1)) * way[1]
    read_force = force @ second.accelerometer.M.T + second.accelerometer.b
    read_rate = turn @ second.gyroscope.M.T + second.gyroscope.b + force @ second.gyroscope.g_sensitivity.T
    wrong_force, _ = first.correct(read_force)
    # The gyroscope alone is wrong: the specific force is that of the second calibration.
    wrong_rate = np.linalg.solve(
        first.gyroscope.M, (read_rate - first.gyroscope.b - force @ first.gyroscope.g_sensitivity.T).T
    ).T
    found = pair(first, second, largest_rate=rate).motion
    for each, error in zip(found, (wrong_force - force, wrong_rate - turn), strict=True):
        assert each.rms == pytest.approx(np.sqrt(np.mean(np.sum(error**2, axis=1))), rel=0.01)


def test_predicted_motion_error_of_uncertainty_is_the_sampled_one():
    generator, count = seeded(10), repetitions(160)
    unit = truth(generator)
    squares = []
    for _ in range(count):
        found = pair(drawn(generator, unit), drawn(generator, unit)).motion
        squares.append([(each.rms / each.expected) ** 2 for each in found])
    # A mean square of twelve numbers scatters by half of itself or less.
    assert np.mean(squares, axis=0) == pytest.approx([1.0, 1.0], abs=4 * 0.8 / np.sqrt(count))


def drifting(calibration, reference, sigma=1e-6):
    """The calibration at another reference of one drift of the accelerometer's bias, 1e-3 m/s^2/K."""
    content = calibration.content()["accelerometer"]
    drift = {
        "reference": reference,
        "range": np.array([-10.0, 60.0]),
        "bias": (np.full(3, 1e-3),),
        "bias_sigma": (np.full(3, sigma),),
    }
    bias = np.array(content["b"]) + 1e-3 * (reference - 25.0)
    return changed(calibration, "accelerometer", b=bias, temperature_drift=drift)


def test_calibrations_at_different_references_meet_at_one_temperature():
    generator = seeded(11)
    unit = truth(generator)
    first, second = drawn(generator, unit), drawn(generator, unit)
    plain, warm = pair(first, second), pair(drifting(first, 25.0), drifting(second, 45.0))
    assert warm.joint.statistic == pytest.approx(plain.joint.statistic, rel=0.02)
    assert warm.temperature.degrees_of_freedom == 6
    assert warm.verdict == "same"


def test_known_drift_takes_a_calibration_to_the_others_temperature():
    generator = seeded(12)
    unit = truth(generator)
    first, second = drawn(generator, unit), drawn(generator, unit)
    at_45 = changed(second, "accelerometer", b=np.array(second.accelerometer.b) + 0.02)
    at_45 = Calibration.model_validate(
        at_45.content() | {"temperature": {"low": 44.0, "mean": 45.0, "high": 46.0}}
    )
    result = compare([drifting(first, 25.0), at_45])
    assert result.verdict == "same"
    assert "accelerometer: compared at 45.0 degC, as unit knows how to" in result.notes


def test_drifts_that_differ_are_found():
    generator = seeded(13)
    unit = truth(generator)
    first, second = drifting(drawn(generator, unit), 25.0), drifting(drawn(generator, unit), 25.0)
    drift = second.content()["accelerometer"]["temperature_drift"]
    drift["bias"] = [[1e-3, 1e-3, 1.2e-3]]
    second = changed(second, "accelerometer", temperature_drift=drift)
    found = pair(first, second)
    assert found.joint.probability > 0.05
    assert found.verdict == "differ"
    assert found.farthest.name.startswith("accelerometer bias from 25 to")
    assert found.farthest.name.endswith("z")


def test_line_through_values_is_the_weighted_least_squares_fit():
    generator, covered, count = seeded(14), 0, repetitions(1600)
    years = np.array([0.0, 0.4, 1.0, 1.1, 2.5])
    sigmas = np.array([1.0, 0.5, 2.0, 1.0, 0.7])
    design = np.column_stack([np.ones(5), years])
    inverse = np.linalg.inv(design.T @ (design / sigmas[:, None] ** 2))
    for _ in range(count):
        values = 3.0 + 0.7 * years + sigmas * generator.normal(size=5)
        line = line_through("accelerometer bias x", "m/s^2", years, values, sigmas)
        expected = inverse @ design.T @ (values / sigmas**2)
        assert line.rate == pytest.approx(expected[1])
        assert line.rate_sigma == pytest.approx(line.widening * np.sqrt(inverse[1, 1]))
        assert line.line(np.zeros(1))[0][0] == pytest.approx(expected[0])
        covered += abs(line.rate - 0.7) < line.reach * line.rate_sigma
    # Widening where chance made values scatter adds to 95 of 100.
    assert covered / count > 0.93


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_of_the_parameters_are_those_of_the_factors(seed):
    matrix = truth(seeded(seed))["gyroscope"][:9].reshape(3, 3)
    scales = jacobian(lambda x: np.linalg.norm(x.reshape(3, 3), axis=1), matrix.ravel())
    assert factor_jacobian(matrix)[:3] == pytest.approx(scales, abs=1e-8)
