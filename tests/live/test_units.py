"""Several IMUs that send over one line: picking one, and reading all of them from the one line."""

from __future__ import annotations

import json
import socket

import numpy as np
import pytest

from live_fixtures import (
    HEADER,
    Scripted,
    ScriptIsOverError,
    resting,
    samples_of,
    scripted_units,
    serial_device,
    text_lines,
)
from mavlink_fixtures import autopilot, highres
from mavlink_fixtures import scripted as mavlink_scripted
from ports import free_port
from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.live import SharedLines, open_set, open_source, parse_address

pytestmark = pytest.mark.usefixtures("simulated_clock")

TABLES = {"left": resting(120, seed=1), "right": resting(120, seed=2)}


def interleaved(line_of):
    """Bytes of a line of each unit in turn; `line_of` gives it from a name and a row."""
    rows = zip(*(table.tolist() for table in TABLES.values()), strict=True)
    return [
        line_of(name, row).encode() + b"\r\n" for pair in rows for name, row in zip(TABLES, pair, strict=True)
    ]


def numbers(row):
    return ",".join(map(repr, row))


def under_names(row):
    return dict(zip(HEADER.split(","), row, strict=True))


def nested():
    """Lines of JSON, an object with a key for each unit."""
    left, right = (map(under_names, table.tolist()) for table in TABLES.values())
    pairs = zip(left, right, strict=True)
    return [json.dumps(dict(zip(TABLES, pair, strict=True))).encode() + b"\r\n" for pair in pairs]


WAYS = {
    "a word and a colon": lambda: interleaved(lambda name, row: f"{name}: {numbers(row)}"),
    "a word in front": lambda: interleaved(lambda name, row: f"{name},{numbers(row)}"),
    "a column": lambda: [
        f"{HEADER},sensor_id\r\n".encode(),
        *interleaved(lambda name, row: f"{numbers(row)},{name}"),
    ],
    "a first column": lambda: [
        f"imu,{HEADER}\r\n".encode(),
        *interleaved(lambda name, row: f"{name},{numbers(row)}"),
    ],
    "names for each": lambda: [
        *(f"{name}: {HEADER}\r\n".encode() for name in TABLES),
        *interleaved(lambda name, row: f"{name}: {numbers(row)}"),
    ],
    "a field of JSON": lambda: interleaved(lambda name, row: json.dumps({"unit": name, **under_names(row)})),
    "a key of JSON": nested,
}


def read_together(units):
    """(n, 7) samples of each unit, all read from one line as a program that reads several does."""
    found = [np.empty((0, 7)) for _ in units]
    for unit in units:
        unit.__enter__()
    try:
        while True:
            for place, unit in enumerate(units):
                chunk = unit.read()
                rows = np.column_stack([chunk.time, chunk.accelerometer, chunk.gyroscope])
                found[place] = np.concatenate([found[place], rows])
    except ScriptIsOverError:
        return found
    finally:
        for unit in units:
            unit.__exit__(None, None, None)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("unit", TABLES)
def test_one_of_several_units_is_read_by_its_name(way, unit):
    (source,) = scripted_units(WAYS[way](), [unit], whole=True)
    assert np.array_equal(samples_of(source), TABLES[unit])
    assert source.name == f"test-{unit}"


@pytest.mark.parametrize("way", WAYS)
def test_several_units_are_read_from_one_line(way):
    found = read_together(scripted_units(WAYS[way](), TABLES))
    for table, samples in zip(TABLES.values(), found, strict=True):
        # The first line of a serial line may be torn.
        assert len(samples) >= len(table) - 1
        assert np.array_equal(samples, table[len(table) - len(samples) :])


@pytest.mark.parametrize("way", WAYS)
def test_several_units_without_a_choice_are_reported_by_name(way):
    (source,) = scripted_units(WAYS[way](), [None], whole=True)
    with pytest.raises(
        LogError, match=r"test:1: holds 2 IMUs: name one, as udp://test:1:left \(found: left, right\)"
    ):
        samples_of(source)


