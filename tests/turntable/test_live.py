"""A live session leads through poses and turns, warns of units, and gives what its recording gives."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

import tumble
from live_benches import simulated_bench, words_of
from tumble.foundation.errors import ProcedureError
from tumble.foundation.goal import Goal
from tumble.live import open_set
from tumble.poses.pose_list import SIX_FACES
from tumble.procedures.turntable.guide import REST_AFTER_TURN, SHORTEST_TURN, Guide, WantedPose, WantedTurn
from tumble.procedures.turntable.live import LiveTurntable
from tumble.procedures.turntable.slips import Visit, exchanges, slips
from tumble.tools.record.writer import SessionWriter
from tumble.tools.simulate.live.fault import LiveFault
from turntable_sessions import contents, one_line, typed

G = 9.80665
DATES = re.compile(rb"\d{4}-\d{2}-\d{2}T[\d:.]+Z")


def events_of(done):
    return [json.loads(line) for line in done.out.splitlines()]


def session_on(bench, folder, **options):
    units = open_set(words_of(bench), keep_going=True)
    return LiveTurntable(units, folder, sources=bench.addresses, **{"turns": False, **options})


# Requests to the user


@given(st.permutations(range(6)), st.permutations(range(6)))
def test_poses_and_turns_are_ticked_once_in_any_order(faces, turns):
    guide = Guide.of(SIX_FACES, 5.0, turns=True)
    ticked = []
    for face in faces:
        for seconds in (1.0, 4.9, 5.0, 6.0):
            ticked += guide.rest(G * SIX_FACES[face].up, seconds)
        guide.motion()
    assert [each.name for each in ticked if isinstance(each, WantedPose)] == [
        SIX_FACES[face].name for face in faces
    ]
    for turn in turns:
        angle = np.zeros(3)
        angle[turn // 2] = (1 if turn % 2 == 0 else -1) * SHORTEST_TURN
        guide.motion()
        guide.turn(angle)
        assert isinstance(guide.wanted, WantedTurn)
        ticked += guide.rest(G * SIX_FACES[0].up, REST_AFTER_TURN)
    names = [each.name for each in ticked if isinstance(each, WantedTurn)]
    assert sorted(names) == ["+x", "+y", "+z", "-x", "-y", "-z"]
    assert guide.wanted is None


def test_disturbed_rest_goes_on_and_one_off_all_poses_does_not_count():
    guide = Guide.of(SIX_FACES, 5.0, turns=False)
    assert list(guide.rest(G * SIX_FACES[4].up, 3.0)) == []
    guide.motion()
    [done] = guide.rest(G * SIX_FACES[4].up, 2.5)
    assert (done.name, done.seconds) == ("Z up", 5.5)
    guide.motion()
    tipped = np.array([0.0, math.sin(math.radians(30.0)), math.cos(math.radians(30.0))])
    assert list(guide.rest(G * tipped, 60.0)) == []
    assert guide.at is None
    assert guide.tip == pytest.approx(30.0)
    assert guide.nearest == "Z up"


def test_a_goal_is_read_in_the_units_of_the_report():
    goal = Goal.parse("bias 0.001, gyroscope scale 1e-4, mounting 0.01")
    assert [(each.name, each.sigma, each.needs_turns) for each in goal.terms] == [
        ("accelerometer bias", 0.001, False),
        ("gyroscope scale", 1e-4, True),
        ("accelerometer mounting", 0.01, False),
    ]


@pytest.mark.parametrize(
    "text", ["", "bias", "bias 0", "bias -1", "drift 0.1", "bias 1 2", "bias 1,", "bias nan"]
)
def test_invalid_goal_is_refused(text):
    with pytest.raises(ProcedureError, match="--until"):
        Goal.parse(text)


# Detection of slipped units


def visits_with(random, change):
    """Two rounds of the six faces, table errors up to 2 deg; in the second the readings are changed."""
    matrices = {name: np.eye(3) + 0.02 * random.standard_normal((3, 3)) for name in ("target_1", "target_2")}
    biases = {name: 0.1 * random.standard_normal(3) for name in matrices}
    visits = []
    for number in range(2):
        for pose in SIX_FACES:
            force = G * pose.up + 0.2 * random.standard_normal(3)
            force *= G / np.linalg.norm(force)
            shown = {name: matrices[name] @ force + biases[name] for name in matrices}
            if number == 1:
                shown = change(shown)
            visits.append(Visit(pose.name, float(len(visits)), force, shown))
    return visits, matrices


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_unchanged_units_are_not_reported_as_slipped(seed):
    visits, matrices = visits_with(np.random.default_rng(seed), lambda shown: shown)
    assert list(slips(visits, matrices, G)) == []


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.floats(1.5, 10.0))
def test_unit_that_turned_in_its_fixture_is_named_and_no_other(seed, angle):
    tilt = math.radians(angle)
    turned = np.array([[1, 0, 0], [0, math.cos(tilt), -math.sin(tilt)], [0, math.sin(tilt), math.cos(tilt)]])
    visits, matrices = visits_with(
        np.random.default_rng(seed), lambda shown: shown | {"target_2": turned @ shown["target_2"]}
    )
    found = list(slips(visits, matrices, G))
    assert {each.target for each in found} == {"target_2"}
    assert {each.other for each in found} == {""}
    assert max(each.angle for each in found) == pytest.approx(angle, rel=0.2)


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_two_units_that_changed_places_are_both_named(seed):
    def swapped(shown):
        return {"target_1": shown["target_2"], "target_2": shown["target_1"]}

    visits, matrices = visits_with(np.random.default_rng(seed), swapped)
    found = {(each.target, each.other) for each in slips(visits, matrices, G)}
    assert found == {("target_1", "target_2"), ("target_2", "target_1")}


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(2, 10))
def test_exchanged_plugs_are_dated_without_a_pose_that_came_again(seed, since):
    visits, _ = visits_with(np.random.default_rng(seed), lambda shown: shown)
    crossed = [
        replace(visit, targets=dict(zip(visit.targets, reversed(visit.targets.values()), strict=True)))
        for visit in visits[since:]
    ]
    [found] = exchanges([*visits[:since], *crossed], ["target_1", "target_2"])
    assert found.since.time == float(since)


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.floats(0.001, 0.3))
def test_noisy_units_and_loose_ones_are_not_called_exchanged(seed, sigma):
    rng = np.random.default_rng(seed)

    def loose(shown):
        return shown | {"target_2": shown["target_2"] + rng.normal(0.0, 1.0, 3)}

    def noisy(shown):
        return {name: each + rng.normal(0.0, sigma, 3) for name, each in shown.items()}

    visits, _ = visits_with(rng, loose)
    shaken = [replace(visit, targets=noisy(visit.targets)) for visit in visits]
    assert list(exchanges(shaken, ["target_1", "target_2"])) == []


# The loop


def test_closed_loop_with_a_table_equals_the_recording_to_the_bit(tmp_path):
    with simulated_bench(seed=41) as bench:
        done = typed(
            "turntable",
            "--live",
            *words_of(bench),
            *("--table", bench.table_address, "--armed", "--poses", "six-faces", "--pose-seconds", "3s"),
            *(
                "--until",
                "bias 0.005, non-orthogonality 0.1",
                "--operator",
                "A. Person",
                "--station",
                "north",
            ),
            *("-o", tmp_path / "live", "--json"),
        )
        truth = bench.truth
    assert done.code == 0, done.err
    events = events_of(done)
    kinds = [each["event"] for each in events]
    assert kinds[0] == "listening"
    assert kinds[-2:] == ["done", "result"]
    assert {each["subject"] for each in events if each["event"] == "pose done"} >= {
        pose.name for pose in SIX_FACES
    }
    assert [each["text"] for each in events if each["event"] == "warning"] == []
    assert all(goal["sigma"] <= goal["wanted"] for goal in events[-2]["goals"])

    again = typed("turntable", tmp_path / "live" / "session", "-o", tmp_path / "again")
    assert again.code == 0, again.err
    for name in ("target_1.yaml", "target_2.yaml"):
        live, logged = ((tmp_path / folder / name).read_bytes() for folder in ("live", "again"))
        assert DATES.sub(b"", live) == DATES.sub(b"", logged)
        found = yaml.safe_load(live)
        options = found["method"]["options"]
        assert options["goal"] == "bias 0.005, non-orthogonality 0.1"
        assert options["table"] == bench.table_address
        assert 0.0 < options["sigma of accelerometer bias"] <= 0.005
        assert (found["operator"], found["station"]) == ("A. Person", "north")
        true = np.array(truth["units"][name.removesuffix(".yaml")]["accelerometer"]["b"])
        assert np.abs(np.array(found["accelerometer"]["b"]) - true).max() < 0.03


def test_a_table_that_is_not_armed_prints_its_plan_and_moves_nothing(tmp_path):
    done = typed(
        *("turntable", "--live", "reference=udp://:45871", "target_1=udp://:45872"),
        *("--table", "simulated:two-axis", "--poses", "six-faces", "--pose-seconds", "3s", "-o", tmp_path),
    )
    assert done.code == 0, done.err
    assert "tumble: stop 1 of " in done.err
    assert re.search(r"rests of 4 s and \d+ s of motion: [\d.]+ min", done.err)
    assert done.err.rstrip().endswith("nothing moved, as it is not --armed")
    assert contents(tmp_path) == {}


def test_a_unit_that_is_loose_is_named_while_the_session_goes_on(tmp_path):
    slip = LiveFault("moved", start=75.0, size=3.0)
    with simulated_bench(seed=42, faults={"target_2": [slip]}) as bench:
        done = typed(
            "turntable",
            "--live",
            *words_of(bench),
            *("--table", bench.table_address, "--armed", "--poses", "six-faces", "--pose-seconds", "3s"),
            *("-o", tmp_path / "live", "--json"),
        )
    warnings = [each for each in events_of(done) if each["event"] == "warning"]
    assert {each["subject"] for each in warnings} == {"target_2"}
    assert any("loose" in each["text"] and "fasten it" in each["text"] for each in warnings)


def test_killed_session_resumes_and_is_calibrated_as_one(tmp_path, monkeypatch):
    with simulated_bench(seed=43, motion="six-faces", rest_seconds=6.0) as bench:
        killed = session_on(bench, tmp_path, pose_seconds=3.0)
        steps = killed.steps()
        ticked = [next(step for step in steps if step.kind == "pose done").subject for _ in range(3)]
        for _ in range(8):
            next(steps)
        with monkeypatch.context() as kill:
            # A killed process leaves only the data on disk: nothing is joined, and the session has no end.
            writer = killed._recorder._writer
            writer._write(writer._taken())
            kill.setattr(SessionWriter, "finish", lambda *_: None)
            killed.stop()
            list(steps)
        resumed = session_on(bench, tmp_path, pose_seconds=3.0, resume=True)
        assert [each.name for each in resumed.guide.poses if each.is_done] == ticked
        list(resumed.steps())
        assert resumed.is_complete
        truth = bench.truth
    found = tumble.turntable(
        f"{resumed.session}:reference", [f"{resumed.session}:target_{number}" for number in (1, 2)]
    )
    assert len(found.poses) == len(SIX_FACES)
    for target in found:
        true = np.array(truth["units"][target.name.partition("-")[2] or target.name]["accelerometer"]["b"])
        assert np.abs(target.accelerometer.b - true).max() < 0.03


# Mistakes


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["a=udp://:45871", "b=udp://:45872"],
            "no unit 'reference'; name one so, or say --reference NAME, one of a, b",
        ),
        (["reference=udp://:45871"], "no target was given"),
        (
            ["reference=udp://:45871", "b=udp://:45872", "--armed"],
            "--armed lets a table move; name it with --table",
        ),
        (
            ["reference=udp://:45871", "b=udp://:45872", "--poses", "none"],
            "--poses none: a live session has to know",
        ),
        (["reference=udp://:45871", "b=udp://:45872", "--until", "bias"], "--until bias: expected"),
        (["reference=udp://:45871", "b=udp://:45872", "--table", "none"], "no driver 'none'"),
    ],
)
def test_mistakes_in_what_is_typed_are_one_line(tmp_path, words, said):
    done = typed("turntable", "--live", *words, "-o", tmp_path / "out")
    assert done.code == 2
    assert said in one_line(done.err)


def test_live_option_is_refused_with_recordings(tmp_path):
    done = typed("turntable", "a.csv", "b.csv", "--until", "bias 0.1", "-o", tmp_path)
    assert done.code == 2
    assert "--until is for units that are read live" in one_line(done.err)
