"""`tumble table` as it is typed."""

from __future__ import annotations

import json
import signal

import pytest

from table_fixtures import served
from tumble.tools.table import GuardedTable
from turntable_sessions import one_line, typed

pytestmark = pytest.mark.usefixtures("simulated_clock")


def test_a_table_is_sent_to_angles_and_says_where_it_is():
    with served("scpi") as (address, _):
        done = typed("table", "goto", "30,-60", "--table", address, "--armed", "--json")
        assert done.code == 0, done.err
        assert json.loads(done.out)["position_deg"] == pytest.approx(
            {"outer": 30.0, "inner": -60.0}, abs=1e-3
        )
        assert "this profile is untested" in done.err
        done = typed("table", "position", "--table", address)
        assert done.out.splitlines() == ["outer: 30.0000 deg", "inner: -60.0000 deg"]


@pytest.mark.parametrize("words", [["-90,0"], ["--", "-90,0"]])
def test_angles_may_begin_with_a_minus(words):
    done = typed("table", "goto", "--table", "simulated:two-axis", "--armed", *words)
    assert done.code == 0
    assert done.out.splitlines()[0] == "outer: -90.0000 deg"
    done = typed("table", "goto", "-.5,-0.25", "--table", "simulated:two-axis", "--speed", "5,5")
    assert "outer -0.5, inner -0.25 deg" in done.out


def test_nothing_moves_without_arms():
    with served("scpi") as (address, _):
        done = typed("table", "goto", "30,-60", "--table", address)
        assert done.code == 0
        assert done.out.startswith("would go to outer 30, inner -60 deg")
        assert "0.0000" in typed("table", "position", "--table", address).out


def test_a_table_turns_at_a_rate_for_a_while():
    with served("scpi") as (address, simulated):
        done = typed("table", "rate", "0,90", "--for", "5", "--table", address, "--armed")
        assert done.code == 0, done.err
        assert simulated.position()[1] != 0.0
        assert typed("table", "stop", "--table", address).out == "stopped\n"


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("goto", "200,0"), "allowed are -185 to 185"),
        (("goto", "10,0", "--speed", "61,1"), "allowed are 60"),
        (("goto", "10,0", "--acceleration", "61,1"), "allowed are 60"),
        (("goto", "10,0", "--table-limits", "outer.angle=-5..5"), "allowed are -5 to 5"),
        (("goto", "10"), "needs a number for each of outer, inner"),
        (("goto", "ten,0"), "needs a number for each of outer, inner"),
        (("goto", "10,0", "--speed", "0,1"), "above zero"),
        (("rate", "10,0"), "limits of angle"),
    ],
)
def test_motion_beyond_a_limit_is_one_line_and_is_not_made(words, problem):
    done = typed("table", *words, "--table", "simulated:two-axis", "--armed")
    assert done.code == 2
    assert problem in one_line(done.err)


@pytest.mark.parametrize("seconds", ["nan", "inf", "-1", "1e20", "1e300"])
def test_a_time_that_is_none_moves_nothing(seconds, monkeypatch):
    monkeypatch.setattr("tumble.tools.table.simulated.SimulatedTable.__enter__", None)
    done = typed("table", "rate", "36", "--for", seconds, "--table", "simulated:one-axis", "--armed")
    assert done.code == 2
    assert "--for" in one_line(done.err)


def test_a_table_that_was_stopped_meanwhile_is_an_error(monkeypatch):
    with served("scpi") as (address, _):
        monkeypatch.setattr(GuardedTable, "wait", lambda self: self._stop_at_the_end(signal.SIGTSTP))
        done = typed("table", "rate", "0,5", "--for", "0", "--table", address, "--armed")
    assert done.code == 2
    assert "was stopped, as the program was to end or to be suspended" in done.err
