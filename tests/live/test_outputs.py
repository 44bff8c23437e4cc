"""Samples on their way out: those sent are those given, and those that cannot be sent are reported."""

from __future__ import annotations

import io
import json
import math
import socket
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest
from pymavlink.dialects.v20 import common as mavlink

from live_fixtures import first_samples, resting
from ports import free_port
from tumble.foundation.errors import OutputError
from tumble.live import LiveChunk, open_source
from tumble.live.outputs import NAMES, OF_A_SET, SetChunk, parse_output
from tumble.logs import Facts, open_recording

TABLE = resting(40)


def chunk_of(table, temperature=None):
    return LiveChunk(table[:, 0], table[:, 1:4], table[:, 4:], temperature)


def sent(text, table, **options):
    with parse_output(text, **options).open(Facts()) as writer:
        for row in table:
            writer.write(chunk_of(row[np.newaxis]))


@pytest.fixture
def listener():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind(("127.0.0.1", 0))
        line.settimeout(5.0)
        yield line


def test_standard_output_is_given_rows_that_read_back_to_the_bit(capsys):
    sent("stdout", TABLE)
    names, *rows = capsys.readouterr().out.splitlines()
    assert names.split(",") == list(NAMES[:-1])
    assert np.array_equal([[float(cell) for cell in row.split(",")] for row in rows], TABLE)


def test_standard_output_gets_an_object_a_sample_and_null_for_invalid(capsys):
    with parse_output("stdout", as_json=True).open(Facts()) as writer:
        writer.write(chunk_of(TABLE[:2], np.array([25.0, math.nan])))
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [tuple(each) for each in found] == [NAMES, NAMES]
    assert [each["temperature"] for each in found] == [25.0, None]
    assert [each["ax"] for each in found] == TABLE[:2, 1].tolist()


def test_samples_sent_by_udp_are_read_as_a_source():
    port = free_port()
    with open_source(f"udp://127.0.0.1:{port}") as source:
        sent(f"udp://127.0.0.1:{port}", TABLE)
        assert np.array_equal(first_samples(source, len(TABLE)), TABLE)


def test_samples_that_came_together_share_unfragmented_datagrams(listener):
    with parse_output(f"udp://127.0.0.1:{listener.getsockname()[1]}").open(Facts()) as writer:
        writer.write(chunk_of(TABLE))
    lines, sizes = [], []
    while len(lines) < len(TABLE):
        datagram = listener.recv(1 << 16)
        sizes.append(len(datagram))
        lines += datagram.splitlines()
    assert max(sizes) <= 1400
    assert len(sizes) < len(TABLE)
    assert [json.loads(line)["time"] for line in lines] == TABLE[:, 0].tolist()


def test_mavlink_carries_a_message_a_sample_and_a_heartbeat(listener):
    with parse_output(f"mavlink:udpout:127.0.0.1:{listener.getsockname()[1]}").open(Facts()) as writer:
        writer.write(chunk_of(TABLE[5:10], np.full(5, 31.5)))
    parser = mavlink.MAVLink(None)
    messages = [message for _ in range(6) for message in parser.parse_buffer(listener.recv(1 << 16))]
    assert [message.get_type() for message in messages] == ["HEARTBEAT", *["HIGHRES_IMU"] * 5]
    samples = messages[1:]
    assert [message.time_usec for message in samples] == np.rint(1e6 * TABLE[5:10, 0]).tolist()
    assert [message.xgyro for message in samples] == pytest.approx(TABLE[5:10, 4].tolist(), rel=1e-6)
    assert {message.temperature for message in samples} == {31.5}


FIELD = np.column_stack([20.0 + np.arange(len(TABLE)), np.full(len(TABLE), -3.5), np.full(len(TABLE), 43.25)])


def chunk_with_field(rows):
    return LiveChunk(TABLE[rows, 0], TABLE[rows, 1:4], TABLE[rows, 4:], field=FIELD[rows])


def test_field_goes_along_and_reads_back_as_a_source(capsys):
    port = free_port()
    with open_source(f"udp://127.0.0.1:{port}") as source:
        with parse_output(f"udp://127.0.0.1:{port}").open(Facts()) as writer:
            writer.write(chunk_with_field(slice(None)))
        chunk = next(chunk for chunk in source if len(chunk))
    assert np.array_equal(chunk.field, FIELD[: len(chunk)])
    with parse_output("stdout").open(Facts()) as writer:
        writer.write(chunk_with_field(slice(0, 1)))
        writer.write(chunk_of(TABLE[1:2]))
    names, with_field, without = capsys.readouterr().out.splitlines()
    assert names.endswith(",gz,mx,my,mz")
    assert with_field.endswith(",20.0,-3.5,43.25")
    assert without.endswith(",nan,nan,nan")


