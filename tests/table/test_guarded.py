"""A guarded table never goes beyond a limit, and is stopped on every way out."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from table_fixtures import Clock, NotingTable
from tumble.foundation.errors import TableError
from tumble.tools.table import GuardedTable
from tumble.tools.table.bounds import parse_limits
from tumble.tools.table.simulated import PRESETS, SimulatedTable

pytestmark = pytest.mark.usefixtures("simulated_clock")

TWO = PRESETS["two-axis"]
FIGURES = st.floats(-400.0, 400.0) | st.sampled_from([-185.0, 185.0, 60.0, 180.0, 0.0, np.nan, np.inf])
COMMANDS = st.one_of(
    st.tuples(st.just("goto"), FIGURES, FIGURES, FIGURES, FIGURES),
    st.tuples(st.just("rate"), FIGURES, FIGURES, FIGURES, FIGURES),
    st.tuples(st.just("wait"), st.floats(0.0, 20.0)),
    st.tuples(st.just("stop")),
)


def attempt(table, clock, command):
    name, *figures = command
    if name == "wait":
        clock.now += figures[0]
    elif name == "stop":
        table.stop()
    elif name == "goto":
        table.goto(np.radians(figures[:2]), np.radians(figures[2:]))
    else:
        table.rate(np.radians(figures[:2]), np.radians(figures[2:]))


@settings(max_examples=150)
@given(st.lists(COMMANDS, max_size=12), st.sampled_from(["", "rate=25,outer.angle=-30..45,acceleration=200"]))
def test_no_sequence_of_commands_ever_passes_a_limit(commands, limits):
    clock = Clock()
    simulated = SimulatedTable(TWO, clock)
    with GuardedTable(simulated, parse_limits(limits, TWO), armed=True) as table:
        for command in commands:
            try:
                attempt(table, clock, command)
            except TableError:
                continue
        angles, rates, accelerations = simulated.states(np.linspace(0.0, clock.now + 30.0, 20_000))
        for number, axis in enumerate(table.axes):
            low, high = axis.limits.angle or (-np.inf, np.inf)
            assert angles[:, number].min() >= low - 1e-6
            assert angles[:, number].max() <= high + 1e-6
            assert np.abs(rates[:, number]).max() <= axis.limits.rate * (1.0 + 1e-6)
            assert np.abs(accelerations[:, number]).max() <= max(
                axis.limits.acceleration * (1.0 + 1e-6), TWO[number].limits.acceleration
            )


def test_commands_within_limits_are_obeyed():
    clock = Clock()
    simulated = SimulatedTable(TWO, clock)
    with GuardedTable(simulated, armed=True) as table:
        clock.now += table.goto(np.radians([90.0, -270.0]))
        assert table.settled()
        assert np.allclose(np.degrees(table.position()), [90.0, -270.0])
        table.rate(np.radians([0.0, 30.0]))
        clock.now += 100.0
        assert np.degrees(table.position())[1] > 2000.0


class BrokenError(Exception):
    """Something that no driver should raise."""


WAYS_OUT = {
    "the end of the block": None,
    "an error": BrokenError(),
    "Ctrl-C": KeyboardInterrupt(),
    "a mistake of the user": TableError("mistake"),
    "the end of the program": SystemExit(3),
}


@pytest.mark.parametrize("way", WAYS_OUT)
def test_the_table_is_stopped_on_every_way_out(way):
    table, error = NotingTable(), WAYS_OUT[way]

    def use():
        with GuardedTable(table, armed=True) as guarded:
            guarded.goto(np.radians([10.0, 0.0]))
            if error is not None:
                raise error

    if error is None:
        use()
    else:
        with pytest.raises(type(error)):
            use()
    assert table.told[-1] == "stop"
    assert table.left


@pytest.mark.parametrize("failing", ["enable", "goto", "settled", "position"])
@pytest.mark.parametrize("error", [TableError("no answer"), OSError("line lost"), KeyboardInterrupt()])
def test_silent_or_refusing_table_is_stopped_and_moves_no_more(failing, error):
    table = NotingTable()
    with GuardedTable(table, armed=True) as guarded:
        if failing != "enable":
            guarded.goto(np.radians([0.0, 1.0]))
            guarded.wait()
        table.fails = {failing: error}
        told = len(table.told)
        with pytest.raises(type(error)):
            guarded.goto(np.radians([0.0, 2.0]))
        assert "stop" in table.told[told:]
        table.fails = {}
        with pytest.raises(TableError, match="stopped after an error"):
            guarded.goto(np.radians([0.0, 2.0]))


@settings(max_examples=60)
@given(st.lists(COMMANDS, max_size=6), st.sampled_from(["enable", "goto", "rate", "settled", "position"]))
def test_after_any_failure_the_last_command_to_the_table_is_stop(commands, failing):
    clock = Clock()
    table = NotingTable(now=clock)
    calls = {
        "enable": table.enable,
        "goto": lambda: table.goto(np.zeros(2), np.ones(2), np.ones(2)),
        "rate": lambda: table.rate(np.zeros(2), np.ones(2)),
        "settled": table.settled,
        "position": table.position,
    }

    def use():
        with GuardedTable(table, armed=True) as guarded:
            for command in commands:
                try:
                    attempt(guarded, clock, command)
                except TableError:
                    continue
            table.fails = {failing: BrokenError()}
            guarded._guarded(calls[failing])

    with pytest.raises(BrokenError):
        use()
    assert table.told[-1] == "stop"


def test_unanswered_stop_is_reported_loudly():
    table = NotingTable(fails={"stop": TableError("no answer")})
    with pytest.raises(TableError, match="EMERGENCY STOP"), GuardedTable(table, armed=True):
        pass
    assert table.told == ["stop", "stop"]


def test_a_motion_that_does_not_end_in_time_stops_the_table(monkeypatch):
    clock = Clock()
    table = NotingTable(now=clock)
    monkeypatch.setattr("tumble.tools.table.guarded.AT_LEAST", 0.0)
    monkeypatch.setattr("tumble.tools.table.guarded.PATIENCE", 0.0)
    with GuardedTable(table, armed=True) as guarded:
        guarded.goto(np.radians([10.0, 0.0]))
        with pytest.raises(TableError, match="has not settled in time"):
            guarded.wait()
        assert table.told[-1] == "stop"


class StrayTable(NotingTable):
    """Reports the end of each motion to angles, but stands elsewhere."""

    def __init__(self, off_deg, clock):
        super().__init__(now=clock)
        self.off = np.radians(off_deg)

    def position(self):
        return super().position() + self.off


@pytest.mark.parametrize("off_deg", [[15.0, 0.0], [0.0, -100.0], [-0.6, 0.0], [np.nan, 0.0]])
def test_a_table_at_rest_beside_its_angle_is_stopped(monkeypatch, off_deg):
    monkeypatch.setattr("tumble.tools.table.guarded.AT_LEAST", 0.0)
    monkeypatch.setattr("tumble.tools.table.guarded.PATIENCE", 0.0)
    clock = Clock()
    table = StrayTable([0.0, 0.0], clock)
    with GuardedTable(table, armed=True) as guarded:
        clock.now += guarded.goto(np.radians([90.0, 30.0]))
        table.off = np.radians(off_deg)
        with pytest.raises(TableError, match=r"instead of 90 deg|instead of 30 deg|beyond its limits"):
            guarded.wait()
        assert table.told[-1] == "stop"


@pytest.mark.parametrize("off_deg", [[0.4, -0.4], [0.0, 720.0], [0.0, -360.0]])
def test_servo_errors_and_whole_turns_are_arrivals(off_deg):
    clock = Clock()
    table = StrayTable([0.0, 0.0], clock)
    with GuardedTable(table, armed=True) as guarded:
        clock.now += guarded.goto(np.radians([90.0, 30.0]))
        table.off = np.radians(off_deg)
        assert guarded.settled()


def test_a_done_flag_that_is_set_before_the_motion_is_awaited():
    class Early(NotingTable):
        def settled(self):
            return True

    clock = Clock()
    with GuardedTable(Early(now=clock), armed=True) as guarded:
        took = guarded.goto(np.radians([90.0, 0.0]))
        assert not guarded.settled()
        clock.now += took
        assert guarded.settled()


def test_a_table_that_swings_beyond_its_limits_is_stopped():
    clock = Clock()
    table = NotingTable(now=clock)
    limits = parse_limits("outer.angle=-20..20", TWO)
    with GuardedTable(table, limits, armed=True) as guarded:
        table.move(slice(None), np.radians([30.0, 0.0]), np.ones(2), np.ones(2))
        clock.now += 60.0
        with pytest.raises(TableError, match="beyond its limits"):
            guarded.settled()
        assert table.told[-1] == "stop"


def test_without_arms_nothing_is_sent_but_a_stop_that_is_asked_for():
    table, said = NotingTable(), []
    with GuardedTable(table, say=said.append) as guarded:
        guarded.goto(np.radians([90.0, 0.0]))
        guarded.rate(np.radians([0.0, 10.0]))
        with pytest.raises(TableError, match="allowed are"):
            guarded.goto(np.radians([190.0, 0.0]))
        assert table.told == []
        guarded.stop()
    assert table.told == ["stop"]
    assert [line.split()[:2] for line in said] == [["would", "go"], ["would", "turn"]]


PROGRAM = """
    import signal, sys
    sys.path.insert(0, "tests/support")
    import numpy as np
    from table_fixtures import NotingTable
    from tumble.tools.table import GuardedTable

    class Loud(NotingTable):
        def stop(self):
            super().stop()
            print("stopped", flush=True)

    with GuardedTable(Loud(), armed=True) as table:
        table.goto(np.radians([170.0, 0.0]), np.radians([1.0, 1.0]))
        print("moving", flush=True)
        signal.pause()
