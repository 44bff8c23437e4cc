"""Datagrams, lines and messages that are no samples: they are left out and counted, and the run goes on."""

from __future__ import annotations

import json
import math
import re
import warnings

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from live_fixtures import HEADER, resting, samples_of, scripted, text_lines
from mavlink_fixtures import highres
from mavlink_fixtures import scripted as mavlink_scripted
from tumble.live.clock import STALL

TABLE = resting(60)
GOOD = [json.dumps(dict(zip(HEADER.split(","), row, strict=True))).encode() for row in TABLE.tolist()]
DIGITS = "9" * 400
AT_FIRST = [
    b'{"status": "ok"}',
    b'{"ax": 1.0}',
    b"[1, 2, 3]",
    b"[" + b"0," * 99 + b"{}]",
    b"nothing\n" * 99,
    b"null",
    b'"time"',
    b"ax,ay",
    ("[" * 30_000).encode(),
    ('{"a":' * 900 + "1" + "}" * 900).encode(),
    f'{{"time": {DIGITS}}}'.encode(),
]
"""First datagrams that are no sample."""
CORRUPTED = [
    *AT_FIRST,
    f'{{"time": 0.305, "ax": {DIGITS}, "ay": 0, "az": 9.8, "gx": 0, "gy": 0, "gz": 0}}'.encode(),
    b'{"time": 0.305, "ax": 1e200, "ay": 0, "az": 9.8, "gx": 0, "gy": 0, "gz": 0}',
    b'{"time": 0.305, "ax": 0, "ay": 0, "az": 9.8, "gx": 1e6, "gy": 0, "gz": 0}',
    b'{"time": 1e300, "ax": 0, "ay": 0, "az": 9.8, "gx": 0, "gy": 0, "gz": 0}',
    b'{"time": -9e15, "ax": 0, "ay": 0, "az": 9.8, "gx": 0, "gy": 0, "gz": 0}',
    b'{"time": 5.305, "ax": 0, "ay": 0, "az": 9.8, "gx": 0, "gy": 0, "gz": 0}',
    b'{"time": NaN, "ax": 0, "ay": 0, "az": 9.8, "gx": 0, "gy": 0, "gz": 0}',
    b'{"time": 0.305, "ax": [[[0]]], "ay": {}, "az": "9.8", "gx": true, "gy": null, "gz": 0}',
]


WILD = b'{"time": 0.305, "ax": 0, "ay": 0, "az": 9.8, "gx": 1e4, "gy": 0, "gz": 0}'
"""Faster than anything turns."""


def left_out(source):
    """Number of lines and samples that a source reports as left out."""
    counts = [re.match(r"left out (\d+) (?:line|sample)", remark) for remark in source.remarks]
    return sum(int(count[1]) for count in counts if count)


def json_values():
    """JSON that may hold anything, at any depth a parser takes."""
    leaves = st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5)
    names = st.sampled_from(HEADER.split(",")) | st.text(max_size=5)
    return st.recursive(
        leaves,
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(names, inner, max_size=8),
        max_leaves=20,
    )


def hostile():
    """A datagram: any bytes, text, JSON, or one of those that did harm once."""
    return (
        st.binary(max_size=200)
        | st.text(max_size=60).map(str.encode)
        | json_values().filter(is_no_sample).map(lambda value: json.dumps(value).encode())
        | st.sampled_from(CORRUPTED)
    )


BEGINNINGS = st.sampled_from([b"header:", b"  stamp:", b"- 0.0", b"---", b"[", b"{", b"#", b"%time,"])
"""Lines that begin something else in one of the forms that streams have."""


def is_no_sample(value):
    """Returns whether a JSON value cannot be a sample of the table: one that could hides others."""
    stamp = value.get("time") if isinstance(value, dict) else None
    return not (isinstance(stamp, int | float) and 0.0 <= stamp <= TABLE[-1, 0] + STALL)


@pytest.mark.parametrize("first", AT_FIRST, ids=lambda piece: piece[:12].decode())
def test_a_first_datagram_that_is_no_sample_is_left_out_and_counted(first):
    source = scripted([first, *GOOD], whole=True)
    assert np.array_equal(samples_of(source), TABLE)
    assert left_out(source) >= 1


