"""Decision rules, held against ILAC-G8:09 and the risks that JCGM 106 promises."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import binom, norm

from tumble.calibration.decision import (
    BEST_FIRST,
    DecisionRule,
    Uncertainty,
    conformity,
    decide,
    rule_named,
    verdict_of,
)
from tumble.foundation.errors import ProcedureError
from tumble.foundation.results import LimitCheck

LIMIT, SPREAD, SIGMA = 1.0, 0.6, 0.15
"""Limit, 1-sigma of the units, 1-sigma of a measurement."""
UNITS = 10_000
UNLIKELY = 1e-5
RULES = (DecisionRule(rule="simple"), DecisionRule(rule="guarded", guard=0.5), DecisionRule(rule="guarded"))


def check(value, remark=""):
    return LimitCheck("accelerometer bias x", value, LIMIT, "m/s^2", abs(value) <= LIMIT, remark)


def verdict(rule, value, sigma=SIGMA):
    known = {"accelerometer bias x": Uncertainty(sigma, 1.96 * sigma)}
    return decide(rule, [check(value)], known)


def promised(guard_band):
    """Global risks: accepted though beyond the limit, and rejected though within it (JCGM 106, 9.5)."""
    accepted_to = LIMIT - guard_band

    def accepted(true):
        return norm.cdf((accepted_to - true) / SIGMA) - norm.cdf((-accepted_to - true) / SIGMA)

    def density(true):
        return norm.pdf(true, scale=SPREAD)

    false_acceptance = 2.0 * quad(lambda true: density(true) * accepted(true), LIMIT, 8.0 * SPREAD)[0]
    false_rejection = 2.0 * quad(lambda true: density(true) * (1.0 - accepted(true)), 0.0, LIMIT)[0]
    return false_acceptance, false_rejection


@pytest.mark.parametrize("rule", RULES, ids=["simple", "half guard", "guarded"])
def test_false_decisions_of_simulated_units_are_as_many_as_promised(rule):
    random = np.random.default_rng(30)
    print("seed 30")
    true = random.normal(0.0, SPREAD, UNITS)
    measured = true + random.normal(0.0, SIGMA, UNITS)
    accepted = np.array([verdict(rule, float(value)).verdict == "pass" for value in measured])
    conforms = np.abs(true) <= LIMIT
    guard_band = rule.guard * 1.96 * SIGMA if rule.rule == "guarded" else 0.0
    for found, risk in zip(
        ((accepted & ~conforms).sum(), (~accepted & conforms).sum()), promised(guard_band), strict=True
    ):
        low, high = binom.interval(1.0 - UNLIKELY, UNITS, risk)
        print(f"{found} of {UNITS}, promised {UNITS * risk:.1f}, {low:.0f} to {high:.0f}")
        assert low <= found <= high


def test_a_pass_by_the_guarded_rule_errs_in_one_of_forty_at_most():
    """With a guard band of U = 1.96 u a unit at the acceptance limit is beyond its limit in 2.5 %."""
    at_the_limit = verdict(RULES[2], LIMIT - 1.96 * SIGMA - 1e-12)
    assert at_the_limit.verdict == "pass"
    assert 1.0 - at_the_limit.probability == pytest.approx(0.025, rel=1e-3)


def test_stated_probabilities_are_the_share_of_units_that_conform():
    """Units are spread evenly; those with a probability of p conform in p of all cases."""
    random = np.random.default_rng(31)
    print("seed 31")
    true = random.uniform(-3.0, 3.0, 20_000)
    measured = true + random.normal(0.0, SIGMA, len(true))
    chances = np.array([conformity(float(value), LIMIT, SIGMA) for value in measured])
    for low, high in ((0.05, 0.35), (0.35, 0.65), (0.65, 0.95)):
        chosen = (chances > low) & (chances < high)
        expected = chances[chosen].mean()
        spread = np.sqrt(expected * (1.0 - expected) / chosen.sum())
        assert abs((np.abs(true[chosen]) <= LIMIT).mean() - expected) < 4.5 * spread


@given(st.floats(-3.0, 3.0), st.floats(0.0, 2.0))
def test_four_verdicts_follow_in_order_from_pass_to_fail(value, band):
    """A larger deviation never has a better verdict, and sign does not matter."""
    found = BEST_FIRST.index(verdict_of(value, LIMIT, band))
    assert found <= BEST_FIRST.index(verdict_of(1.5 * value, LIMIT, band))
    assert verdict_of(value, LIMIT, band) == verdict_of(-value, LIMIT, band)
    assert (found < 2) == (abs(value) <= LIMIT)


@given(st.floats(-3.0, 3.0))
def test_without_a_guard_band_there_are_two_verdicts(value):
    assert verdict(RULES[0], value).verdict in ("pass", "fail")


@given(st.floats(-2.0, 2.0), st.floats(1e-6, 10.0))
def test_probability_is_that_of_a_normal_between_both_limits(value, sigma):
    expected = norm.cdf(LIMIT, value, sigma) - norm.cdf(-LIMIT, value, sigma)
    assert conformity(value, LIMIT, sigma) == pytest.approx(expected, abs=1e-12)


def test_four_verdicts_stand_where_ilac_g8_puts_them():
    band = 1.96 * SIGMA
    cases = {
        LIMIT - band - 0.01: "pass",
        LIMIT - 0.01: "conditional pass",
        LIMIT + 0.01: "conditional fail",
        LIMIT + band + 0.01: "fail",
    }
    for value, expected in cases.items():
        assert verdict(RULES[2], value).verdict == expected


def test_the_worst_parameter_decides_for_the_unit():
    known = {"accelerometer bias x": Uncertainty(SIGMA, 1.96 * SIGMA)}
    checks = [check(0.0), LimitCheck("gyroscope residual x", 2.0, 1.0, "rad/s", False)]
    found = decide(RULES[2], checks, known)
    assert found.verdict == "fail"
    assert [each.verdict for each in found.parameters] == ["pass", "fail"]
    assert found.parameters[1].probability is None


@pytest.mark.parametrize("remark", ["turned about one axis only", ""])
def test_what_the_data_did_not_show_fails_for_its_reason(remark):
    found = decide(RULES[2], [check(float("nan"), remark)], {})
    assert found.verdict == "fail"
    assert found.parameters[0].value is None
    reason = remark or "not shown to be within its limit"
    assert found.parameters[0].sentence() == f"accelerometer bias x was {reason}"


def test_nothing_passes_where_u_is_wider_than_the_limit():
    assert verdict(RULES[2], 0.0, sigma=1.0).verdict == "conditional pass"


@pytest.mark.parametrize("text", ["guarded:x", "guarded:-1", "simple:1", "strict", "guarded:"])
def test_an_unknown_rule_is_refused_in_one_line(text):
    with pytest.raises(ProcedureError, match="give simple, guarded, or guarded:GUARD"):
        rule_named(text)


def test_a_rule_is_read_from_its_name():
    assert rule_named("guarded:0.5") == DecisionRule(rule="guarded", guard=0.5)
    assert rule_named("guarded") == DecisionRule(rule="guarded", guard=1.0)
    assert rule_named("simple").rule == "simple"
