"""A live source is one sender: samples of another one at its port are left out and counted."""

from __future__ import annotations

import json
import random
import socket

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from datagrams import Backlog
from live_fixtures import resting, text_lines
from ports import free_port
from tumble.live import open_set, open_source
from tumble.live.address import parse_address
from tumble.live.text import TextLine
from tumble.logs.options import ReadOptions

FIRST, SECOND = ("127.0.0.1", 5000), ("127.0.0.1", 6000)


def rows(table, kind):
    """Messages of a table of samples."""
    if kind == "JSON":
        names = ("t", "ax", "ay", "az", "gx", "gy", "gz")
        return [json.dumps(dict(zip(names, row, strict=True))).encode() for row in table.tolist()]
    lines = text_lines(table).splitlines()
    return lines if kind == "named" else lines[1:]


@pytest.fixture
def port():
    """A source at a port, and what waits there."""
    address, options = parse_address("udp://:9000"), ReadOptions(gyroscope_unit="rad/s")
    transport = Backlog()
    source = TextLine(address, options, transport, "udp").unit(address, options)
    source.line.units.append(source)
    return source, transport


def read(source, transport, messages, at_once=1):
    """Samples (n, 7) of messages that come so many at once."""
    found = []
    for first in range(0, len(messages), at_once):
        transport.waiting = list(messages[first : first + at_once])
        while transport.waiting:
            chunk = source.read()
            found.append(np.column_stack([chunk.time, chunk.accelerometer, chunk.gyroscope]))
    return np.concatenate(found)


@pytest.mark.parametrize("at_once", [1, 3, 50])
@pytest.mark.parametrize("kind", ["JSON", "named", "bare"])
def test_samples_of_a_second_sender_are_left_out_and_counted(port, kind, at_once):
    source, _ = port
    table = resting(200)
    other = table + 0.5
    both = zip(rows(table, kind), rows(other, kind), strict=True)
    found = read(*port, [each for a, b in both for each in ((FIRST, a), (SECOND, b))], at_once)
    assert np.array_equal(found, table[len(table) - len(found) :])
    assert len(found) >= len(table) - 1
    (notice,) = [each for each in source.remarks if "another sender" in each]
    assert notice.startswith("left out ")
    assert int(notice.split()[2]) >= 150
    assert "than 127.0.0.1:5000, such as 127.0.0.1:6000; let each device send to a port of its own" in notice


def test_a_device_with_a_new_port_for_each_message_is_read(port):
    table = resting(400)
    chance = random.Random(1)
    messages = [(("127.0.0.1", chance.randrange(32768, 61000)), row) for row in rows(table, "JSON")]
    found = read(*port, messages)
    assert np.array_equal(found, table)
    assert not [each for each in port[0].remarks if "another sender" in each]


def test_a_sender_is_followed_by_another_once_it_is_silent(port, monkeypatch):
    now = [100.0]
    monkeypatch.setattr("tumble.foundation.clock.now", lambda: now[0])
    table = resting(500)
    messages = rows(table, "JSON")
    assert len(read(*port, [(FIRST, row) for row in messages[:100]])) == 100
    now[0] += 1.0
    assert len(read(*port, [(SECOND, row) for row in messages[100:200]])) == 0
    now[0] += 1.5
    rest = read(*port, [(SECOND, row) for row in messages[200:]])
    assert np.array_equal(rest, table[-len(rest) :])
    assert len(rest) >= 299  # the first stamp after a pause waits for another one
    assert any("left out 100 messages of another sender" in each for each in port[0].remarks)


def test_units_of_a_port_may_each_have_a_sender_of_their_own():
    table, number = resting(60), free_port()
    with open_set([f"{name}=udp://:{number}:{name}" for name in ("left", "right")]) as units:
        senders = {name: socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for name in ("left", "right")}
        for row in table.tolist():
            for name, sender in senders.items():
                line = f"{name}: {','.join(map(repr, row))}"
                sender.sendto(line.encode(), ("127.0.0.1", number))
        for sender in senders.values():
            sender.close()
        found = dict.fromkeys(senders, 0)
        for name, chunk in units:
            found[name] += len(chunk)
            if sum(found.values()) == 2 * len(table):
                break
        assert not [each for each in units.remarks if "another sender" in each]
    assert found == {"left": 60, "right": 60}


def test_two_autopilots_at_one_port_are_not_interleaved():
    def messages(offset):
        sender = mavlink.MAVLink(None, srcSystem=1)
        return [
            mavlink.MAVLink_highres_imu_message(
                10_000 * k, *(0.1 + offset, 0.2, 9.8), *(0.0, 0.01, 0.0), *(0.0,) * 7, 63, 0
            ).pack(sender)
            for k in range(1, 101)
        ]

    number = free_port()
    with (
        open_source(f"mavlink:udpin::{number}") as source,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as two,
    ):
        for first, second in zip(messages(0.0), messages(1.0), strict=True):
            one.sendto(first, ("127.0.0.1", number))
            two.sendto(second, ("127.0.0.1", number))
        found = np.concatenate([source.read().accelerometer[:, 0] for _ in range(12)])
        assert len(found) > 80
        assert np.allclose(found, 0.1)
        assert any("of another sender than 127.0.0.1:" in each for each in source.remarks)
