"""Logs of which a few bytes were garbled: reported with their place, or read without them, never misread."""

from __future__ import annotations

import os
import warnings

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from log_fixtures import made_up, read, refusal, write_text
from repetitions import by_turns, repetitions
from tumble.foundation.errors import TumbleError
from tumble.logs import ReadOptions, open_recording
from tumble.logs.csv import TextTable
from tumble.tools.inspect.procedure import inspect
from turntable_sessions import typed

SKIP = ReadOptions(skip_bad_lines=True)
SAMPLES = 600


@pytest.fixture
def log(tmp_path):
    return write_text(tmp_path / "log.csv", made_up(SAMPLES, temperature=False))


def garble(path, **lines):
    """Replaces lines, from 1, as `line_301=b"..."`, by bytes or by what a function makes of them."""
    rows = path.read_bytes().split(b"\n")
    for name, change in lines.items():
        at = int(name.removeprefix("line_")) - 1
        rows[at] = change(rows[at]) if callable(change) else change
    path.write_bytes(b"\n".join(rows))
    return path


def field(index, text):
    def change(line):
        fields = line.split(b",")
        fields[index] = text
        return b",".join(fields)

    return change


PLACES = [2, 3, 301, 601]
GARBLED = {
    "nul": (lambda line: line[:9] + b"\x00" + line[10:], ["byte 10 is 0x00", "not a number"]),
    "not utf-8": (lambda line: line[:9] + b"\xff" + line[10:], ["byte 10 is 0xff", "not a number"]),
    "cut": (lambda line: line[:30], ["fields where 7 columns are named"]),
    "joined": (lambda line: line + b",1,2", ["has 9 fields where 7 columns are named"]),
    "quote": (lambda line: b'"' + line[1:], ["column time, which is not a number"]),
    "carriage return": (lambda line: line[:9] + b"\r" + line[9:], ["byte 10 is 0x0d"]),
    "underscore": (field(3, b"1_0"), ["holds '1_0' in column az"]),
    "arabic": (field(3, "٣".encode()), ["in column az, which is not a number"]),
    "nuls": (lambda line: b"\x00" * len(line), ["1 field ", "byte 1 is 0x00"]),
}
"""Damage to a line, and the words that name it."""
CASES = [
    (name, at)
    for number, name in enumerate(GARBLED)
    # Two lines of each by turns, so that each line is garbled in some ways; all of them in `make soak`.
    for at in by_turns(PLACES, number, 2)
]


@pytest.mark.parametrize(("name", "at"), CASES)
def test_a_garbled_line_is_named_with_its_byte_and_left_out_if_asked(log, name, at):
    change, words = GARBLED[name]
    whole = read(log)
    garble(log, **{f"line_{at}": change})
    line = refusal(log)
    assert f"line {at} " in line
    assert "--skip-bad-lines" in line
    assert all(word in line for word in words), line
    stream = open_recording(log, SKIP).chunks()
    rest = np.concatenate([chunk.time for chunk in stream])
    assert np.array_equal(rest, np.delete(whole.time, at - 2))
    assert f"left out 1 bad line: line {at} " in " ".join(stream.counts.notices())


def test_log_with_a_garbled_first_row_is_laid_out_by_later_rows(tmp_path):
    path = write_text(tmp_path / "log.csv", made_up(200, temperature=False), delimiter=";")
    garble(path, line_2=b"0.1;0,2;\x00;x;y;z;9")
    assert "line 2 holds" in refusal(path)
    assert len(read(path, SKIP)) == 199


@pytest.mark.parametrize("torn", [b"2,0.001,0.002", b"0.0,0.1,\x00\x01,9.8,0,0,0"])
def test_nameless_log_that_begins_in_the_middle_of_a_line_is_read(tmp_path, torn):
    path = write_text(tmp_path / "log.csv", made_up(200, temperature=False), header="")
    garble(path, line_1=torn)
    assert len(read(path, SKIP)) == 199


def test_up_to_one_per_cent_of_bad_lines_is_left_out_and_more_refused(log):
    six = {f"line_{at}": b"torn" for at in range(100, 106)}
    garble(log, **six)
    assert len(read(log, SKIP)) == SAMPLES - 6
    garble(log, line_200=b"torn")
    assert "7 of 600 lines are bad, line 100 has 1 field " in refusal(log, SKIP)


VALUES = [b"1e30", b"-1e200", b"1.7e308"]


@pytest.mark.parametrize(
    ("column", "value"),
    # Each column meets one of them by turns, and all in `make soak`.
    [(each, value) for each in range(1, 7) for value in by_turns(VALUES, each, 3)],
)
def test_impossible_reading_is_left_out_with_time_and_value(log, column, value):
    clean = open_recording(log)
    garble(log, line_302=field(column, value))
    recording = open_recording(log)
    found = inspect(recording)
    assert recording.metadata.accelerometer_unit == clean.metadata.accelerometer_unit
    assert recording.metadata.gyroscope_unit == clean.metadata.gyroscope_unit
    assert found.timing.samples == SAMPLES - 1
    channel = f"{'accelerometer' if column < 4 else 'gyroscope'} {'xyz'[(column - 1) % 3]}"
    said = next(remark for remark in found.remarks if "no sensor reads" in remark)
    assert f"{channel} reads {float(value):.6g}" in said
    assert "at 1.500000 s (line 302)" in said


