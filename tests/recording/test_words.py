"""Words that messages share: counted nouns, lists, and names that are no text."""

from __future__ import annotations

import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tumble.foundation.words import count_of, join, utf8


@pytest.mark.parametrize(
    ("count", "words"), [(0, "0 bad lines"), (1, "1 bad line"), (2, "2 bad lines"), (21, "21 bad lines")]
)
def test_one_thing_is_counted_in_the_singular(count, words):
    assert count_of("bad line", count) == words


@pytest.mark.parametrize(
    ("names", "words"), [([], ""), (["x"], "x"), (["x", "y"], "x and y"), (["x", "y", "z"], "x, y and z")]
)
def test_names_are_joined_as_they_are_spoken(names, words):
    assert join(names) == words


@given(st.text(st.characters(exclude_categories=["Cs"])))
def test_text_is_written_as_it_is(text):
    assert utf8(text).decode() == text


@pytest.mark.skipif(os.name == "nt", reason="names are text there")
@given(st.binary())
def test_invalid_byte_is_shown_by_value_and_all_others_as_they_are(name):
    shown = utf8(os.fsdecode(name))
    assert shown.decode() == name.decode("utf-8", "backslashreplace")


def test_half_a_pair_of_utf_16_is_shown_by_its_number():
    assert utf8("a\ud83db") == rb"a\ud83db"
