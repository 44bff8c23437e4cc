"""Turns at constant rate: planned for every direction of the units, within the limits, and carried out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from table_fixtures import Clock
from tumble.foundation.errors import TableError
from tumble.poses.pose_list import SIX_FACES
from tumble.procedures.turntable.table_drive import TableDrive
from tumble.procedures.turntable.table_plan import planned
from tumble.tools.table import GuardedTable
from tumble.tools.table.axes import body_motion
from tumble.tools.table.bounds import parse_limits
from tumble.tools.table.plan import PosePlan
from tumble.tools.table.rate_runs import Sweep, plan_rates, seconds_of_runs
from tumble.tools.table.simulated import PRESETS, SimulatedTable
from turntable_sessions import one_line

RATES = np.radians([10.0, 30.0, 60.0])


def direction(axes, run):
    """Unit vector in the frame of the plate about which a run turns."""
    speed = np.zeros((1, len(axes)))
    speed[0, run.axis] = 1.0
    turned, _ = body_motion(axes, run.start[np.newaxis], speed, np.zeros_like(speed))
    return turned[0]


@pytest.mark.parametrize(("preset", "rank"), [("one-axis", 1), ("two-axis", 3), ("three-axis", 3)])
def test_runs_show_every_direction_that_the_table_can_show(preset, rank):
    axes = PRESETS[preset]
    runs = plan_rates(axes, RATES, 20.0)
    for rate in RATES:
        shown = [direction(axes, run) for run in runs if run.rate == rate]
        assert np.linalg.matrix_rank(np.array(shown), tol=0.5) == rank
        assert sorted(run.rate for run in runs).count(rate) == sorted(run.rate for run in runs).count(-rate)


@settings(max_examples=50)
@given(
    st.sampled_from(sorted(PRESETS)),
    st.lists(st.floats(0.5, 400.0), min_size=1, max_size=4, unique=True),
    st.floats(4.0, 60.0),
    st.sampled_from(["", "rate=25,acceleration=10", "outer.angle=-20..45", "rate=5"]),
)
def test_runs_are_within_all_limits_or_refused_in_one_line(preset, rates, seconds, limits):
    if "outer" in limits and preset == "one-axis":
        limits = ""
    axes = GuardedTable(SimulatedTable(PRESETS[preset]), parse_limits(limits, PRESETS[preset])).axes
    try:
        runs = plan_rates(axes, np.radians(rates).tolist(), seconds)
    except TableError as error:
        one_line(f"tumble: error: {error}\n")
        return
    for run in runs:
        limit = axes[run.axis].limits
        assert abs(run.rate) <= limit.rate * (1.0 + 1e-9)
        assert run.seconds <= seconds
        if isinstance(run, Sweep):
            assert run.seconds >= 4.0
            low, high = limit.angle
            assert low - 1e-9 <= min(run.start[run.axis], run.end[run.axis])
            assert max(run.start[run.axis], run.end[run.axis]) <= high + 1e-9
        else:
            assert limit.angle is None


@pytest.mark.parametrize("rates", [[-10.0], [0.0], [10.0, 10.0], [math.inf], [math.nan]])
def test_rates_that_are_none_are_refused(rates):
    with pytest.raises(TableError, match="each rate once, above zero"):
        plan_rates(PRESETS["two-axis"], np.radians(rates).tolist(), 20.0)


def test_a_rate_beyond_every_axis_is_named():
    with pytest.raises(TableError, match="no axis holds 500 deg/s for 4 s"):
        plan_rates(PRESETS["two-axis"], np.radians([10.0, 500.0]).tolist(), 20.0)


def drive_through(axes, runs, plan=None, step=0.05):
    """Carries out a plan and its runs; times (n,), angles and rates (n, axes) of the table."""
    clock = Clock()
    simulated = SimulatedTable(axes, clock)
    with GuardedTable(simulated, armed=True) as table:
        drive = TableDrive(table, plan or planned(axes, 2.0, SIX_FACES, turns=True)[0], runs)
        still_since, aims = 0.0, []
        while not drive.is_done:
            moving = np.any(simulated.states(np.array([clock.now]))[1] != 0.0)
            still_since = clock.now if moving else still_since
            drive.advance(clock.now, None if moving else clock.now - still_since)
            aims += [drive.aim] if drive.aim not in aims[-1:] else []
            clock.now += step
            assert clock.now < 4000.0
        times = np.arange(0.0, clock.now, step)
        return times, *simulated.states(times)[:2], aims


@pytest.mark.parametrize("preset", ["two-axis", "three-axis"])
def test_a_drive_holds_every_rate_for_as_long_as_planned(preset):
    axes = PRESETS[preset]
    runs = plan_rates(axes, RATES, 10.0)
    times, angles, rates, aims = drive_through(axes, runs)
    step = times[1] - times[0]
    for run in runs:
        planned_seconds = sum(
            other.seconds for other in runs if (other.axis, other.rate) == (run.axis, run.rate)
        )
        held = np.count_nonzero(np.abs(rates[:, run.axis] - run.rate) < 1e-9) * step
        assert held >= planned_seconds - 10.0 * step * len(runs)
    assert f"{axes[-1].name} at -60 deg/s" in " ".join(aims)
    whole_turns = [axis.limits.angle is None for axis in axes]
    # Runs of both signs cancel: no motion afterwards takes turns back.
    assert np.all(np.abs(angles[-1][whole_turns]) < 4.0 * math.tau)


def test_rates_of_one_axis_follow_each_other_without_a_rest():
    axes = PRESETS["one-axis"]
    runs = plan_rates(axes, RATES, 5.0)
    times, _, rates, _ = drive_through(axes, runs, PosePlan(axes, np.empty((0, 1)), np.zeros(1), 2.0))
    rates = rates[:, 0]
    first, last = np.nonzero(rates)[0][[0, -1]]
    # A sign changes through zero.
    assert np.count_nonzero(rates[first:last] == 0.0) <= len(runs) // 2
    assert times[-1] == pytest.approx(seconds_of_runs(axes, runs), rel=0.2)