@pytest.mark.parametrize("way", WAYS)
def test_names_are_reported_too_where_all_rows_come_at_once(way):
    (source,) = scripted_units([b"".join(WAYS[way]())], [None])
    with pytest.raises(LogError, match=r"2 IMUs: name one, as serial:/dev/test:left \(found: left, right\)"):
        samples_of(source)


@pytest.mark.parametrize("way", WAYS)
def test_absent_unit_is_refused_with_the_present_ones(way):
    (source,) = scripted_units(WAYS[way](), ["middle"], whole=True)
    with pytest.raises(LogError, match=r"no (unit|column prefix) 'middle'; found: left, right"):
        samples_of(source)


def test_units_without_names_are_distinguished_by_number():
    lines = interleaved(lambda name, row: json.dumps({"id": list(TABLES).index(name), **under_names(row)}))
    (source,) = scripted_units(lines, ["1"], whole=True)
    assert np.array_equal(samples_of(source), TABLES["right"])
    assert "the line also carries 0" in source.remarks


def test_the_only_unit_of_a_line_needs_no_name():
    table = TABLES["left"]
    lines = [f"imu: {numbers(row)}\r\n".encode() for row in table.tolist()]
    (source,) = scripted_units(lines, [None], whole=True)
    assert np.array_equal(samples_of(source), table)


def test_a_column_that_counts_samples_names_no_units():
    table = TABLES["left"]
    rows = [f"{count},{numbers(row)}\r\n".encode() for count, row in enumerate(table.tolist())]
    (source,) = scripted_units([f"id,{HEADER}\r\n".encode(), *rows], [None], whole=True)
    assert np.array_equal(samples_of(source), table)


def test_short_rows_are_refused_though_the_names_have_a_unit_column():
    rows = [f"{numbers(row)}\r\n".encode() for row in resting(300).tolist()]
    (source,) = scripted_units([f"{HEADER},sensor_id\r\n".encode(), *rows], [None], whole=True)
    with pytest.raises(LogError, match="50 lines in a row hold no sample"):
        samples_of(source)


def test_messages_of_the_device_are_no_units():
    lines = text_lines(TABLES["left"]).splitlines(keepends=True)
    for place in range(10, 100, 7):
        lines.insert(place, b"battery: 3.71 12.2\r\n")
    (source,) = scripted_units([b"booting 3 1\r\n", *lines], [None], whole=True)
    assert np.array_equal(samples_of(source), TABLES["left"])
    assert "the line also carries battery" in source.remarks


@pytest.mark.parametrize("way", WAYS)
def test_rows_that_lost_their_front_decide_nothing(way):
    lines = WAYS[way]()
    begin = len(lines) - 2 * len(TABLES["left"]) if way != "a key of JSON" else 0
    for place in (begin + 4, begin + 1, begin):
        lines.insert(place, b"0.25,-0.5,9.5\r\n")
    (source,) = scripted_units(lines, ["right"], whole=True)
    assert np.array_equal(samples_of(source), TABLES["right"])


def test_a_name_corrupted_on_the_way_is_no_unit():
    lines = WAYS["a word and a colon"]()
    lines[7] = lines[7].replace(b"right", b"rigXt")
    (source,) = scripted_units(lines, ["right"], whole=True)
    assert len(samples_of(source)) == len(TABLES["right"]) - 1
    (source,) = scripted_units(lines, [None], whole=True)
    with pytest.raises(LogError, match=r"holds 2 IMUs.*found: left, right\)"):
        samples_of(source)


def test_a_unit_named_twice_differently_is_refused():
    with pytest.raises(LogError, match="'left' and --topic 'right' both name an IMU"):
        scripted_units([], ["left"], topic="right")


@pytest.mark.parametrize(
    ("text", "place", "unit"),
    [
        ("udp://0.0.0.0:9000:left", "0.0.0.0:9000", "left"),
        ("udp://:9000:left?from=10.0.0.1", ":9000", "left"),
        ("udp://[::1]:9000:a/b", "[::1]:9000", "a/b"),
        ("mavlink:udpin:0.0.0.0:14550:HIGHRES_IMU.1", "udpin:0.0.0.0:14550", "HIGHRES_IMU.1"),
        ("serial:/dev/null:left?baud=9600", "/dev/null", "left"),
        ("mavlink:/dev/null:RAW_IMU", "/dev/null", "RAW_IMU"),
        ("serial:/dev/serial/by-path/pci-0000:00:14.0", "/dev/serial/by-path/pci-0000:00:14.0", None),
        ("replay:log.csv:left", "log.csv:left", None),
    ],
)
def test_the_unit_of_an_address_is_taken_apart(text, place, unit):
    address = parse_address(text)
    assert (address.place, address.unit) == (place, unit)


