"""A spin that a page guides leads the robot, and gives what the command gives on the recorded session."""

from __future__ import annotations

import math

import numpy as np
import pytest

from simulated_clock import SimulatedClock
from spin_sessions import record, still, turn
from tumble.live import open_source
from tumble.procedures.spin.guided_source import floor_from_case
from tumble.procedures.spin.live import LiveSpin, LiveSpinOptions
from tumble.tools.guided.order import RunOrder
from tumble.tools.guided.run import run_kind


def guided(folder, session, **options):
    """A run on a log of a robot, replayed as fast as can be."""
    path = folder / "robot.csv"
    header = "time_s,ax,ay,az,gx_rad/s,gy_rad/s,gz_rad/s"
    np.savetxt(path, session.table, delimiter=",", header=header, comments="", fmt="%.17g")
    order = RunOrder(
        folder=folder / "results",
        sources={"robot": f"replay:{path}?speed=max"},
        serials={"robot": "0815"},
        options=options,
    )
    return run_kind("spin").begin(order)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Views and outcome of a spin that went well, and its folder."""
    folder = tmp_path_factory.mktemp("spin")
    with SimulatedClock():
        spin = guided(folder, record([still(6.0), turn(2.5)], seed=1))
        return list(spin.views()), spin.outcome(), folder / "results"


def test_robot_is_asked_to_stand_then_to_turn_and_turns_are_ticked(run):
    views, _, _ = run
    assert str(views[0].instruction) == "Let the robot stand still."
    wanted = next(view for view in views if view.kind == "wanted")
    assert str(wanted.instruction) == "Turn on the spot."
    turned = [view.checks[1].items for view in views]
    assert [item.done for item in turned[0]] == [False, False]
    shares = [sum(item.share for item in items) for items in turned]
    assert shares == sorted(shares)
    assert all(item.done for item in turned[-1])
    assert views[-1].kind == "done"


def test_outcome_is_that_of_the_live_command_on_the_session(run):
    _, outcome, folder = run
    typed = f"replay:{folder / 'session'}:robot?speed=max"
    source = open_source(typed)
    live = LiveSpin(source, LiveSpinOptions(), typed=typed, serial="0815")
    with source:
        assert [step.kind for step in live.steps()][-1] == "done"
    again = live.result()
    (unit,) = outcome.units
    assert (outcome.verdict, unit.word, unit.serial) == ("passed", again.verdict, "0815")
    found = {each.name: (each.value, each.sigma) for each in unit.furthest}
    biases = [
        *again.accelerometer_bias.parameters("accelerometer"),
        *again.gyroscope_bias.parameters("gyroscope"),
    ]
    assert found
    assert found.items() <= {each.name: (each.value, each.sigma) for each in biases}.items()
    assert unit.calibration.exists()
    assert unit.page.exists()


@pytest.mark.usefixtures("simulated_clock")
def test_spin_that_fails_has_an_outcome_with_its_reason(tmp_path):
    spin = guided(tmp_path, record([still(6.0), turn(0.4)], seed=2))
    views = list(spin.views())
    assert views[-1].kind == "ended early"
    outcome = spin.outcome()
    assert outcome.verdict == "not observable"
    assert str(outcome.units[0].reasons[0]) == str(views[-1].warning)
    assert "samples stopped" in str(views[-1].warning)


@pytest.mark.usefixtures("simulated_clock")
def test_stopped_spin_keeps_its_recording_and_the_next_has_its_own(tmp_path):
    session = record([still(6.0), turn(2.5)], seed=3)
    spin = guided(tmp_path, session)
    views = spin.views()
    next(view for view in views if view.kind == "progress")
    spin.stop()
    assert list(views)[-1].kind == "ended early"
    assert str(spin.outcome().units[0].reasons[0]) == "stopped"
    assert [view.kind for view in guided(tmp_path, session).views()][-1] == "done"
    assert (tmp_path / "results/session").exists()
    assert (tmp_path / "results/session-2/robot.parquet").exists()


@pytest.mark.parametrize("seed", range(5))
def test_attitude_brings_what_points_up_to_the_vertical(seed):
    random = np.random.default_rng(seed)
    up = random.normal(size=3)
    up /= np.linalg.norm(up)
    heading = random.uniform(-10.0, 10.0)
    w, *vector = floor_from_case(up, heading)
    axis = np.array(vector)
    turned = up + 2.0 * np.cross(axis, np.cross(axis, up) + w * up)
    assert np.allclose(turned, [0.0, 0.0, 1.0], atol=1e-12)
    assert math.isclose(w * w + float(axis @ axis), 1.0)
