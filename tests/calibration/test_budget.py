"""The budget of an uncertainty, held against JCGM 100."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import t as student

from tumble.calibration.budget import BudgetSource, budget_of, effective_degrees_of_freedom

CONTRIBUTIONS = st.lists(
    st.tuples(st.floats(1e-9, 1e3), st.none() | st.floats(1.0, 1e4)), min_size=1, max_size=8
)


def sources(contributions):
    return [
        BudgetSource(
            source=f"source {k}",
            type="A" if freedom else "B",
            distribution="normal",
            standard_uncertainty=2.0 * size,
            unit="m/s^2",
            contribution=size,
            degrees_of_freedom=freedom,
        )
        for k, (size, freedom) in enumerate(contributions)
    ]


def test_effective_degrees_of_freedom_are_those_of_gum_h_1_6():
    """JCGM 100, H.1.6: end gauges, contributions in nm, whose 16 degrees of freedom give k = 2.92."""
    found = effective_degrees_of_freedom(sources([(25.0, 18.0), (9.7, 25.6), (2.9, 50.0), (16.6, 2.0)]))
    assert int(found) == 16


@given(CONTRIBUTIONS)
def test_squares_of_contributions_add_up_and_shares_to_one(contributions):
    found = budget_of("bias x", "m/s^2", 0.1, sources(contributions))
    sizes = np.array([size for size, _ in contributions])
    assert found.combined_uncertainty == pytest.approx(np.sqrt((sizes**2).sum()))
    assert sum(each.share for each in found.entries) == pytest.approx(1.0)
    assert all(each.sensitivity == pytest.approx(0.5) for each in found.entries)


@given(CONTRIBUTIONS)
def test_u_is_the_quantile_of_the_effective_degrees_of_freedom(contributions):
    found = budget_of("bias x", "m/s^2", 0.1, sources(contributions))
    freedom = found.degrees_of_freedom
    expected = student.ppf(0.975, np.inf if freedom is None else freedom)
    assert found.coverage_factor == pytest.approx(expected, rel=1e-6)
    assert found.expanded_uncertainty == found.coverage_factor * found.combined_uncertainty


@given(CONTRIBUTIONS)
def test_effective_degrees_are_at_least_those_of_the_least_known(contributions):
    found = effective_degrees_of_freedom(sources(contributions))
    known = [freedom for _, freedom in contributions if freedom is not None]
    assert (found is None) == (not known) or found >= 1e12
    if found is not None:
        assert found >= min(known) * (1.0 - 1e-9)
