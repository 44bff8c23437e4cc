"""A live session always ends: with all that was asked for, with what there is, or in one line."""

from __future__ import annotations

import json
from functools import lru_cache

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

import tumble
from live_benches import simulated_bench, words_of
from ports import free_ports
from table_fixtures import Clock, NotingTable
from tumble.live import open_set
from tumble.procedures.turntable import live, table_drive
from tumble.procedures.turntable.live import LiveTurntable
from tumble.procedures.turntable.table_drive import TableDrive
from tumble.procedures.turntable.table_plan import turned_table
from tumble.tools.table.guarded import GuardedTable
from tumble.tools.table.simulated import PRESETS
from turntable_sessions import Pair, one_line, simulate, typed

UNITS = ("reference", "target_1")


@pytest.fixture(scope="module")
def replayed(tmp_path_factory):
    """Words that replay a session of six faces as fast as it can be read."""
    pair = Pair.make(simulate(71, grades=["tactical"], rate_hz=50.0), tmp_path_factory.mktemp("logs"))
    return [f"{name}=replay:{pair.folder / name}.csv?speed=max" for name in UNITS]


def session(words, folder, *options):
    return typed("turntable", "--live", *words, *options, "-o", folder)


# Sources that are gone


def test_bench_that_ends_first_is_reported_and_calibrated_so_far(tmp_path):
    with simulated_bench(seed=61, motion="six-faces", rest_seconds=6.0, duration_seconds=120.0) as bench:
        done = session(words_of(bench), tmp_path / "out", "--pose-seconds", "60s", "--no-turns", "--json")
        truth = bench.truth
    assert done.code == 3, done.err
    events = [json.loads(line) for line in done.out.splitlines()]
    warnings = [each["text"] for each in events if each["event"] == "warning"]
    assert any(text.startswith("no unit sends any more; the session ends after ") for text in warnings)
    [early] = [each["text"] for each in events if each["event"] == "ended early"]
    assert early.startswith("no unit has sent anything for ")
    assert early.endswith(
        "not shown long enough: X up, X down, Y up, Y down, Z up and Z down; go on with --resume"
    )
    found = yaml.safe_load((tmp_path / "out" / "target_1.yaml").read_text())
    true = np.array(truth["units"]["target_1"]["accelerometer"]["b"])
    assert np.abs(np.array(found["accelerometer"]["b"]) - true).max() < 0.03


def test_bench_that_ends_too_early_leaves_one_line_with_the_reason(tmp_path):
    with simulated_bench(seed=62, motion="six-faces", rest_seconds=6.0, duration_seconds=12.0) as bench:
        done = session(words_of(bench), tmp_path / "out", "--pose-seconds", "3s", "--no-turns")
    assert done.code == 2
    assert "reference: shows " in one_line(done.err.splitlines(keepends=True)[-1])


def test_units_that_never_send_are_not_waited_for_for_ever(tmp_path, simulated_clock):
    words = [f"{name}=udp://:{port}" for name, port in zip(UNITS, free_ports(2), strict=True)]
    done = session(words, tmp_path / "out")
    assert done.code == 2
    assert "there is nothing to calibrate, as no sample came of reference and target_1" in done.err
    assert (tmp_path / "out" / "session" / "session.yaml").is_file()


def test_sources_that_say_that_they_have_ended_are_not_waited_for(tmp_path, replayed):
    done = session(replayed, tmp_path / "out", "--pose-seconds", "100s")
    assert done.code == 3
    assert "Ended early: all sources have ended; not shown long enough: X up, " in done.err
    assert (tmp_path / "out" / "target_1.yaml").is_file()


def test_missing_poses_of_a_list_do_not_prevent_the_others(tmp_path, replayed):
    listed = tmp_path / "poses.yaml"
    more = tumble.Pose("tilted", np.array([0.0, 1.0, 1.0]))
    tumble.PoseList((*live.SIX_FACES, more)).save(listed)
    done = session(replayed, tmp_path / "out", "--pose-seconds", "2s", "--no-turns", "--poses", listed)
    assert done.code == 3, done.err
    assert "not shown long enough: tilted;" in done.err
    assert (tmp_path / "out" / "target_1.yaml").is_file()


# Goals


def test_unreachable_goal_is_reported_with_exit_code_3(tmp_path, monkeypatch):
    monkeypatch.setattr(live, "LONGEST_POSE", 1.0)
    with simulated_bench(seed=64, motion="six-faces", rest_seconds=6.0) as bench:
        done = session(
            words_of(bench), tmp_path / "out", "--pose-seconds", "3s", "--no-turns", "--until", "bias 1e-9"
        )
    assert done.code == 3, done.err
    assert "longer rests and more turns do not bring it there" in done.err
    found = yaml.safe_load((tmp_path / "out" / "target_1.yaml").read_text())
    assert found["method"]["options"]["sigma of accelerometer bias"] > 1e-9