"""


@pytest.mark.parametrize("which", ["SIGTERM", "SIGINT", "SIGHUP", "SIGQUIT"])
def test_a_signal_that_ends_the_program_stops_the_table(which):
    program = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(PROGRAM)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert program.stdout.readline() == "moving\n"
        os.kill(program.pid, getattr(signal, which))
        assert program.stdout.readline() == "stopped\n"
        assert program.wait(20) != 0
    finally:
        program.kill()
        program.wait()
        program.stdout.close()


@pytest.mark.parametrize(
    ("limits", "problem"),
    [
        ("rate", "expected"),
        ("rate=-1", "expected"),
        ("middle.rate=1", "no axis 'middle'"),
        ("outer.angle=20..10", "expected"),
        ("outer.speed=20", "expected"),
    ],
)
def test_limits_that_are_none_are_refused_in_one_line(limits, problem):
    with pytest.raises(TableError, match=problem):
        parse_limits(limits, TWO)


class BlockedTable(NotingTable):
    """Leaves a question unanswered until it is released."""

    def __init__(self):
        super().__init__()
        self.is_asked, self.is_released = threading.Event(), threading.Event()

    def settled(self):
        self.is_asked.set()
        self.is_released.wait()
        return super().settled()


def test_halt_needs_no_thread_that_uses_the_line():
    table, raised = BlockedTable(), []

    def ask(guarded):
        try:
            guarded.settled()
            guarded.settled()
        except TableError as error:
            raised.append(str(error))

    with GuardedTable(table, armed=True) as guarded:
        asking = threading.Thread(target=ask, args=(guarded,))
        asking.start()
        table.is_asked.wait()
        guarded.halt()
        assert table.told == ["stop"]
        table.is_released.set()
        asking.join()
        assert "was stopped; arm it again" in raised[0]
        with pytest.raises(TableError, match="was stopped"):
            guarded.goto(np.radians([10.0, 0.0]))
    guarded.halt()
    assert table.told == ["stop", "stop"], "a table that was left needs no stop"
