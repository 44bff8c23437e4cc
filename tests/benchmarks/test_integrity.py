"""Intervals of the table of integrity, against published values and by simulation."""

import numpy as np
import pytest
from benchmarks.integrity import rate_interval, share_interval


def test_intervals_equal_published_values() -> None:
    assert share_interval(0, 10) == pytest.approx((0.0, 0.3085), abs=1e-4)
    assert share_interval(10, 10) == pytest.approx((0.6915, 1.0), abs=1e-4)
    assert rate_interval(0, 1.0) == pytest.approx((0.0, 3.689), abs=1e-3)
    assert rate_interval(10, 2.0) == pytest.approx((4.795 / 2, 18.390 / 2), abs=1e-3)


def test_intervals_hold_the_truth_at_least_as_often_as_stated() -> None:
    random = np.random.default_rng(1)
    shares = [share_interval(int(count), 50) for count in random.binomial(50, 0.07, 400)]
    rates = [rate_interval(int(count), 3.0) for count in random.poisson(3.0 * 1.7, 400)]
    assert np.mean([low <= 0.07 <= high for low, high in shares]) >= 0.95
    assert np.mean([low <= 1.7 <= high for low, high in rates]) >= 0.95
