"""A table stops at once whatever the run that drives it waits for: no stop needs the thread of the run."""

from __future__ import annotations

import threading

import pytest

from live_benches import simulated_bench
from table_fixtures import ObservedTable
from tumble.bench.engine import CLOSED_WITHIN, Engine
from tumble.bench.run_folder import RunFolder
from tumble.foundation import clock
from tumble.foundation.ending import watched
from tumble.foundation.errors import LogError, OutputError
from tumble.live.shared_line import LineUnit
from tumble.procedures.turntable import guided_run
from tumble.tools.guided.order import RunOrder, TableOrder
from tumble.tools.record.writer import SessionWriter

ROLES = {"reference": "reference", "target_1": "target", "target_2": "target"}
STOPPED_WITHIN = 0.5
"""s from the request of a stop until the table has it."""


class Run:
    """A run on a table of a simulated bench, whose parts can be blocked for ever."""

    def __init__(self, bench, folder, monkeypatch):
        self.table = ObservedTable(bench.table)
        self._patch = monkeypatch
        self.released = threading.Event()
        self.is_blocked = threading.Event()
        table = TableOrder(address=bench.table_address, armed=True)
        options = {"pose_seconds": 3.0, "turns": False}
        order = RunOrder(folder=folder, sources=bench.addresses, roles=ROLES, options=options, table=table)
        self.engine = Engine()
        self.engine.begin(RunFolder.begin(folder, "turntable", order), order)
        assert self.wait(lambda: self.table.told and self.table.told[-1] != "stop"), self.engine.trouble

    def wait(self, condition, longest=60.0):
        """Waits for a condition; returns whether it came to be."""
        until = clock.now() + longest
        while not condition() and clock.now() < until:
            clock.sleep(0.02)
        return condition()

    def is_stopped(self):
        return self.wait(lambda: self.table.told[-1:] == ["stop"], STOPPED_WITHIN)

    def block(self, owner, name):
        """Has a method wait for ever from now on."""
        original = getattr(owner, name)

        def blocked(*arguments, **named):
            self.is_blocked.set()
            clock.wait(self.released)
            return original(*arguments, **named)

        self._patch.setattr(owner, name, blocked)

    def fail(self, owner, name, error):
        """Has a method raise an error from now on."""

        def failing(*_arguments, **_named):
            self.is_blocked.set()
            raise error

        self._patch.setattr(owner, name, failing)

    def lose_all(self):
        """Has all sources be lost, and the hosts at which they are opened anew never answer."""
        self.fail(LineUnit, "read", LogError("the line was lost"))
        self.block(LineUnit, "__enter__")


@pytest.fixture
def run(tmp_path, monkeypatch):
    with watched(), simulated_bench(seed=45) as bench:
        found = Run(bench, tmp_path, monkeypatch)
        yield found
        found.released.set()
        found.engine.close()


BLOCKED = {
    "a source": lambda run: run.block(LineUnit, "read"),
    "the openers": Run.lose_all,
    "the disk": lambda run: run.block(SessionWriter, "flush"),
    "the view": lambda run: run.block(guided_run, "view_of"),
}


@pytest.mark.parametrize("what", BLOCKED)
def test_stop_needs_no_thread_that_waits_for_ever(run, what):
    BLOCKED[what](run)
    assert run.wait(run.is_blocked.is_set), (run.engine.state, run.engine.trouble, run.table.told)
    assert run.table.told[-1] != "stop"
    run.engine.pause()
    assert run.is_stopped()
    run.released.set()
    assert run.wait(lambda: run.engine.state == "paused")
    assert "goto" not in run.table.told[run.table.told.index("stop") :]


def test_error_stops_the_table_before_any_source_is_closed(run):
    run.block(LineUnit, "__exit__")
    run.fail(SessionWriter, "flush", OutputError("the disk is full"))
    assert run.wait(run.is_blocked.is_set), (run.engine.state, run.engine.trouble, run.table.told)
    assert run.is_stopped()


def test_error_needs_no_opener_that_waits_for_ever(run):
    run.lose_all()
    assert run.wait(run.is_blocked.is_set), (run.engine.state, run.engine.trouble, run.table.told)
    run.fail(SessionWriter, "flush", OutputError("the disk is full"))
    assert run.is_stopped()
    assert run.wait(lambda: run.engine.state == "error")


def test_a_bench_ends_whatever_its_run_waits_for(run):
    run.block(LineUnit, "read")
    assert run.wait(run.is_blocked.is_set), (run.engine.state, run.engine.trouble, run.table.told)
    began = clock.now()
    run.engine.close()
    assert clock.now() - began <= CLOSED_WITHIN + 1.0
    assert run.table.told[-1] == "stop"
