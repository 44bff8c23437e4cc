"""An import of any file gives calibrations or one line that names the fault."""

import os
import re
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from exchange_units import READABLE, calibration, needed
from repetitions import repetitions
from tumble.foundation.errors import TumbleError
from tumble.tools.exchange.procedure import export, import_calibrations


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("hostile")


def is_read_or_given_up_in_a_line(path, word):
    try:
        found = import_calibrations(path, word)
    except TumbleError as error:
        return "\n" not in str(error) and len(str(error)) < 400
    return bool(found) and all(each.text() for each in found)


@pytest.mark.parametrize("word", READABLE)
@settings(max_examples=repetitions(80))
@given(data=st.data())
def test_mutilated_file_never_ends_in_a_traceback(folder, word, data):
    content = export(calibration(1), word, needed(word)).content
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(content)))
        end = data.draw(st.integers(start, min(len(content), start + 40)))
        stray = data.draw(
            st.sampled_from(
                [
                    b"",
                    b"nan",
                    b"inf",
                    b"-",
                    b"1e400",
                    b"0",
                    b"\x00",
                    b"\xff",
                    b"[",
                    b"]",
                    b"{",
                    b": ",
                    b"\n",
                    b"&a",
                    b"*a",
                ]
            )
            | st.binary(max_size=8)
        )
        content = content[:start] + stray + content[end:]
    path = folder / word
    path.write_bytes(content)
    assert is_read_or_given_up_in_a_line(path, word)


TEXTS = [word for word in READABLE if not word.startswith("record")]
EXTREMES = ("1e308", "-1e308", "1e-320", "1e200", "0", "-1", "nan", "inf", "1" + 30 * "0")


@pytest.mark.parametrize("word", TEXTS)
@pytest.mark.filterwarnings("error")
@settings(max_examples=repetitions(60))
@given(data=st.data())
def test_numbers_beyond_all_bounds_end_in_a_line_without_warnings(folder, word, data):
    text = export(calibration(1), word, needed(word)).content.decode()
    numbers = list(re.finditer(r"-?\d+\.?\d*(?:e[-+]?\d+)?", text))
    chosen = data.draw(st.lists(st.sampled_from(range(len(numbers))), min_size=1, max_size=8, unique=True))
    for place in sorted(chosen, reverse=True):
        start, end = numbers[place].span()
        text = text[:start] + data.draw(st.sampled_from(EXTREMES)) + text[end:]
    path = folder / f"{word}-numbers"
    path.write_text(text)
    assert is_read_or_given_up_in_a_line(path, word)


@pytest.mark.parametrize("word", [None, *READABLE])
def test_endless_input_is_refused(tmp_path, word):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(TumbleError, match="is a device or a pipe"):
            import_calibrations(path, word)
    for path, message in (
        (tmp_path, "is a directory|Is a directory|folder"),
        (tmp_path / "absent", "no such calibration; check the path"),
    ):
        with pytest.raises(TumbleError, match=message) as raised:
            import_calibrations(path, word)
        assert "\n" not in str(raised.value)


@pytest.mark.parametrize("word", READABLE)
@settings(max_examples=repetitions(40))
@given(content=st.binary(max_size=200))
@example(content=b"")
@example(content=b"TR" + bytes(200))
@example(content=b"imu0: {model: {a: b}}")
@example(content=b"- " * 100)
def test_any_bytes_never_end_in_a_traceback(folder, word, content):
    path = folder / word
    path.write_bytes(content)
    assert is_read_or_given_up_in_a_line(path, word)