def test_goal_unmet_at_the_end_of_a_recording_exits_3(tmp_path, replayed):
    done = session(replayed, tmp_path / "out", "--pose-seconds", "2s", "--no-turns", "--until", "bias 1e-9")
    assert done.code == 3
    assert "Ended early: all sources have ended; " in done.err


def test_a_session_that_reached_all_that_was_asked_for_ends_with_0(tmp_path, replayed):
    done = session(replayed, tmp_path / "out", "--pose-seconds", "2s", "--no-turns", "--until", "bias 1")
    assert done.code == 0, done.err


# A table goes on where it was


@lru_cache
def plan_of(preset, turns=True):
    return turned_table(f"simulated:{preset}", "", 5.0, live.SIX_FACES, turns).plan


def rotations(plan):
    """Every turn of a plan, there and back."""
    return [way * plan._rotation(*each) for each in plan.turns for way in (1.0, -1.0)]


@pytest.mark.parametrize("preset", ["two-axis", "three-axis"])
def test_executed_plan_leaves_nothing_and_an_unused_one_all(preset):
    plan = plan_of(preset)
    assert plan.axes == PRESETS[preset]
    assert len(plan.turns) > 2
    assert len(plan.left([True] * len(plan.angles), np.array(rotations(plan)))) == 0
    assert np.array_equal(plan.left([False] * len(plan.angles), np.empty((0, 3))), plan.route)


@settings(max_examples=30)
@given(st.data())
def test_rest_of_a_plan_holds_each_missing_rest_and_turn(data):
    plan = plan_of("two-axis")
    shown = data.draw(st.lists(st.booleans(), min_size=len(plan.angles), max_size=len(plan.angles)))
    everything = rotations(plan)
    kept = data.draw(st.sets(st.integers(0, len(everything) - 1)))
    askew = tumble._core.rotation_matrix(np.radians([4.0, -3.0, 5.0]))
    left = plan.left(shown, np.array([askew @ everything[number] for number in kept]).reshape(-1, 3))
    for angles, was_shown in zip(plan.angles, shown, strict=True):
        assert was_shown or any(np.array_equal(angles, each) for each in left)
    ends = [
        plan.angles[number] + np.eye(len(plan.axes))[turn.axis] * turn.angle for number, turn in plan.turns
    ]
    lacking = sum(any(np.allclose(end, each) for end in ends) for each in left)
    assert lacking <= len(plan.turns)
    assert lacking >= len(plan.turns) - len(kept) // 2


def test_stopped_table_session_resumes_with_the_missing_stops(tmp_path, monkeypatch):
    monkeypatch.setattr(table_drive, "MOST_PASSES", 1)
    went = []
    with simulated_bench(seed=63) as bench:

        def lead(resume, rest_count=None):
            plan = turned_table(bench.table_address, "", 3.0, live.SIX_FACES, False)
            with plan.entered() as driver:
                units = open_set(words_of(bench), keep_going=True)
                led = LiveTurntable(
                    units,
                    tmp_path / "out",
                    sources=bench.addresses,
                    poses=plan.poses,
                    pose_seconds=3.0,
                    turns=False,
                    driver=driver,
                    resume=resume,
                )
                for step in led.steps():
                    if step.kind == "pose wanted":
                        went.append(step.subject.partition(": ")[2])
                    # Poses before the one under way are shown: one just ticked may be short in the recording.
                    if sum(pose.seconds > 0.0 for pose in step.poses) == rest_count:
                        led.stop()
            return led

        stopped = lead(resume=False, rest_count=3)
        assert stopped.was_stopped
        went.clear()
        resumed = lead(resume=True)
    assert resumed.is_complete
    assert len(went) == len(live.SIX_FACES) - 2
    assert len(set(went)) == len(went)


def test_table_waits_at_a_stop_until_its_samples_have_come():
    clock = Clock()
    simulated = NotingTable(now=clock)
    plan = plan_of("two-axis", turns=False)
    with GuardedTable(simulated, armed=True) as guarded:
        drive = TableDrive(guarded, plan)

        def stops():
            return simulated.told.count("goto")

        for now in np.arange(0.0, 20.0, 0.5):
            clock.now += 0.5
            drive.advance(now, now + 10.0)
        assert stops() == 2, "the first stop is where the table is, and it rests there"
        # By now it is at the second one, but the samples still show units at rest where they were.
        for now in np.arange(20.0, 40.0, 0.5):
            clock.now += 0.5
            drive.advance(now, now + 10.0)
        assert stops() == 2
        for now in np.arange(40.0, 40.0 + plan.rest + 2.0, 0.5):
            drive.advance(now, now - 40.0)
        assert stops() == 3
