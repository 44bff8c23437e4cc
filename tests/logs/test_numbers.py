"""Text that is a number."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tumble.foundation.numbers import number_of

GRAMMAR = re.compile(r"\s*[+-]?((\d+\.?\d*|\.\d+)(e[+-]?\d+)?|nan|inf(inity)?)\s*", re.ASCII | re.IGNORECASE)


@pytest.mark.parametrize(
    ("text", "value"),
    [("1.5", 1.5), ("-.5e-3", -5e-4), ("+7.", 7.0), (" 2 ", 2.0), ("1" + "0" * 400, math.inf)],
)
def test_numbers_as_devices_write_them_are_read(text, value):
    assert number_of(text) == value


@pytest.mark.parametrize("text", ["", "1_0", "١٢", "\uff11.5", "0x10", "1,5", "1.2.3", "--1", "1e", "x", "²"])
def test_python_only_notation_is_no_number(text):
    assert number_of(text) is None


def test_a_decimal_comma_is_read_where_it_is_stated():
    assert number_of("-9,81", ",") == -9.81
    assert math.isnan(number_of("nan", ","))


@given(st.text(alphabet=" +-.0123456789eE_naifty٣\uff15x\t", max_size=12))
def test_a_number_is_what_the_grammar_says_and_nothing_else(text):
    assert (number_of(text) is not None) == (GRAMMAR.fullmatch(text) is not None)
