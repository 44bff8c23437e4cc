"""Poses are chosen for least sigma per minute, and visited in an order that wastes no time."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, permutations

import numpy as np
import pytest

import tumble
from table_fixtures import Clock
from tumble.foundation.errors import TableError
from tumble.foundation.recording import Recording
from tumble.tools.simulate.live.samples import NONE
from tumble.tools.simulate.live.scenario import LiveScenario
from tumble.tools.simulate.live.table_units import units_on
from tumble.tools.table.axes import AxisLimits, ups
from tumble.tools.table.motion import travel_time
from tumble.tools.table.plan import (
    EXACT,
    Goals,
    PosePlan,
    _exchanged_order,
    _travel,
    in_shortest_order,
    plan_poses,
    reachable,
)
from tumble.tools.table.simulated import PRESETS, SimulatedTable

TWO = PRESETS["two-axis"]
SIX = np.radians([[0, 0], [90, 0], [90, 90], [90, 180], [90, -90], [180, 0]])
REST = 4.0
SEED = 11


def six_faces(axes=TWO, rest=REST, **more):
    start = np.zeros(2)
    return PosePlan(tuple(axes), in_shortest_order(axes, SIX, start), start, rest, **more)


@pytest.fixture(scope="module")
def planned():
    return plan_poses(TWO, REST)


def slowed(rate_deg):
    """The two-axis table, its outer axis that slow."""
    outer, inner = TWO
    return replace(outer, limits=AxisLimits(np.radians(rate_deg), 1.0, outer.limits.angle)), inner


def test_the_six_faces_of_the_table_are_six_faces():
    assert np.allclose(np.abs(ups(TWO, SIX)).max(axis=1), 1.0)
    assert len(np.unique(np.round(ups(TWO, SIX)), axis=0)) == 6


def test_poses_beat_the_six_faces_in_sigma_per_minute(planned):
    assert planned.sigma_per_minute < 0.5 * six_faces().sigma_per_minute


def accelerometer_sigma_per_minute(plan):
    return np.sqrt(np.mean(np.square(plan.sigma[:12])) * plan.seconds / 60.0)


def test_poses_beat_six_faces_for_accelerometers_with_slow_travel():
    axes, rest = slowed(5.0), 1.0
    plan = plan_poses(axes, rest, gyroscope=False)
    assert accelerometer_sigma_per_minute(plan) < 0.9 * accelerometer_sigma_per_minute(six_faces(axes, rest))


def recorded(plan):
    """A reference and a target that a simulated table turned as planned."""
    clock = Clock()
    table = SimulatedTable(TWO, clock)
    scenario = LiveScenario(
        seed=SEED, rate_hz=100.0, grades=("reference", "consumer"), duration_seconds=plan.seconds + 10.0
    )
    session, feeds, noise = units_on(table, scenario, {})
    samples = dict.fromkeys(feeds, NONE)
    limits = [np.array([getattr(axis.limits, what) for axis in TWO]) for what in ("rate", "acceleration")]
    at = table.position()
    for stop in plan.route:
        table.goto(stop, *limits)
        clock.now += _travel(TWO, at, stop) + plan.rest
        samples = {name: samples[name].then(feed.until(clock.now)) for name, feed in feeds.items()}
        at = stop
    noise.close()
    recordings = {
        name: Recording.from_arrays(name, each.time, each.accelerometer, each.gyroscope)
        for name, each in samples.items()
    }
    return session, recordings, clock.now


def calibrated(plan):
    """Sigmas per minute that the estimator finds for the target's matrices, and errors over sigma."""
    session, recordings, seconds = recorded(plan)
    result = tumble.turntable(recordings["reference"], [recordings["target_1"]], poses=plan.poses())
    [target] = result.targets
    assert not target.failure, target.failure
    sigmas, errors = [], []
    for triad in ("accelerometer", "gyroscope"):
        found, truth = getattr(target, triad), getattr(session["target_1"], triad)
        sigma = np.sqrt(np.diagonal(found.covariance)[:9]).reshape(3, 3)
        sigmas.append(np.sqrt(np.mean(sigma**2) * seconds / 60.0))
        errors.append((found.M - truth.M) / sigma)
    return np.array(sigmas), np.array(errors)


