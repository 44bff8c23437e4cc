"""Samples that are missing are counted, explained and end in exit code 3 where they are many."""

from __future__ import annotations

import json
import re
import socket
import sys

import numpy as np
import pytest

from ports import free_port
from simulated_clock import SimulatedClock
from tumble.foundation import clock
from tumble.live import open_set
from tumble.live.losses import SampleLoss
from turntable_sessions import typed

RATE = 200.0


def datagram(number):
    return json.dumps({"t": number / RATE, "acc": [0.1, 0.2, 9.8], "gyro": [0.0, 0.01, 0.0]}).encode()


@pytest.mark.parametrize(("missing", "heavy"), [(0, False), (20, False), (21, True)])
def test_a_loss_is_heavy_beyond_two_percent(missing, heavy):
    assert SampleLoss("a", 980, missing, 0).is_heavy == heavy


def test_the_cause_is_this_computer_where_it_dropped_half_of_them():
    assert "this computer was too slow" in str(SampleLoss("a", 900, 100, 50))
    assert "lost on the way" in str(SampleLoss("a", 900, 100, 49))


def drained(units):
    """Reads until nothing comes for a while; how many samples came."""
    came = silent = 0
    for _, chunk in units:
        came += len(chunk)
        silent = 0 if len(chunk) else silent + 1
        if silent == 5:
            return came
    return came


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux counts dropped datagrams by socket")
def test_datagrams_that_the_system_drops_are_counted(simulated_clock):
    port = free_port()
    with (
        open_set([f"a=udp://127.0.0.1:{port}"]) as units,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line,
    ):
        for number in range(60_000):
            line.sendto(datagram(number), ("127.0.0.1", port))
        came = drained(units)
        # The count comes with the next datagram that is not dropped.
        for number in range(60_000, 60_020):
            line.sendto(datagram(number), ("127.0.0.1", port))
        came += drained(units)
        (loss,) = units.losses
    # Four stamps after a leap of minutes are left out until a fifth bears them out.
    assert 0 <= 60_020 - came - loss.unread <= 4
    assert loss.is_heavy
    assert "this computer was too slow" in str(loss)


def row(time, x=0.1):
    return json.dumps({"t": time, "acc": [x, 0.2, 9.8], "gyro": [0.0, 0.01, 0.0]}).encode()


FAULTS = {
    "silent": lambda at: row(at) if at < 4.0 else None,
    "silent for a while": lambda at: None if 3.0 < at < 5.0 else row(at),
    "no numbers": lambda at: row(at, 0.1 if at < 3.0 else float("nan")),
    "no numbers for a while": lambda at: row(at, float("nan") if 3.0 < at < 6.0 else 0.1),
    "clock stands still": lambda at: row(min(at, 3.0)),
    "starts anew": lambda at: None if 3.0 < at < 3.5 else row(at if at < 3.0 else at - 3.0),
}
"""Datagrams at a time, s, of units that lack more than 2 % of their samples in 8 s."""


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("options", [(), ("--json",)], ids=["words", "json"])
def test_a_unit_that_lacks_samples_in_any_way_ends_in_code_3(tmp_path, fault, options):
    done = sent(tmp_path, FAULTS[fault], options)
    assert done.code == 3, done.err
    assert "samples are missing" in done.err
    assert options or re.search("gave nothing for|gaps? in time", done.out), done.out
    if options:
        (unit,) = json.loads(done.out.splitlines()[-1])["units"]
        assert unit["missing"] > 0.02 * (unit["samples"] + unit["missing"])


def test_samples_that_come_in_bundles_are_all_there(tmp_path):
    size = 80
    bundles = {
        last: [row(number / RATE) for number in range(last - size, last)] for last in range(size, 1680, size)
    }
    done = sent(tmp_path, lambda at: bundles.get(round(at * RATE)), ("--json",))
    assert done.code == 0, done.err
    assert json.loads(done.out.splitlines()[-1])["units"][0]["missing"] == 0


def sent(tmp_path, datagrams, options):
    """`tumble record` for 8 s of a unit that sends what is given at each time."""
    port = free_port()

    def send():
        clock.sleep(0.1)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
            for number in range(1, 1700):
                found = datagrams(number / RATE) or []
                for each in found if isinstance(found, list) else [found]:
                    line.sendto(each, ("127.0.0.1", port))
                clock.sleep(1.0 / RATE)

    with SimulatedClock():
        sender = clock.thread(send)
        sender.start()
        words = ("-o", tmp_path / "session", "--duration", "8s", *options)
        done = typed("record", f"a=udp://127.0.0.1:{port}", *words)
        clock.wait(sender)
    return done


def recorded(tmp_path, numbers):
    """`tumble record` of samples with these numbers; how it ended."""
    port = free_port()

    def send():
        # The port is open before the first sample.
        clock.sleep(1.0)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
            for number in numbers:
                line.sendto(datagram(number), ("127.0.0.1", port))
                clock.sleep(1.0 / RATE)

    with SimulatedClock():
        sender = clock.thread(send)
        sender.start()
        done = typed(
            "record", f"a=udp://127.0.0.1:{port}", "-o", tmp_path / "session", "--count", len(numbers) - 5
        )
        clock.wait(sender)
    return done


def test_a_recording_that_lacks_a_tenth_ends_in_exit_code_3(tmp_path):
    numbers = np.flatnonzero(np.random.default_rng(4).random(1200) > 0.1)
    done = recorded(tmp_path, numbers)
    assert done.code == 3, done.err
    assert "samples are missing" in done.err
    assert "lost on the way" in done.err


def test_a_recording_that_lacks_a_hundredth_is_sound(tmp_path):
    numbers = np.flatnonzero(np.random.default_rng(4).random(1200) > 0.01)
    done = recorded(tmp_path, numbers)
    assert done.code == 0, done.err
