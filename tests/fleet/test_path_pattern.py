"""Patterns of paths mean what a shell means by them, and take no longer than a path is long."""

from __future__ import annotations

import fnmatch
import re
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tumble.fleet.inputs import COLUMNS, InputsError, inputs_of
from tumble.fleet.job import FleetJob
from tumble.fleet.path_pattern import PathPattern

PIECES = ["a", "-", ".", "*", "?", "[0-9]", "[!a]", "[]", "[a", "[]a]", "[!]", "[z-a]", "{", "1"]
NAMES = [f"{{{name}}}" for name in COLUMNS]
TEXTS = st.text("a-.1]{[}", min_size=1, max_size=7)


@given(st.lists(st.sampled_from(PIECES), min_size=1, max_size=6), TEXTS)
def test_a_pattern_fits_what_a_shell_fits(pieces, text):
    pattern = PathPattern("x/*/A" + "".join(pieces))
    fits = fnmatch.fnmatchcase(text, "".join(pieces))
    assert (pattern.facts_in(f"/home/x/y/A{text}") is not None) == fits
    last = pattern.wildcards.rpartition("/")[2]
    assert not fits or fnmatch.fnmatchcase(f"A{text}", last)


def tried_all_ways(pieces, path):
    """Matches a path by an expression that takes each name as long as it can, and tries all ways."""
    names = {name: f"(?P<{name[1:-1]}>[^/]+)" for name in NAMES} | {
        "*": "[^/]*",
        "?": "[^/]",
        "**/": "(?:.*/)?",
    }
    found = re.fullmatch("(?:.*/)?" + "".join(names.get(each, re.escape(each)) for each in pieces), path)
    return found and found.groupdict()


@given(
    st.permutations(NAMES),
    st.lists(st.sampled_from(["a", "-", "a-", "", "", "/", "/**/"]), min_size=3, max_size=3),
    st.lists(TEXTS, min_size=1, max_size=5),
)
def test_names_stand_for_the_longest_parts_in_their_order(names, between, folders):
    pieces = [names[0]]
    for name, each in zip(names[1:], between, strict=False):
        pieces += [*(["/", "**/"] if each == "/**/" else [each]), name]
    path = "/".join(["", *folders])
    assert PathPattern("".join(pieces)).facts_in(path) == tried_all_ways(pieces, path)


def test_a_path_is_looked_at_in_time(tmp_path, monkeypatch):
    hostile = ["-" * 240 + "1.csv", "a-" * 120, "a" * 250, "-1" * 125]
    for name in hostile[:2]:
        (tmp_path / name).write_text("")
    everything = "-".join(NAMES)
    for text in (
        f"{everything}[0-9].csv",
        f"{everything}x",
        "*-*-*-*-*-*-*-*-*[!1-]x",
        "?*" * 20 + "x",
        "*a" * 20 + "x",
    ):
        pattern = PathPattern(text)
        for name in hostile:
            pattern.facts_in(f"/home/{name}")
        monkeypatch.chdir(tmp_path)
        with suppress(InputsError):
            list(inputs_of(FleetJob(procedure="spin", inputs=text, results="r")))
    deep = PathPattern("**/a/**/a/**/a/**/a/**/a/**/b/{unit}")
    assert deep.facts_in("/a" * 2000 + "/c/x") is None
    assert deep.facts_in("/a" * 2000 + "/b/x") == {"unit": "x"}


def test_facts_are_found_beside_letters_of_a_choice(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("A-1", "B-2", "C-x", "-3"):
        (tmp_path / f"{name}.csv").write_text("")
    found = list(inputs_of(FleetJob(procedure="spin", inputs="./{lot}-[0-9].csv", results="r")))
    assert [each.facts["lot"] for each in found] == ["A", "B"]


@pytest.mark.parametrize("text", ["{unit}{unit}.csv", "{lot}/{unit}/{unit}.csv", "{lot}/{unit}-{lot}"])
def test_a_name_given_twice_is_refused(text):
    with pytest.raises(InputsError, match=r"is given twice; give it once, and \* elsewhere"):
        list(inputs_of(FleetJob(procedure="spin", inputs=text, results="r")))


@pytest.mark.parametrize("text", ["{1}.csv", "{1}{1}", "{lots}", "{\u017f}"])
def test_an_unknown_name_is_refused(text):
    with pytest.raises(InputsError, match="is unknown; use unit"):
        list(inputs_of(FleetJob(procedure="spin", inputs=text, results="r")))