@pytest.mark.parametrize(
    ("column", "value", "said"), [(3, b"981.0", "981 m/s^2"), (6, b"-12.5", "-12.5 rad/s")]
)
def test_sample_far_from_its_neighbours_is_kept_and_reported(log, column, value, said):
    garble(log, line_302=field(column, value))
    found = inspect(open_recording(log))
    assert found.timing.samples == SAMPLES
    assert any(f"{said} at 1.500000 s (line 302)" in remark for remark in found.remarks)


def test_one_spike_does_not_make_degrees_of_radians(log):
    garble(log, line_302=field(6, b"300"))
    found = inspect(open_recording(log))
    assert found.metadata.gyroscope_unit.name == "rad/s"
    assert any("gyroscope z reads 300 rad/s at 1.500000 s (line 302)" in remark for remark in found.remarks)


def test_successive_rates_too_large_for_radians_are_refused(tmp_path):
    chunk = made_up(80_000, temperature=False)
    chunk.gyroscope[70_000:70_003, 2] = 90.0
    assert "give --gyroscope-unit (deg/s?)" in refusal(write_text(tmp_path / "log.csv", chunk))


def test_one_time_stamp_out_of_order_is_named_and_left_out_if_asked(log):
    garble(log, line_302=field(0, b"5000.0"))
    assert "line 302: time jumps ahead by 4998.51 s to 5000 s in this sample alone" in refusal(log)
    assert len(read(log, SKIP)) == SAMPLES - 1


def test_a_log_of_nothing_but_huge_readings_is_refused_in_one_line(tmp_path):
    chunk = made_up(300, temperature=False)
    chunk.accelerometer[:] = 1e200
    assert "accelerometer reads 1e+200" in refusal(write_text(tmp_path / "log.csv", chunk))


def test_times_that_are_none_are_refused_in_one_line(tmp_path):
    chunk = made_up(300, temperature=False)
    path = write_text(tmp_path / "log.csv", chunk, scale=(1e300, 1.0, 1.0))
    assert "no sensor reads: time reads" in refusal(path)


def test_skip_bad_lines_is_an_option_of_the_commands(log):
    garble(log, line_302=b"torn")
    refused = typed("inspect", log)
    assert refused.code == 2
    assert refused.err.count("\n") == 1
    assert "line 302 has 1 field where 7 columns are named" in refused.err
    done = typed("inspect", log, "--skip-bad-lines")
    assert done.code == 0
    assert "left out 1 bad line: line 302" in done.text


MUTATIONS = st.lists(
    st.tuples(
        st.sampled_from(["flip", "nul", "cut", "huge", "double", "swap"]),
        st.integers(0, 10**6),
        st.integers(0, 255),
    ),
    min_size=1,
    max_size=4,
)
HUGE = [b"1e308", b"-1e308", b"1e400", b"1e-400", b"nan", b"-inf", b"9" * 400, b"0x10", b"1_0", b"--1"]


def mutated(data, mutations):
    for kind, place, value in mutations:
        at = place % max(1, len(data))
        if kind in ("flip", "nul"):
            data = data[:at] + bytes([0 if kind == "nul" else value]) + data[at + 1 :]
            continue
        lines = data.split(b"\n")
        line = place % len(lines)
        if kind == "cut":
            lines[line] = lines[line][: value % (len(lines[line]) + 1)]
        elif kind == "double":
            lines.insert(line, lines[line])
        elif kind == "swap":
            other = value % len(lines)
            lines[line], lines[other] = lines[other], lines[line]
        else:
            fields = lines[line].split(b",")
            fields[value % len(fields)] = HUGE[value % len(HUGE)]
            lines[line] = b",".join(fields)
        data = b"\n".join(lines)
    return data


@pytest.mark.parametrize("header", ["time,ax,ay,az,gx,gy,gz", ""])
@pytest.mark.parametrize("options", [ReadOptions(), SKIP], ids=["strict", "skipping"])
@settings(max_examples=repetitions(200), print_blob=True)
@given(mutations=MUTATIONS, samples=st.sampled_from([3, 40, 150]))
@example(mutations=[("huge", 2198, 2), ("swap", 83, 164)], samples=3)  # leaves no sample
def test_any_damaged_log_is_read_or_refused_in_one_line(
    tmp_path_factory, header, options, mutations, samples
):
    path = write_text(
        tmp_path_factory.mktemp("logs") / "log.csv", made_up(samples, temperature=False), header
    )
    path.write_bytes(mutated(path.read_bytes(), mutations))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        problem, found = "", None
        try:
            found = inspect(open_recording(path, options))
        except TumbleError as error:
            problem = str(error)
    assert "\n" not in problem
    assert problem or 0 < found.timing.samples <= samples + len(mutations)


def test_a_log_that_somebody_cuts_while_it_is_read_is_refused(tmp_path, monkeypatch):
    log = garble(write_text(tmp_path / "log.csv", made_up(80_000, temperature=False)), line_70000=b"garbled")
    recording, parsed = open_recording(log), TextTable._parsed

    def parsed_once_cut(table, data):
        if b"garbled" in data:
            os.truncate(log, 0)
        return parsed(table, data)

    monkeypatch.setattr(TextTable, "_parsed", parsed_once_cut)
    with pytest.raises(TumbleError, match="has 1 field"):
        list(recording.chunks())
