"""Numbers on the pages: rounded to their uncertainty, in readable units, words where there is no number."""

from __future__ import annotations

import math
from decimal import Decimal

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from tumble.report.numbers import (
    MINUS,
    NOT_OBSERVABLE,
    Scale,
    exact,
    fixed,
    measurement,
    readable_scale,
    round_like,
    round_pair,
    significant,
    typeset,
)

values = st.floats(-1e12, 1e12, allow_nan=False)
sigmas = st.floats(1e-12, 1e9)
not_numbers = st.sampled_from([math.nan, math.inf, -math.inf])


def number(text: str) -> Decimal:
    return Decimal(text.replace(MINUS, "-"))


def last_place(sigma_text: str) -> Decimal:
    """One unit of the second significant digit of a rounded sigma."""
    return Decimal(1).scaleb(number(sigma_text).adjusted() - 1)


@given(values, sigmas)
@example(0.0, 0.0996)
@example(1.0, 0.995)
@example(12345.0, 678.0)
def test_sigma_keeps_exactly_two_significant_digits(value, sigma):
    _, text = round_pair(value, sigma)
    digits = number(text) / last_place(text)
    assert digits == int(digits)
    assert 10 <= digits <= 99


@given(values, sigmas)
@example(-0.00004, 0.3)
@example(999.96, 0.95)
def test_rounding_moves_value_and_sigma_by_at_most_half_a_digit(value, sigma):
    value_text, sigma_text = round_pair(value, sigma)
    half = last_place(sigma_text) / 2
    assert abs(number(value_text) - Decimal(repr(value))) <= half
    assert abs(number(sigma_text) - Decimal(repr(sigma))) <= half


@given(values, sigmas)
def test_value_and_sigma_are_printed_to_the_same_decimal_place(value, sigma):
    decimals = [len(text.partition(".")[2]) for text in round_pair(value, sigma)]
    assert decimals[0] == decimals[1]


@given(values, sigmas)
def test_rounding_what_is_rounded_changes_nothing(value, sigma):
    once = round_pair(value, sigma)
    assert round_pair(*(float(number(text)) for text in once)) == once


@given(values, sigmas)
def test_turning_the_sign_turns_only_the_sign(value, sigma):
    positive, negative = round_pair(abs(value), sigma)[0], round_pair(-abs(value), sigma)[0]
    assert negative == (positive if number(positive) == 0 else MINUS + positive)


@given(values, sigmas)
def test_no_printed_value_is_a_negative_zero(value, sigma):
    text = round_pair(value, sigma)[0]
    assert not (number(text) == 0 and MINUS in text)
    assert "e" not in text.lower()


@given(st.one_of(values, not_numbers), st.one_of(sigmas, not_numbers))
def test_non_finite_value_is_words_and_never_a_number(value, sigma):
    assume(not (math.isfinite(value) and math.isfinite(sigma)))
    assert measurement(value, sigma, "m/s^2") == NOT_OBSERVABLE
    assert round_like(value, sigma) == NOT_OBSERVABLE
    with pytest.raises(ValueError, match="no rounding"):
        round_pair(value, sigma)


@pytest.mark.parametrize(
    ("value", "sigma", "unit", "text"),
    [
        (0.41234, 0.00123, "m/s^2", "0.4123 ± 0.0012 m/s²"),
        (-0.41234, 0.0996, "rad/s", f"{MINUS}0.41 ± 0.10 rad/s"),
        (12345.6, 678.0, "ppm", "12350 ± 680 ppm"),
        (1.0, 0.0, "s", "1.00 s"),
        (2.5, 0.1, "1", "2.50 ± 0.10"),
    ],
)
def test_a_measurement_reads_as_a_metrologist_writes_it(value, sigma, unit, text):
    assert measurement(value, sigma, unit) == text


@given(st.floats(1e-9, 1e6), st.sampled_from(["m/s^2", "rad/s", "s", "m/s^2/sqrt(Hz)"]))
def test_readable_scale_makes_no_number_too_small_or_too_large(magnitude, unit):
    scale = readable_scale(unit, magnitude)
    shown = scale.factor * magnitude
    assert shown >= 0.1 or scale.factor == 1e9
    assert scale.factor == 1 or shown / 1e3 < 0.1


@given(st.floats(-1, 1, allow_nan=False))
def test_a_ratio_is_shown_in_per_cent_or_parts_per_million(ratio):
    scale = readable_scale("1", ratio)
    assert scale in (Scale("%", 1e2), Scale("ppm", 1e6))


@given(values, st.integers(1, 8))
def test_significant_digits_are_kept_and_no_more(value, digits):
    text = significant(value, digits)
    place = Decimal(1).scaleb(number(text).adjusted() - digits + 1)
    assert abs(number(text) - Decimal(repr(value))) <= place / 2


@given(st.integers(-999_999, 999_999), st.integers(-6, 3))
def test_a_number_someone_chose_is_printed_as_they_wrote_it(digits, exponent):
    chosen = Decimal(digits).scaleb(exponent)
    text = exact(float(chosen))
    assert number(text) == chosen
    assert not text.endswith(".")
    assert not ("." in text and text.endswith("0"))


@given(values, st.integers(0, 9))
def test_fixed_decimals_have_a_true_minus_and_no_negative_zero(value, decimals):
    text = fixed(value, decimals)
    assert "-" not in text
    assert number(text) == Decimal(f"{value:.{decimals}f}")
    assert not (number(text) == 0 and MINUS in text)


@pytest.mark.parametrize(
    ("said", "printed"),
    [
        ("differs by -1.05 ms", f"differs by {MINUS}1.05 ms"),
        ("1 % of it would be 0.098 m/s^2, mostly of z", "1 % of it would be 0.098 m/s², mostly of z"),
        ("turns at 3 rad/s^2 (-0.5, -.25)", f"turns at 3 rad/s² ({MINUS}0.5, {MINUS}.25)"),
        ("noise of 2 m/s^2/sqrt(Hz)", "noise of 2 m/s²/√Hz"),
        ("give it with --true-turns", "give it with --true-turns"),
        ("unit-3 of 2026-11-22, turn 1-2, SIM-7-2", "unit-3 of 2026-11-22, turn 1-2, SIM-7-2"),
    ],
)
def test_a_sentence_made_for_a_terminal_has_the_signs_of_a_page(said, printed):
    assert typeset(said) == printed
    assert typeset(printed) == printed


@given(st.text())
def test_typesetting_is_idempotent(said):
    assert typeset(typeset(said)) == typeset(said)


def test_the_prefix_of_a_unit_in_brackets_stands_inside_them():
    assert readable_scale("rad/s per m/s^2", 2e-5).unit == "(µrad/s)/(m/s²)"
