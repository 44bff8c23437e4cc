"""Text that is a number."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tumble.foundation.errors import LogError
from tumble.foundation.numbers import number_of, whole_number
from tumble.laboratory.certificate.dcc_reader import _MissingPartError
from tumble.laboratory.certificate.dcc_reader import _number as number_in_certificate
from tumble.logs.dataflash_file import _column
from tumble.logs.kitti import _row
from turntable_sessions import typed

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


@pytest.mark.parametrize("text", [b"4_0.1", "٣".encode(), b"1e", b""])
def test_no_reader_of_text_takes_python_only_notation(tmp_path, text):
    assert math.isnan(_column([b"1.5", text], False)[1])
    for name, number in (("good", b"1.5"), ("bad", text or b"x")):
        (tmp_path / name).write_bytes(b" ".join([b"1.0"] * 11 + [number] + [b"1.0"] * 18))
    assert _row(tmp_path / "good")[0] == 1.5
    with pytest.raises(LogError, match="does not hold 30 numbers"):
        _row(tmp_path / "bad")
    with pytest.raises(_MissingPartError):
        number_in_certificate(text.decode())


def test_a_decimal_comma_is_read_where_it_is_stated():
    assert number_of("-9,81", ",") == -9.81
    assert math.isnan(number_of("nan", ","))


@given(st.text(alphabet=" +-.0123456789eE_naifty٣\uff15x\t", max_size=12))
def test_a_number_is_what_the_grammar_says_and_nothing_else(text):
    assert (number_of(text) is not None) == (GRAMMAR.fullmatch(text) is not None)


@given(
    st.one_of(st.integers(0, 10**20).map(str), st.text("0123456789\u00b2\u0663_-+ .", max_size=25), st.text())
)
def test_a_whole_number_has_digits_of_ascii_alone(text):
    is_one = re.fullmatch("[0-9]{1,18}", text) is not None
    assert whole_number(text) == (int(text) if is_one else None)


@pytest.mark.parametrize(
    "digits", ["\u00b2", "1\u00b22", "\u0663", "9" * 5000], ids=["raised", "both", "arabic", "many"]
)
@pytest.mark.parametrize(
    "words",
    [
        ("inspect", "log.csv", "--columns", "ax={}"),
        ("turntable", "log.csv", "{}"),
        ("record", "a=udp://127.0.0.1:{}", "-o", "out"),
        ("record", "a=ros2:///imu?domain={}", "-o", "out"),
        ("record", "a=mavlink:udp:127.0.0.1:1:HIGHRES_IMU.{}", "-o", "out"),
    ],
    ids=" ".join,
)
def test_digits_that_are_no_number_are_one_line(tmp_path, monkeypatch, words, digits):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_text("time,ax,ay,az,gx,gy,gz\n0,0,0,9.8,0,0,0\n0.01,0,0,9.8,0,0,0\n")
    done = typed(*(word.format(digits) for word in words))
    assert done.code == 2
    assert "tumble: error: " in done.err.splitlines()[-1]
