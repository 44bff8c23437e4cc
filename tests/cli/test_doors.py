"""Doors of the foundation: files are looked for and read whole, JSON is parsed, in bounds and in one line."""

from __future__ import annotations

import io
import json
import math
import os
import re
import socket

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from hostile_places import without_rights_of_root
from tumble.foundation import bounded_yaml
from tumble.foundation.bounded_json import DEEPEST, MOST_DIGITS, JsonError, parse_json
from tumble.foundation.errors import LogError, PlaceError
from tumble.foundation.file_reading import bounded_lines, read_text_whole, read_whole
from tumble.foundation.file_status import exists, is_file, is_folder, is_link, is_special


@pytest.fixture
def hidden(tmp_path):
    """A file in a folder that nobody may look into."""
    folder = tmp_path / "locked"
    folder.mkdir()
    (folder / "log.csv").write_text("x")
    folder.chmod(0)
    yield folder / "log.csv"
    folder.chmod(0o700)


def test_what_stands_at_a_path_is_answered(tmp_path):
    file, folder, link, pipe = (tmp_path / name for name in ("file", "folder", "link", "pipe"))
    file.write_text("x")
    folder.mkdir()
    link.symlink_to("missing")
    os.mkfifo(pipe)
    for ask, standing in ((is_file, [file]), (is_folder, [folder]), (is_special, [pipe]), (is_link, [link])):
        assert [
            each for each in (file, folder, link, pipe, file / "x", tmp_path / "x") if ask(each)
        ] == standing
    assert [exists(each) for each in (file, folder, pipe, link, file / "x")] == [
        True,
        True,
        True,
        False,
        False,
    ]


@pytest.mark.parametrize("ask", [exists, is_file, is_folder, is_special])
def test_a_path_that_cannot_be_seen_is_one_line(ask, tmp_path, hidden):
    (tmp_path / "loop").symlink_to("loop")
    places = {
        tmp_path / ("x" * 256): "no file has so long a name; check the path",
        tmp_path / "/".join(["d" * 100] * 50): "no file has so long a name; check the path",
        tmp_path / "loop": "Too many levels of symbolic links; check the path",
        f"{tmp_path}/a\0b": "is no path: embedded null byte; check it",
        hidden: "Permission denied; check the path and the permissions of its folders",
    }
    for place, words in places.items():
        with without_rights_of_root(), pytest.raises(PlaceError) as caught:
            ask(place)
        assert words in str(caught.value)
        assert "\n" not in str(caught.value)


def test_a_file_is_read_to_its_limit_and_no_further(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"0123")
    assert read_whole(path, 4) == b"0123"
    with pytest.raises(LogError, match=r"file: is larger than 0 KiB, and no log; give another file$"):
        read_whole(path, 3, "log", error=LogError)
    path.write_bytes(b"\xff")
    with pytest.raises(PlaceError, match="is no text in UTF-8"):
        read_text_whole(path, 4)


def test_what_never_ends_is_never_read(tmp_path, hidden):
    os.mkfifo(tmp_path / "pipe")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(os.path.relpath(tmp_path / "socket"))
    for place in (
        tmp_path / "pipe",
        tmp_path / "socket",
        "/dev/zero",
        "/dev/full",
        tmp_path,
        hidden,
        "missing",
    ):
        with without_rights_of_root(), pytest.raises(PlaceError) as caught:
            read_whole(place, 1 << 40, "certificate")
        assert str(caught.value).startswith(f"{place}: ")
        assert "\n" not in str(caught.value)


_values = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.text('[]{}"\\a', max_size=80),
        st.integers(),
        st.floats(allow_nan=False, allow_infinity=False),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=3), inner, max_size=4)
    ),
)


@given(_values)
def test_json_of_ours_is_read_as_the_library_reads_it(value):
    text = json.dumps(value)
    assert parse_json(text) == parse_json(text.encode()) == json.loads(text)


@pytest.mark.parametrize(("opening", "closing"), [("[", "]"), ('{"a":', "}"), ('["[", [], ', "]")])
def test_json_is_refused_beyond_a_depth(opening, closing):
    deepest = DEEPEST if "[]" not in opening else DEEPEST - 1
    text = opening * deepest + "0" + closing * deepest
    assert parse_json(text) == json.loads(text)
    for levels in (deepest + 1, 200, 100_000):
        for content in (opening * levels + "0" + closing * levels, opening * levels):
            with pytest.raises(JsonError):
                parse_json(content)


def test_a_number_of_thousands_of_digits_is_refused():
    assert parse_json("9" * MOST_DIGITS) == int("9" * MOST_DIGITS)
    for text in ("9" * 5000, f'{{"a": [{"9" * (MOST_DIGITS + 1)}]}}'):
        with pytest.raises(JsonError, match=f"{MOST_DIGITS} at most"):
            parse_json(text)


@pytest.mark.parametrize("text", ["NaN", "Infinity", "-Infinity", "1e400", "-9e999"])
def test_a_number_that_is_not_finite_is_refused(text):
    with pytest.raises(JsonError, match=f"'{text}' is no finite number"):
        parse_json(f'{{"a": [{text}]}}')
    assert not math.isfinite(parse_json(text.encode(), only_finite=False))


@pytest.mark.parametrize("parse", [parse_json, lambda text: bounded_yaml.parse(text)[1]])
def test_a_key_given_twice_is_refused_at_any_depth(parse):
    inner = '{"a": 1, "b": {"a": 2}}'
    for around in ("%s", "[%s]", '{"c": %s}', '{"c": [[{"d": %s}]]}'):
        assert parse(around % inner)
        for twice in ('{"a": 1, "a": 1}', '{"a": 1, "b": 2, "\\u0061": 3}', '{"b": {"": 1, "": 2}}'):
            with pytest.raises((JsonError, yaml.YAMLError), match="is given twice"):
                parse(around % twice)


def test_yaml_keys_of_one_value_are_refused():
    for text in ("{1: a, 1.0: b}", "{true: a, True: b}", "{~: a, null: b}"):
        with pytest.raises(yaml.YAMLError, match="two keys are equal"):
            bounded_yaml.parse(text)
    assert bounded_yaml.parse("a: &x {b: 1}\nc: {<<: *x, b: 2}")[1]["c"] == {"b": 2}


@given(st.lists(st.binary(max_size=9).filter(lambda line: b"\n" not in line), max_size=6), st.booleans())
def test_lines_are_read_within_their_bound(lines, is_ended):
    content = b"\n".join(lines) + (b"\n" if lines and is_ended else b"")
    found = list(bounded_lines(io.BytesIO(content), 5))
    whole = [each for each in re.split(rb"(?<=\n)", content) if each]
    assert [line for _, line in found] == [line if len(line) <= 5 else None for line in whole]
    assert all(content[place:].startswith(line) for place, line in found if line is not None)