def test_mavlink_carries_the_field_in_gauss(listener):
    with parse_output(f"mavlink:udpout:127.0.0.1:{listener.getsockname()[1]}").open(Facts()) as writer:
        writer.write(chunk_with_field(slice(0, 1)))
    parser = mavlink.MAVLink(None)
    _, sample = (parser.parse_buffer(listener.recv(1 << 16))[0] for _ in range(2))
    assert (sample.xmag, sample.ymag, sample.zmag) == pytest.approx((0.2, -0.035, 0.4325))
    assert sample.fields_updated == 0b111111111


@pytest.mark.parametrize("ending", ["csv", "parquet", "mcap"])
def test_a_file_takes_its_place_once_the_stream_has_ended(tmp_path, ending):
    path = tmp_path / f"out.{ending}"
    with parse_output(str(path)).open(Facts()) as writer:
        writer.write(chunk_with_field(slice(None)))
        assert not path.exists()
    assert open_recording(path).magnetic.field == pytest.approx(FIELD, rel=1e-12)
    found = np.concatenate([chunk.accelerometer for chunk in open_recording(path).chunks()])
    assert np.array_equal(found, TABLE[:, 1:4])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("somewhere", "give stdout, udp://HOST:PORT"),
        ("out.txt", "ends in .csv, .parquet, .mcap"),
        ("udp://nobody.invalid:9000", r"no host 'nobody\.invalid' to send to"),
        ("udp://127.0.0.1", "expected HOST:PORT"),
        ("udp://127.0.0.1:9000?rate=1", "no setting 'rate'"),
        ("mavlink:udpin:127.0.0.1:14550", "expected mavlink:udpout:HOST:PORT"),
        ("/no/such/folder/out.csv", "does not exist"),
    ],
)
def test_invalid_output_is_refused_in_one_line_before_any_sample(text, says):
    with pytest.raises(OutputError, match=says) as caught:
        parse_output(text)
    assert "\n" not in str(caught.value)


def test_network_that_takes_nothing_is_reported():
    # Nobody may send to all at once without having asked the system first.
    with pytest.raises(OutputError, match=r"udp://255\.255\.255\.255:9: cannot send: "):
        sent("udp://255.255.255.255:9", TABLE)


def test_ended_reader_is_reported(monkeypatch):
    class Closed(io.StringIO):
        def write(self, text):
            raise BrokenPipeError

    monkeypatch.setattr(sys, "stdout", Closed())
    with pytest.raises(OutputError, match="its reader has ended"):
        sent("stdout", TABLE)


def set_chunks():
    flags = np.arange(len(TABLE)) % 2
    for first in range(0, len(TABLE), 10):
        part = slice(first, first + 10)
        rows, unit = TABLE[part], first // 10 % 2
        yield SetChunk(
            rows[:, 0], rows[:, 1:4], rows[:, 4:], unit=unit, source=f"imu{unit}", flags=flags[part]
        )


def test_every_line_of_a_set_names_its_source_and_flags(capsys, tmp_path):
    told = [(f"imu{place // 10 % 2}", place % 2) for place in range(len(TABLE))]
    for as_json in (False, True):
        with parse_output("stdout", as_json=as_json).open(Facts()) as writer:
            for chunk in set_chunks():
                writer.write(chunk)
    lines = capsys.readouterr().out.splitlines()
    names, *rows = lines[: len(TABLE) + 1]
    assert names.split(",") == [*NAMES[:-1], *OF_A_SET]
    assert [(row.split(",")[-2], int(row.split(",")[-1])) for row in rows] == told
    objects = [json.loads(line) for line in lines[len(TABLE) + 1 :]]
    assert [(each["source"], each["flags"]) for each in objects] == told
    for path in (tmp_path / "out.csv", tmp_path / "out.parquet"):
        with parse_output(str(path)).open(Facts(further=OF_A_SET)) as writer:
            for chunk in set_chunks():
                writer.write(chunk)
        (read,) = [np.concatenate([chunk.time for chunk in open_recording(path).chunks()])]
        assert np.array_equal(read, TABLE[:, 0])
    table = pq.read_table(tmp_path / "out.parquet")
    assert list(zip(table["source"].to_pylist(), table["flags"].to_pylist(), strict=True)) == told


def test_over_mavlink_the_id_of_a_message_is_the_number_of_the_unit(listener):
    first, second, *_ = set_chunks()
    with parse_output(f"mavlink:udpout:127.0.0.1:{listener.getsockname()[1]}").open(Facts()) as writer:
        writer.write(first)
        writer.write(second)
    reader, ids = mavlink.MAVLink(None), []
    while len(ids) < 20:
        found = reader.parse_buffer(listener.recv(1 << 16)) or []
        ids += [message.id for message in found if message.get_type() == "HIGHRES_IMU"]
    assert ids == [0] * 10 + [1] * 10
