"""The screen of a live session: faces with ticks, turns, the table, units, and sigma against the goal."""

from __future__ import annotations

import io
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from tumble.cli.live_screen import event_of
from tumble.foundation.goal import Goal, GoalProgress
from tumble.poses.pose_list import SIX_FACES
from tumble.procedures.turntable.command_live_screen import drawn, prompt
from tumble.procedures.turntable.live import PoseProgress, TurnProgress, TurntableStep, UnitAtPose, UnitState

[BIAS] = Goal.parse("bias 0.001").terms
FACES = tuple(pose.name for pose in SIX_FACES)


def screen(step):
    """Lines of a terminal of 140 columns."""
    console = Console(file=io.StringIO(), record=True, width=140)
    console.print(drawn(step))
    return console.export_text().splitlines()


def step(done=(), **changes):
    poses = tuple(PoseProgress(name, 10.0 if name in done else 4.0, 10.0, name in done) for name in FACES)
    usual = {
        "kind": "progress",
        "elapsed": 1.0,
        "poses": poses,
        "turns": (),
        "units": (),
        "goals": (),
        "at": "",
    }
    return TurntableStep(**{**usual, **changes})


@given(st.permutations(FACES), st.integers(0, 6))
def test_exactly_the_finished_faces_are_ticked_in_any_order(order, count):
    done = order[:count]
    shown = "\n".join(screen(step(done)))
    for face in FACES:
        assert (f"[✓] {face}" in shown) == (face in done)
        assert (f"[ ] {face}" in shown) == (face not in done)
    assert shown.count("10 of 10 s") == count
    assert shown.count("████░░░░░░") == 6 - count


def test_each_target_has_its_own_tick_at_each_pose():
    units = (UnitAtPose("target_1", 10.0, done=True), UnitAtPose("target_2", 4.0, done=False))
    pose = PoseProgress("X up", 4.0, 10.0, done=False, units=units)
    lines = [line.strip("│ ") for line in screen(step(poses=(pose,)))]
    assert {"[ ] X up", "4 of 10 s", "[✓] target_1", "[ ] target_2"} <= set(lines)
    [told] = event_of(step(poses=(pose,)))["poses"]
    assert [(unit["name"], unit["done"]) for unit in told["units"]] == [
        ("target_1", True),
        ("target_2", False),
    ]


def test_a_pose_that_is_asked_for_again_says_for_whom():
    again = step(kind="pose wanted", subject="X up", text="target_1 missed it")
    assert prompt(again) == "Go to X up, and let it stand still again: target_1 missed it."
    assert prompt(step(kind="pose wanted", subject="X up")) == "Go to X up, and let it stand still."


def test_turns_are_counted_and_ticked():
    turns = (TurnProgress("+x", 1, 1, done=True), TurnProgress("-x", 0, 2, done=False))
    assert "turns  [✓] +x 1/1  [ ] -x 0/2" in screen(step(turns=turns))
    assert not any(line.startswith("turns") for line in screen(step()))


def test_the_screen_says_where_a_table_is_or_goes():
    assert "table  stop 2 of 6: outer 90, inner 0 deg" in screen(
        step(table="stop 2 of 6: outer 90, inner 0 deg")
    )
    assert not any(line.startswith("table") for line in screen(step()))


@pytest.mark.parametrize(
    ("condition", "said"),
    [
        ("waiting", "waiting"),
        ("rest", "still"),
        ("motion", "moves"),
        ("silent", "SILENT"),
        ("lost", "LOST"),
    ],
)
def test_each_unit_has_a_line_with_what_it_does_and_its_rate(condition, said):
    [line] = [
        line for line in screen(step(units=(UnitState("target_1", condition, 99.97),))) if "target_1" in line
    ]
    assert line.split() == ["target_1", said, "99.97", "Hz"]


@pytest.mark.parametrize(
    ("sigma", "line"),
    [
        (0.0042, "[ ] accelerometer bias 0.0042 of 0.001 m/s^2"),
        (0.0009, "[✓] accelerometer bias 0.0009 of 0.001 m/s^2"),
        (math.inf, "[ ] accelerometer bias: not shown yet, 0.001 wanted"),
    ],
)
def test_goal_shows_the_reached_sigma_against_the_wanted_one(sigma, line):
    assert line in screen(step(goals=(GoalProgress(BIAS, "m/s^2", sigma, "target_1"),)))


def test_an_event_of_json_holds_what_the_screen_shows():
    event = event_of(step(("X up",), kind="ended early", text="why", table="stop 1 of 2"))
    assert (event["event"], event["text"], event["table"]) == ("ended early", "why", "stop 1 of 2")
    assert [pose["name"] for pose in event["poses"] if pose["done"]] == ["X up"]
    assert (
        prompt(step(kind="ended early", text="all sources have ended"))
        == "Ended early: all sources have ended."
    )
