"""Magnetometers of two calibrations held against each other."""

from __future__ import annotations

import numpy as np
import pytest

from compare_units import covariance, drawn, truth
from exchange_units import magnetometer
from tumble.tools.compare.procedure import compare

COUNT = 30


def with_magnetometer(generator, unit, field, *, size=1e-3, current=None):
    """A drawn IMU with a drawn magnetometer of that truth, (12,)."""
    spread = covariance(generator, size)
    found = generator.multivariate_normal(field, spread)
    section = {"M": found[:9].reshape(3, 3), "b": found[9:], "covariance": spread}
    if current is not None:
        section |= {"current": current, "current_sigma": np.full(3, 0.1)}
    content = drawn(generator, unit).content() | {"magnetometer": section}
    return drawn(generator, unit).model_validate(content)


def drawn_field(seed):
    section = magnetometer(seed, tilt=0.05).magnetometer
    return np.concatenate([section.M.ravel(), section.b])


def test_chance_of_magnetometers_of_one_truth_is_even():
    generator = np.random.default_rng(5)
    print("seed 5")
    unit, field = truth(generator), drawn_field(1)
    pairs = [compare([with_magnetometer(generator, unit, field) for _ in range(2)])[0] for _ in range(COUNT)]
    assert {pair.joint.degrees_of_freedom for pair in pairs} == {36}
    differing = sum(pair.verdict == "differ" for pair in pairs)
    assert differing <= 6  # more in one of 1000 such sets


def test_hard_iron_that_changed_is_found_and_named():
    generator = np.random.default_rng(6)
    unit, field = truth(generator), drawn_field(2)
    moved = field + np.concatenate([np.zeros(9), [0.5, 0.0, 0.0]])
    (pair,) = compare([with_magnetometer(generator, unit, each) for each in (field, moved)])
    assert pair.verdict == "differ"
    assert pair.farthest.name == "magnetometer bias x"
    assert pair.farthest.unit == "uT"
    found = {each.triad: each for each in pair.motion}["magnetometer"]
    correction = np.linalg.inv(field[:9].reshape(3, 3))
    assert found.motion == "all orientations in a field of 50 uT"
    assert found.rms == pytest.approx(np.linalg.norm(correction @ [0.5, 0.0, 0.0]), rel=0.3)


def test_effects_of_current_are_compared_where_both_state_them():
    generator = np.random.default_rng(7)
    unit, field = truth(generator), drawn_field(3)
    effects = (np.array([1.0, 0.0, 0.0]), np.array([2.0, 0.0, 0.0]))
    units = [with_magnetometer(generator, unit, field, current=each) for each in effects]
    rows = {each.name: each for each in compare(units)[0].differences}
    assert rows["magnetometer current x"].unit == "uT per A"
    assert rows["magnetometer current x"].sigmas == pytest.approx(1.0 / np.hypot(0.1, 0.1))
    silent = compare([units[0], with_magnetometer(generator, unit, field)])[0]
    assert any("says nothing of the effect of current" in note for note in silent.notes)
