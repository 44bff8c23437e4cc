"""Junk that floods a line costs no sample, and ends the procedure only where no samples come any more."""

from __future__ import annotations

import pytest

from datagrams import Backlog
from tumble.foundation.errors import LogError
from tumble.live import rows
from tumble.live.address import parse_address
from tumble.live.text import TextLine
from tumble.logs.options import ReadOptions

DEVICE, OTHER = ("127.0.0.1", 5000), ("127.0.0.1", 6000)
JUNK = [b"junk " * 20, b"{" + b"x" * 50, b"[1,2,3]", b"status: ok, temperature fine", bytes(range(100, 160))]


def sample(number):
    return b'{"t": %f, "acc": [0.1, 0.2, 9.8], "gyro": [0, 0.01, 0]}' % (number / 100.0)


@pytest.fixture
def line():
    """A source of a device that has sent 50 samples, and its backlog."""
    transport = Backlog()
    address = parse_address("udp://:9000")
    options = ReadOptions(gyroscope_unit="rad/s")
    source = TextLine(address, options, transport, "udp").unit(address, options)
    source.line.units.append(source)
    transport.waiting = [(DEVICE, sample(number)) for number in range(50)]
    assert len(source.read()) == 50
    return source, transport


def flood(transport, sender, first, count, per_sample):
    for number in range(first, first + count):
        transport.waiting += [(sender, JUNK[k % len(JUNK)]) for k in range(per_sample)]
        transport.waiting.append((DEVICE, sample(number)))


def drained(source, transport):
    times = []
    while transport.waiting:
        times += source.read().time.tolist()
    return [*times, *source.read().time.tolist()]


@pytest.mark.parametrize("sender", [DEVICE, OTHER])
def test_no_sample_is_lost_among_two_hundred_junk_messages_each(line, sender):
    source, transport = line
    flood(transport, sender, 50, 40, per_sample=200)
    assert drained(source, transport) == pytest.approx([number / 100.0 for number in range(50, 90)])
    shed = any("unread that others sent" in remark for remark in source.remarks)
    assert shed == (sender == OTHER)


def test_a_device_that_begins_anew_at_another_port_is_read(line, monkeypatch):
    source, transport = line
    monkeypatch.setattr("tumble.live.shared_line.PROVEN_FOR", 0.0)
    transport.waiting = [(OTHER, sample(number)) for number in range(50, 400)]
    assert len(drained(source, transport)) == 350


def test_junk_without_samples_still_ends_the_procedure(line, monkeypatch):
    source, transport = line
    monkeypatch.setattr(rows, "UNREADABLE_SECONDS", 0.0)
    transport.waiting = [(DEVICE, JUNK[0])] * 64 * 60
    with pytest.raises(LogError, match="50 lines in a row hold no sample"):
        drained(source, transport)
