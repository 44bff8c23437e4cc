"""True turns as a person types them."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tumble.foundation.errors import ProcedureError
from tumble.procedures.spin.turns import TrueTurns

TURN = 2.0 * math.pi
LEAST = math.radians(45.0)


@pytest.mark.parametrize(
    ("text", "clockwise", "counter_clockwise"),
    [("+3", None, 3.0), ("-2.5", 2.5, None), ("+3,-2", 2.0, 3.0), ("-2, +3", 2.0, 3.0)],
)
def test_a_sign_says_the_direction(text, clockwise, counter_clockwise):
    said = TrueTurns.parse(text)
    assert (said.clockwise, said.counter_clockwise) == (clockwise, counter_clockwise)


@given(turns=st.floats(0.01, 100.0), sigma=st.floats(0.0, 10.0))
def test_unsigned_turns_count_in_every_direction(turns, sigma):
    said = TrueTurns.parse(repr(turns), sigma)
    cw, ccw, spread = said.angle(0.0, turns * TURN + LEAST, LEAST)
    assert math.isnan(cw)
    assert ccw == pytest.approx(turns * TURN)
    assert spread == pytest.approx(math.radians(sigma))
    cw, ccw, _ = said.angle(turns * TURN + LEAST, turns * TURN + LEAST, LEAST)
    assert cw == ccw == pytest.approx(turns * TURN)


@given(turns=st.floats(0.01, 100.0), sign=st.sampled_from("+-"))
def test_printed_value_can_be_read_again(turns, sign):
    said = TrueTurns.parse(f"{sign}{turns:g}")
    assert TrueTurns.parse(str(said)) == said


@pytest.mark.parametrize(
    "text", ["", "three", "3,3", "+3,+3", "-3,-2", "+3,-3,+1", "0", "+0", "nan", "-inf", "3,"]
)
def test_invalid_number_of_turns_is_refused_with_an_example(text):
    with pytest.raises(ProcedureError, match=r"\+3 counter-clockwise") as caught:
        TrueTurns.parse(text)
    assert repr(text) in str(caught.value)