@pytest.mark.parametrize("piece", CORRUPTED, ids=lambda piece: piece[:50].decode())
def test_one_corrupted_datagram_costs_no_other_sample(piece):
    source = scripted([*GOOD[:30], piece, *GOOD[30:]], whole=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.array_equal(samples_of(source), TABLE)
    assert left_out(source) >= 1


@pytest.mark.parametrize("stamp", [-9e15, 5.0, 1e300])
def test_a_corrupted_first_stamp_costs_no_other_sample(stamp):
    corrupted = json.dumps(dict.fromkeys(HEADER.split(","), 0.0) | {"time": stamp}).encode()
    assert np.array_equal(samples_of(scripted([corrupted, *GOOD], whole=True)), TABLE)


def test_a_stamp_ahead_costs_only_the_samples_that_it_hides():
    ahead = json.dumps(dict.fromkeys(HEADER.split(","), 0.0) | {"time": 0.455}).encode()
    found = samples_of(scripted([*GOOD[:30], ahead, *GOOD[30:]], whole=True))
    assert np.array_equal(found[found[:, 0] != 0.455], TABLE[(TABLE[:, 0] < 0.3) | (TABLE[:, 0] > 0.455)])


@pytest.mark.parametrize("stall", [0.2, 3.0, 9.0])
def test_a_stall_costs_one_sample_at_most(stall):
    later = TABLE[30:] + np.array([stall, 0, 0, 0, 0, 0, 0])
    pieces = [json.dumps(dict(zip(HEADER.split(","), row, strict=True))).encode() for row in later.tolist()]
    found = samples_of(scripted([*GOOD[:30], *pieces], whole=True))
    assert np.array_equal(found, np.concatenate([TABLE[:30], later[1 if stall > STALL else 0 :]]))


@settings(max_examples=60)
@given(st.lists(st.tuples(st.integers(0, len(GOOD)), hostile()), max_size=5))
@example([(0, b"[" * 5000), (30, b"\xff\xfe")])
@example([(0, WILD), (1, b'{"ax": 0}')])
@example([(0, WILD), (5, WILD), (10, WILD)])
def test_no_datagram_however_hostile_ends_the_run(corrupted):
    pieces = list(GOOD)
    for place, piece in sorted(corrupted, key=lambda each: -each[0]):
        pieces.insert(place, piece)
    found = samples_of(scripted(pieces, whole=True))
    # One whose stamp looks like the clock's may come to stand before another.
    assert len(found) >= len(TABLE) - len(corrupted)


@settings(max_examples=60)
@given(st.lists(st.tuples(st.integers(1, 60), st.binary(max_size=80) | BEGINNINGS), max_size=5))
@example([(1, b"header:")])
@example([(20, b"header:"), (21, b"  stamp:"), (22, b"    sec: 1"), (40, b"---")])
def test_no_line_however_garbled_ends_the_run(garbled):
    lines = text_lines(TABLE).splitlines(keepends=True)
    for place, line in sorted(garbled, key=lambda each: -each[0]):
        lines.insert(place, line.replace(b"\n", b"").replace(b"\r", b"") + b"\r\n")
    assert len(samples_of(scripted([b"".join(lines)]))) >= len(TABLE) - len(garbled)


@pytest.mark.parametrize("field", ["1_0", "٣", "\uff11"])
def test_python_only_notation_is_no_field(field):
    lines = text_lines(TABLE).splitlines(keepends=True)
    odd = f"0.305,{field},0,9.8,0,0,0\r\n".encode()
    source = scripted([b"".join([*lines[:32], odd, *lines[32:]])])
    assert np.array_equal(samples_of(source), TABLE)
    assert "left out 1 line without a sample" in source.remarks


@pytest.mark.parametrize("place", [0, 30])
@pytest.mark.parametrize("seconds", [2.0**63 / 1e6, 1e9])
def test_a_mavlink_time_of_another_age_is_left_out_and_counted(place, seconds):
    strange = TABLE[:1].copy()
    strange[0, 0] = seconds
    messages = highres(TABLE)
    source = mavlink_scripted([*messages[:place], *highres(strange), *messages[place:]])
    assert len(samples_of(source)) == len(TABLE)
    assert left_out(source) == 1


@settings(max_examples=60)
@given(st.lists(st.tuples(st.integers(0, 60), st.binary(max_size=80)), max_size=5), st.randoms())
def test_no_mavlink_however_corrupted_ends_the_run(inserted, random):
    whole = highres(TABLE)
    messages = list(whole)
    for place, piece in sorted(inserted, key=lambda each: -each[0]):
        corrupted = bytearray(whole[random.randrange(len(whole))])
        corrupted[random.randrange(len(corrupted))] ^= 1 << random.randrange(8)
        messages[place:place] = [piece, bytes(corrupted)]
    # Bytes that look like the beginning of a message swallow the messages after them.
    assert math.isfinite(float(samples_of(mavlink_scripted(messages)).sum()))