def test_poses_beat_the_six_faces_in_a_simulated_session(planned):
    faces, plan = (calibrated(each) for each in (six_faces(), planned))
    assert np.all(plan[0][1] < 0.6 * faces[0][1]), (plan[0], faces[0])
    assert np.abs(plan[1]).max() < 5.0


def brute_force(axes, angles, start):
    stops = np.vstack([start, angles])
    between = [[_travel(axes, one, other) for other in stops] for one in stops]
    return min(
        sum(between[one][other] for one, other in pairwise((0, *order)))
        for order in permutations(range(1, len(stops)))
    )


def seconds_of(axes, angles, start):
    return sum(_travel(axes, one, other) for one, other in pairwise(np.vstack([start, angles])))


@pytest.mark.parametrize("name", ["two-axis", "three-axis"])
@pytest.mark.parametrize("seed", range(4))
def test_the_order_is_as_short_as_the_shortest_of_all(name, seed):
    axes = PRESETS[name]
    generator = np.random.default_rng(seed)
    angles = np.radians(generator.uniform(-180.0, 180.0, (6, len(axes))))
    start = np.zeros(len(axes))
    found = seconds_of(axes, in_shortest_order(axes, angles, start), start)
    assert found == pytest.approx(brute_force(axes, angles, start))


@pytest.mark.parametrize("seed", range(6))
def test_orders_of_many_poses_are_within_a_fifth_of_the_shortest(seed):
    generator = np.random.default_rng(seed)
    angles = np.radians(generator.uniform(-180.0, 180.0, (7, 2)))
    stops = np.vstack([np.zeros(2), angles])
    between = np.array([[_travel(TWO, one, other) for other in stops] for one in stops])
    order = _exchanged_order(between)
    assert sorted(order) == list(range(8))
    assert order[0] == 0
    assert sum(between[one, other] for one, other in pairwise(order)) <= 1.2 * brute_force(
        TWO, angles, np.zeros(2)
    )


def test_plan_is_within_a_fifth_of_the_shortest_and_on_time(planned):
    alone = replace(planned, turns=())
    assert len(planned.angles) <= EXACT
    shortest = brute_force(TWO, planned.angles, np.zeros(2))
    assert seconds_of(TWO, planned.angles, np.zeros(2)) <= 1.2 * shortest
    clock = Clock()
    table = SimulatedTable(TWO, clock)
    limits = [np.array([getattr(axis.limits, what) for axis in TWO]) for what in ("rate", "acceleration")]
    for stop in alone.route:
        table.goto(stop, *limits)
        clock.now = max(motion.end for motion in table._motions)
        assert np.allclose(table.position(), stop)
    assert clock.now == pytest.approx(alone.motion_seconds)


def test_every_pose_of_a_plan_is_within_limits_and_apart(planned):
    for number, axis in enumerate(TWO):
        low, high = axis.limits.angle or (-np.inf, np.inf)
        assert np.all((planned.route[:, number] >= low - 1e-9) & (planned.route[:, number] <= high + 1e-9))
    between = planned.ups @ planned.ups.T - 2.0 * np.eye(len(planned.ups))
    assert np.degrees(np.arccos(between.max())) > 25.0


def test_limits_of_angle_leave_only_what_can_be_reached():
    outer, inner = TWO
    low = replace(outer, limits=replace(outer.limits, angle=(-0.8, 0.8)))
    plan = plan_poses((low, inner), REST)
    assert plan.ups[:, 2].min() > np.cos(0.8) - 1e-9
    assert np.all(np.abs(plan.route[:, 0]) <= 0.8 + 1e-9)


def test_a_table_that_only_turns_about_the_vertical_is_refused():
    with pytest.raises(TableError, match="too few directions"):
        plan_poses(PRESETS["one-axis"], REST)


def test_better_sensors_need_fewer_seconds_for_the_same_sigma():
    goals = Goals()
    better = replace(goals, accelerometer_noise=0.5 * goals.accelerometer_noise)
    assert np.allclose(six_faces(goals=better).sigma[:12], 0.5 * six_faces(goals=goals).sigma[:12])


def test_directions_that_can_be_reached_are_each_listed_once():
    grid = reachable(TWO, 30.0)
    directions = np.round(ups(TWO, grid), 6) + 0.0
    assert len(np.unique(directions, axis=0)) == len(grid)
    assert travel_time(0.0, 1.0, 1.0) == 0.0
