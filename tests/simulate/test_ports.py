"""A port that a bench chooses is free, and stays so until a program listens there."""

from __future__ import annotations

import re
import socket

import pytest

from ports import OWN
from tumble.tools.simulate import LiveSimulation
from tumble.tools.simulate.live import ports
from tumble.tools.simulate.live.outlet import TcpOutlet
from tumble.tools.simulate.scenario import ScenarioError
from turntable_sessions import one_line, typed

HOST = "127.0.0.1"


@pytest.fixture(params=[socket.SOCK_DGRAM, socket.SOCK_STREAM], ids=["udp", "tcp"])
def taken(request):
    """A port that another program has."""
    with socket.socket(type=request.param) as other:
        other.bind((HOST, 0))
        yield other.getsockname()[1]


def test_a_port_that_another_has_is_passed_over(taken, monkeypatch):
    free = ports.free_port(HOST)
    monkeypatch.setattr(ports, "turn", iter([taken, free]))
    assert ports.free_port(HOST) == free


def test_a_host_at_which_all_ports_are_taken_is_refused(taken, monkeypatch):
    monkeypatch.setattr(ports, "turn", ports.in_turn([taken]))
    with pytest.raises(ScenarioError, match=f"host {HOST}: .*; give one of this computer, or --port too"):
        ports.free_port(HOST)


@pytest.mark.parametrize("transport", ["udp", "tcp", "mavlink"])
@pytest.mark.parametrize("host", ["999.1.1.1", "192.0.2.1"])
def test_a_host_that_is_none_of_this_computer_is_refused_in_one_line(tmp_path, transport, host):
    done = typed(
        *("simulate", "live", "--motion", "spin", "--transport", transport, "--host", host),
        *("--port", "0", "-o", tmp_path),
    )
    assert done.code == 2
    assert f"host {host}: " in one_line(done.err)


def test_ports_come_round_again_once_each_was_given():
    turn = ports.in_turn(range(5))
    once, again = ([next(turn) for _ in range(5)] for _ in range(2))
    assert sorted(once) == [0, 1, 2, 3, 4]
    assert again == once


def test_a_unit_that_is_plugged_in_again_is_where_it_was():
    unit = TcpOutlet(HOST, 0)
    address = unit.address
    unit.unplug()
    unit.plug()
    assert unit.address == address
    unit.unplug()


@pytest.mark.parametrize(("transport", "count"), [("udp", 3), ("tcp", 3), ("mavlink", 1)])
def test_benches_of_these_tests_choose_where_no_other_process_does(transport, count):
    with LiveSimulation(motion="flight", transport=transport, port=0) as bench:
        chosen = {int(re.search(rf"{HOST}:(\d+)", address)[1]) for address in bench.addresses.values()}
    assert len(chosen) == count
    assert chosen <= set(OWN)
    assert not chosen & set(ports.PORTS)
