"""Texts from outside, such as names of columns in a message: shown in any language, and soon."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hostile import few, for_long
from hostile_places import patient
from tumble.foundation import catalogue as catalogues
from tumble.foundation.catalogue import PLACE, catalogue
from tumble.foundation.translation import CHINESE

PIECES = (
    *("a", "rests", "of", "log.csv", "no such file", "; ", ". ", ": ", ", ", " and ", "(", ")", "{x}", "\n"),
    "] ",
)
TEMPLATES = catalogue(CHINESE)._templates + catalogue(CHINESE)._loose_templates


def test_a_text_of_many_parts_is_shown_as_it_is():
    @settings(few, max_examples=3)
    @given(pieces=st.lists(st.sampled_from(PIECES), min_size=100, max_size=1000))
    def check(pieces):
        with patient():
            assert catalogue(CHINESE).translated("".join(pieces))

    for_long(check, 0.2)


@pytest.mark.parametrize("part", ["ab, ", "Ab cd. ", "ab; cd: ", "ab  ", "(ab ", "a or "])
def test_a_part_that_comes_again_and_again_is_shown_as_it_is(part):
    with patient():
        assert part in catalogue(CHINESE).translated(part * 2000)


def test_a_text_after_one_of_too_many_parts_is_translated(monkeypatch):
    monkeypatch.setattr(catalogues, "_MOST_STEPS", 1)
    new = catalogues.Catalogue(catalogues.read_catalogue(catalogues.catalogue_path(CHINESE)))
    text = "both turned one way only: and no such file or folder; check the path"
    assert new.translated(text) == text
    monkeypatch.undo()
    assert new.translated(text) != text


@given(st.sampled_from(TEMPLATES), st.data())
def test_a_quick_look_at_a_template_loses_no_text(template, data):
    """It looks for literals in their order; the pattern alone may take hours to find that none fits."""
    values = st.sampled_from(["3", "a", "", "a, b", "x. Y", "unit: 2"]) | st.text(max_size=5)
    text = PLACE.sub(lambda _: data.draw(values), template.text)
    if data.draw(st.booleans()):
        place = data.draw(st.integers(0, len(text)))
        text = text[:place] + data.draw(values) + text[place + data.draw(st.integers(0, 3)) :]
    if len(text) < 200:
        assert (template.match(text) is None) == (template.pattern.fullmatch(text) is None)
