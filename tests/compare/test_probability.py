"""Text of a probability."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tumble.tools.compare.report.text import probability


@pytest.mark.parametrize(
    ("chance", "text"),
    [
        (1.0, "more than 99 %"),
        (0.9951, "more than 99 %"),
        (0.994, "99 %"),
        (0.5, "50 %"),
        (0.051, "5.1 %"),
        (0.0012, "0.12 %"),
        (3e-5, "3e-05"),
        (1e-300, "less than 1e-12"),
        (0.0, "less than 1e-12"),
    ],
)
def test_a_probability_is_printed_as_people_write_it(chance, text):
    assert probability(chance) == text


@given(st.floats(0.0, 1.0))
def test_no_per_cent_has_an_exponent(chance):
    printed = probability(chance)
    assert not (printed.endswith("%") and "e" in printed.removeprefix("more than"))
