"""The benchmark of live sessions on a table: what it holds them against is right."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks import live_table
from benchmarks.bound import TRIADS

from table_fixtures import Clock
from tumble.poses.pose_list import SIX_FACES
from tumble.procedures.turntable.table_plan import planned
from tumble.tools.table.simulated import PRESETS, SimulatedTable

MOST_SIGMAS = 5.0


def test_true_rests_are_where_no_axis_turns():
    clock = Clock()
    table = SimulatedTable(PRESETS["two-axis"], clock)
    for number in range(3):
        clock.now = 10.0 * number
        table.goto(np.array([0.5 * number, 0.0]), np.full(2, 0.5), np.full(2, 0.5))
    rests = live_table.rests_between(table, 0.0, 30.0)
    # Half a radian at half a radian a second and second: two seconds.
    assert rests == pytest.approx(np.array([[0.0, 10.0], [12.0, 20.0], [22.0, 30.0]]), abs=0.01)


def test_no_plan_beats_the_shortest_and_the_session_uses_it():
    plan, *_ = planned(PRESETS["two-axis"], 5.0, SIX_FACES, turns=True)
    shortest = live_table.shortest_motion(plan)
    assert plan.motion_seconds == pytest.approx(shortest)
    backwards = type(plan)(plan.axes, plan.angles[::-1], plan.start, plan.rest)
    assert backwards.motion_seconds >= live_table.shortest_motion(backwards) - 1e-9


def test_session_without_sockets_finds_the_truth_within_its_sigmas(monkeypatch):
    monkeypatch.setattr(live_table, "POSE_SECONDS", 2.0)
    monkeypatch.setattr(live_table, "TARGETS", 1)
    session = live_table.without_sockets(77)
    for triad in TRIADS:
        [outcome] = session.outcomes[triad]
        assert (np.abs(outcome.error) < MOST_SIGMAS * outcome.sigma).all()
        assert (np.abs(outcome.best) < MOST_SIGMAS * outcome.bound).all()
    assert session.moved == pytest.approx(live_table.shortest_motion(session.plan), rel=0.01)
