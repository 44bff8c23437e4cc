"""Drift of simulated fleets whose q is known: intervals and due dates hold as often as stated."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.drifting_fleets import fleet

from repetitions import repetitions
from tumble.laboratory.drift import (
    HORIZON,
    Series,
    due_time,
    interval,
    log_likelihood,
    pooled_walk,
    probability_below,
    probability_within,
    state_after,
)

UNITS = 1000
FLEETS = repetitions(16)


@pytest.mark.parametrize(("q", "sigma"), [(1.0, 0.3), (1.0, 1.0), (0.04, 1.0)])
def test_the_q_of_a_fleet_is_found_within_its_interval(q, sigma):
    held = 0
    for seed in range(20):
        walk = pooled_walk(fleet(60, 5, q, sigma, seed).series)
        held += walk.low <= q <= walk.high
    print("held", held)
    assert held >= 16  # 95 % of 20; fewer than 16 by chance in 3 of 1000


@pytest.mark.parametrize("common", [0.0, 1.0])
@pytest.mark.parametrize(("q", "sigma"), [(1.0, 0.3), (0.1, 1.0)])
def test_predicted_intervals_hold_the_truth_in_95_of_100(q, sigma, common):
    shares = []
    for seed in range(FLEETS):
        made = fleet(UNITS, 5, q, sigma, seed, common=common * sigma)
        walk = pooled_walk(made.series)
        held = 0
        for unit, series in enumerate(made.series):
            state = state_after(series, walk)
            share = probability_below(state, walk, state.time + 2.0, made.later(unit, 2.0))
            held += 0.025 <= share <= 0.975
        shares.append(held / len(made.series))
    print("shares", shares)
    assert 0.93 <= np.mean(shares) <= 0.97


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_ends_of_an_interval_are_quantiles(noise):
    made = fleet(5, 4, 1.0, 0.5, 9)
    walk = pooled_walk(made.series)
    state = state_after(made.series[0], walk)
    ends = interval(state, walk, state.time + 1.0, noise=noise)
    found = [probability_below(state, walk, state.time + 1.0, end, noise) for end in ends]
    assert found == pytest.approx([0.025, 0.975], abs=1e-9)


def test_intervals_of_small_fleets_hold_too():
    held, tried = 0, repetitions(1600)
    for seed in range(tried):
        made = fleet(3, 3, 1.0, 0.5, seed)
        walk = pooled_walk(made.series)
        state = state_after(made.series[0], walk)
        low, high = interval(state, walk, state.time + 1.0)
        held += low <= made.later(0, 1.0) <= high
    print("share", held / tried)
    # Three units know q badly, and eq. 6 is on the safe side.
    assert held / tried > 0.95 - 3.5 * np.sqrt(0.95 * 0.05 / tried)


def test_at_their_due_dates_95_of_100_units_are_within_limits():
    made = fleet(UNITS, 4, 0.5, 0.5, 5)
    walk = pooled_walk(made.series)
    within = counted = 0
    for unit, series in enumerate(made.series):
        state = state_after(series, walk)
        due = due_time(state, walk, 0.0, 6.0)
        if due is None or due == state.time:
            continue
        counted += 1
        within += abs(made.later(unit, due - state.time)) <= 6.0
        assert probability_within(state, walk, due, 0.0, 6.0) == pytest.approx(0.95, abs=1e-6)
    share = within / counted
    print("share", share, "of", counted)
    assert counted > 0.9 * UNITS
    assert abs(share - 0.95) < 3.5 * np.sqrt(0.95 * 0.05 / counted)


def test_the_likelihood_is_that_of_all_differences():
    random = np.random.default_rng(1)
    times, values = np.array([0.0, 1.0, 1.5, 4.0]), random.normal(size=4)
    noise = np.array([0.3, 0.2, 0.5, 0.1])
    series = Series(times, values, noise)

    def by_matrices(q):
        """REML by its definition: the likelihood of contrasts, which do not know the level."""
        walk = q * np.minimum.outer(times - times[0], times - times[0])
        contrasts = np.diff(np.eye(4), axis=0)
        covariance = contrasts @ (walk + np.diag(noise)) @ contrasts.T
        found = contrasts @ values
        return -0.5 * (np.linalg.slogdet(covariance)[1] + found @ np.linalg.solve(covariance, found))

    q = np.array([0.0, 0.1, 1.0, 10.0])
    expected = np.array([by_matrices(each) for each in q])
    found = log_likelihood(q, [series])
    assert found - found[0] == pytest.approx(expected - expected[0], abs=1e-9)


def test_a_fleet_that_does_not_drift_is_said_to_drift_little():
    walk = pooled_walk(fleet(200, 4, 0.0, 1.0, 2).series)
    assert walk.low < 1e-3
    assert walk.high < 2.0 * np.sqrt(2.0 / 600) * 2.0  # two sigmas of the mean of 600 squares of about 2


def test_too_few_changes_give_no_walk():
    assert pooled_walk(fleet(2, 2, 1.0, 1.0, 1).series) is None
    assert pooled_walk([]) is None


def test_a_unit_beyond_its_limit_is_due_at_once_another_never():
    still = fleet(100, 5, 0.0, 1e-3, 4)
    walk = pooled_walk(still.series)
    state = state_after(still.series[0], walk)
    assert due_time(state, walk, 0.0, 10.0) is None
    assert due_time(state, walk, 100.0, 1.0) == state.time
    assert HORIZON > 1.0


def test_a_value_that_does_not_change_at_all_breaks_nothing():
    times = np.arange(4.0)
    walk = pooled_walk([Series(times, np.full(4, 2.0), np.full(4, 1e-6))] * 2)
    assert np.isfinite([walk.q, walk.low, walk.high]).all()
    assert walk.q < 1e-6