def test_units_of_one_address_share_its_line():
    lines = SharedLines()
    with serial_device() as device:
        left, right = (open_source(f"serial:{device.path}:{name}", lines=lines) for name in TABLES)
        with left, right:
            assert left.line is right.line
            assert left.fileno() == right.fileno()
        with open_source(f"serial:{device.path}"):
            opened_twice = open_source(f"serial:{device.path}:left")
            with pytest.raises(LogError, match="another program uses it"):
                opened_twice.__enter__()


def counted(units):
    """Samples of each unit of a set, until all of `TABLES` have come, or for 20 s."""
    found, until = dict.fromkeys(TABLES, 0), clock.now() + 20.0
    for name, chunk in units:
        found[name] += len(chunk)
        if sum(found.values()) >= sum(map(len, TABLES.values())) or clock.now() > until:
            break
    return found


def test_a_set_of_units_reads_all_of_them_from_one_port():
    port = free_port()
    with open_set([f"{name}=udp://:{port}:{name}" for name in TABLES]) as units:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as device:
            for line in WAYS["a word and a colon"]():
                device.sendto(line, ("127.0.0.1", port))
        assert counted(units) == {"left": 120, "right": 120}


def test_set_of_units_reads_all_sensors_of_an_autopilot_from_one_port():
    port = free_port()
    words = [f"{name}=mavlink:udpin::{port}:HIGHRES_IMU.{number}" for number, name in enumerate(TABLES)]
    with open_set(words) as units, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as device:
        for number, table in enumerate(TABLES.values()):
            for message in highres(table, sensor=number):
                device.sendto(message, ("127.0.0.1", port))
        assert counted(units) == {"left": 120, "right": 120}


def test_a_line_that_was_lost_is_opened_anew():
    port = free_port()
    lines = SharedLines()
    source = open_source(f"udp://:{port}:left", lines=lines)
    again = open_source(f"udp://:{port}:left", lines=lines)
    assert again.line is source.line
    source.line.lost = True
    assert open_source(f"udp://:{port}:left", lines=lines).line is not source.line


def test_each_sensor_of_an_autopilot_is_a_unit():
    sender = autopilot()
    messages = []
    for first, second in zip(
        highres(TABLES["left"], sender, sensor=0), highres(TABLES["right"], sender, sensor=1), strict=True
    ):
        messages += [first, second]
    for unit, table in (("HIGHRES_IMU.1", TABLES["right"]), ("HIGHRES_IMU.0", TABLES["left"])):
        source = mavlink_scripted(messages, f"mavlink:udpin:127.0.0.1:14555:{unit}")
        assert np.allclose(samples_of(source), table, rtol=0.0, atol=1e-5)
    unpicked = mavlink_scripted(messages)
    samples_of(unpicked)
    assert any("there are also HIGHRES_IMU.1 of system 1" in remark for remark in unpicked.remarks)
    with pytest.raises(LogError, match="no unit 'ATTITUDE'; give one of HIGHRES_IMU"):
        mavlink_scripted(messages, "mavlink:udpin:127.0.0.1:14555:ATTITUDE")
    assert isinstance(unpicked.line.transport, Scripted)


def test_datagrams_that_wait_are_taken_together():
    table = resting(300)
    port = free_port()
    with open_source(f"udp://:{port}") as source, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as device:
        for line in text_lines(table).splitlines():
            device.sendto(line, ("127.0.0.1", port))
        chunks = [source.read() for _ in range(6)]
    assert np.array_equal(np.concatenate([chunk.time for chunk in chunks]), table[:, 0])
    assert len(chunks[1]) > 50
