"""Texts of the sources that must be translated, and faults of a catalogue."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

from tumble.foundation.catalogue import PART, CatalogueText

SCRIPTS = Path(__file__).parents[2] / "scripts"


@pytest.fixture(scope="module")
def script():
    """The module `write_catalogues`, which needs babel of the extra `lint`."""
    sys.path.insert(0, str(SCRIPTS))
    try:
        spec = importlib.util.spec_from_file_location("write_catalogues", SCRIPTS / "write_catalogues.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(SCRIPTS))
    return module


@pytest.fixture(scope="module")
def sources(script):
    return sys.modules["catalogue_sources"]


PYTHON = '''
"""No docstring is a text of people."""
def shown(rests, name):
    """Nor is this one."""
    translated("Go to {face}", face=name, context="bench")
    return f"{len(rests)} rests of {name!r}", count_of("turn", 3), rests["key"]
'''


def found(texts):
    return {(text.text, text.context, text.wanted) for text in texts}


def test_texts_of_python_have_places_named_for_what_they_hold(sources):
    texts = found(sources.python_texts(PYTHON, "a.py"))
    assert ("Go to {face}", "bench", True) in texts
    assert ("{count} rests of {name}", "", False) in texts
    assert not any("docstring" in text or "Nor is" in text for text, *_ in texts)
    (turns,) = [text for text in sources.python_texts(PYTHON, "a.py") if text.plural]
    assert (turns.text, turns.plural) == ("{count} turn", "{count} turns")


def test_texts_of_a_template_stand_between_its_tags(sources):
    template = (
        '<p title="Sections">{% if x %}All {{ a | length }}{% endif %}</p>'
        "<p>of {{ b.name }}, <b>M</b>: {{ c.name }}</p>"
    )
    texts = {text.text for text in sources.template_texts(template, "a.j2") if text.wanted}
    assert texts == {"Sections", "All {count}", "of {name}, <b>M</b>: {name_2}"}


@pytest.mark.parametrize(
    ("entry", "fault"),
    [
        (CatalogueText("{n} biases", "{n} 个零偏"), None),
        (CatalogueText("{n} biases", ""), "untranslated"),
        (CatalogueText("{n} biases", "{n} 个零偏", fuzzy=True), "fuzzy"),
        (CatalogueText("{n} biases", "零偏"), "other places"),
        (CatalogueText("{n} biases", "<b>{n}</b> 个零偏"), "other tags"),
        (CatalogueText("{n} biases", "{n} 个偏置"), "no '零偏' for 'biase'"),
        (CatalogueText("of no source", "无", PART), None),
        (CatalogueText("of no source", "无"), "in no source"),
    ],
)
def test_a_catalogue_has_every_text_in_one_term_and_no_other(script, sources, entry, fault):
    texts = [sources.SourceText("{n} biases", "a.py", wanted=True)]
    rest = [] if entry.text == texts[0].text else [CatalogueText("{n} biases", "{n} 个零偏")]
    told = list(script.faults(texts, [entry, *rest], {"biase": ["零偏"]}))
    assert [line.partition(":")[0] for line in told] == ([fault] if fault else [])
