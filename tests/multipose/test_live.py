"""A live session by hand leads from orientation to orientation, and gives what its recording gives."""

from __future__ import annotations

import dataclasses
import json
import math
import re
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tumble
from live_benches import simulated_bench, words_of
from patience import PATIENCE
from ports import free_port
from tumble.foundation.errors import ProcedureError
from tumble.foundation.goal import Goal
from tumble.foundation.recording import Chunk
from tumble.live import open_set
from tumble.poses.by_hand import natural, orientation_words
from tumble.procedures.multipose.guide import OrientationGuide
from tumble.procedures.multipose.held import HeldRests, rests_by_hand
from tumble.procedures.multipose.live import LiveMultipose
from tumble.tools.simulate import LiveFault, LiveSimulation
from turntable_sessions import one_line, typed

G = 9.80665
HAND = {"motion": "hand", "grades": ("tactical",)}
DATES = re.compile(r"\d{4}-\d{2}-\d{2}T[\d:.]+Z")
MOST_SIGMAS = 6.0


def hand(**changes):
    return simulated_bench(**{**HAND, **changes})


def session_on(bench, folder, **options):
    return LiveMultipose(
        open_set(words_of(bench), keep_going=True), folder, sources=bench.addresses, held=3.0, **options
    )


def led(bench, session):
    """All steps of a session whose hand follows the instructions."""
    for step in session.steps():
        if step.kind == "orientation wanted":
            bench.hand.go_to(step.up)
        yield step


def events_of(done):
    return [json.loads(line) for line in done.out.splitlines()]


def off_in_sigmas(found, truth):
    """Errors of bias and scale of the accelerometer over their sigmas."""
    true = truth["accelerometer"]
    values = {each.name: each for each in found.accelerometer.parameters}
    off = [
        (values[f"bias {axis}"].value - true["b"][k]) / values[f"bias {axis}"].sigma
        for k, axis in enumerate("xyz")
    ]
    length = np.linalg.norm(np.array(truth["own_axes"]["accelerometer"]), axis=1)
    off += [
        (values[f"scale {axis}"].value - length[k]) / values[f"scale {axis}"].sigma
        for k, axis in enumerate("xyz")
    ]
    return np.array(off)


# Where to turn


def test_natural_orientations_are_each_requested_once_before_a_repeat():
    guide, asked = OrientationGuide(3.0), []
    guide.rest(G * natural()[0], 3.0)
    for _ in range(25):
        asked.append(guide.wanted)
        guide.motion()
        assert guide.rest(G * guide.wanted, 3.0)
    ups = np.array([natural()[0], *asked])
    assert len(np.unique(np.round(ups, 6), axis=0)) == 26
    assert guide.orientations == 26


def test_a_rest_counts_once_and_only_when_it_is_long_enough():
    guide = OrientationGuide(3.0)
    assert [guide.rest(G * natural()[0], seconds) for seconds in (1.0, 2.9, 3.0, 4.0)] == [
        False,
        False,
        True,
        False,
    ]
    guide.motion()
    assert guide.rest(G * natural()[0], 3.0)
    assert (guide.rests, guide.orientations) == (2, 1)


@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3))
def test_words_name_the_axis_nearest_to_the_vertical_and_its_tilt(up):
    length = math.hypot(*up)
    if length < 1e-3:
        return
    up = np.array(up) / length
    main = int(np.argmax(np.abs(up)))
    words = orientation_words(up)
    assert words.startswith(f"{'xyz'[main]} {'up' if up[main] > 0.0 else 'down'}")
    tilt = math.degrees(math.acos(min(1.0, abs(up[main]))))
    told = re.search(r"tilted by (\d+) deg so that ([+-])([xyz])", words)
    assert (told is None) == (tilt < 10.0) or tilt == pytest.approx(10.0)
    if told is not None:
        assert float(told[1]) == pytest.approx(tilt, abs=0.51)
        risen = up["xyz".index(told[3])]
        assert risen == 0.0 or (risen > 0.0) == (told[2] == "+")


def rest_in_hand(random, begins, turning=0.0):
    """Five s of a unit in a hand that trembles and turns evenly about the vertical, rad/s."""
    time = begins + np.arange(500) / 100.0
    shake = 0.04 * np.sin(2.0 * np.pi * 8.0 * time)[:, None] * np.ones(3)
    up = random.normal(size=3)
    up /= np.linalg.norm(up)
    force = G * up + 0.05 * shake + 0.02 * random.normal(size=(500, 3))
    return Chunk(time, force, shake + turning * up + 1e-3 * random.normal(size=(500, 3)))


def test_a_slow_turn_about_the_vertical_is_no_rest_beside_others():
    random, held = np.random.default_rng(51), HeldRests()
    print("seed 51")
    for begins in (0.0, 10.0, 20.0):
        rest = rest_in_hand(random, begins)
        assert rest.time[-1] - held.since(rest) > 4.0
        held.keep(rest)
    turned = rest_in_hand(random, 30.0, turning=0.1)
    assert HeldRests().since(turned) < turned.time[0] + 1.0
    assert held.since(turned) == turned.time[-1]


def test_longer_of_overlapping_rests_counts():
    rest = rest_in_hand(np.random.default_rng(52), 0.0)
    print("seed 52")
    [(start, end)] = rests_by_hand(rest, np.array([[1.0, 2.5]]))
    assert start < 0.5
    assert end > 4.5
    assert rests_by_hand(rest, np.array([[0.0, 4.99]])) == [(0.0, 4.99)]


# Closed over a real socket


class TremblingFeed:
    """A unit in a hand that trembles all the time, about each axis, by 0.05 deg at 8 Hz."""

    def __init__(self, feed):
        self._feed = feed

    def until(self, now):
        samples = self._feed.until(now)
        amplitude, omega = np.radians(0.05), 2.0 * np.pi * 8.0
        phase = omega * samples.taken[:, None] + np.array([0.3, 2.1, 4.4])
        angle, rate = amplitude * np.sin(phase), amplitude * omega * np.cos(phase)
        pushed = np.cross(-(omega**2) * angle, [0.1, 0.05, 0.03])
        force = samples.accelerometer - np.cross(angle, samples.accelerometer) + pushed
        return dataclasses.replace(samples, accelerometer=force, gyroscope=samples.gyroscope + rate)


def tremble(monkeypatch):
    quiet = LiveSimulation._feed_in_hand

    def trembling(bench, stack, faults):
        return {name: TremblingFeed(feed) for name, feed in quiet(bench, stack, faults).items()}

    monkeypatch.setattr(LiveSimulation, "_feed_in_hand", trembling)


def test_rests_in_a_trembling_hand_count_as_in_the_recording(monkeypatch, tmp_path):
    tremble(monkeypatch)
    with hand(seed=50, rate_hz=200.0, told=True) as bench:
        session = session_on(bench, tmp_path, orientations=12, duration=150.0)
        steps, ticks = [], []
        for step in led(bench, session):
            steps.append(step)
            if step.kind == "rest done":
                ticks.append(session._time)
        assert steps[-1].kind == "done"
        assert len(ticks) >= 12
        found = tumble.multipose(session.session)
        used = [(rest.start, rest.end) for rest in found.rests if rest.used]
        print(ticks, used)
        assert found.trembling == len(used) == len(ticks)
        assert found.directions == steps[-1].orientations
        resumed = session_on(bench, tmp_path, orientations=12, resume=True)
        assert (resumed.guide.rests, resumed.guide.orientations) == (len(ticks), steps[-1].orientations)


def test_hand_that_follows_requests_reaches_the_goal_and_the_truth(tmp_path):
    with hand(seed=41, told=True) as bench:
        session = session_on(bench, tmp_path, goal=Goal.parse("bias 0.004, scale 0.05 %"))
        steps = list(led(bench, session))
        truth = bench.truth
    assert steps[-1].kind == "done"
    assert session.is_reached
    assert all(goal.ratio <= 1.0 for goal in steps[-1].goals)
    counts = [step.orientations for step in steps if step.kind == "rest done"]
    assert counts == sorted(counts)
    found = tumble.multipose(session.session, g_sensitivity=True)
    assert found.verdict == "calibrated"
    assert found.directions == steps[-1].orientations
    assert np.abs(off_in_sigmas(found, truth)).max() < MOST_SIGMAS


def test_the_recording_gives_what_the_live_session_gave_to_the_bit(tmp_path):
    with hand(seed=42, rest_seconds=4.0) as bench:
        done = typed(
            *("multipose", "--live", bench.addresses["imu"], "--orientations", "12", "--pose-seconds", "3s"),
            *("-o", tmp_path / "live", "--operator", "Ada", "--json"),
        )
    assert done.code == 0, done.err
    events = events_of(done)
    assert [each["event"] for each in events if each["event"] in ("listening", "done", "result")] == [
        "listening",
        "done",
        "result",
    ]
    assert typed("multipose", tmp_path / "live" / "session", "-o", tmp_path / "again").code == 0
    [one], [other] = ((tmp_path / name).glob("*.multipose.yaml") for name in ("live", "again"))
    assert one.name == other.name
    assert DATES.sub("", one.read_text()) == DATES.sub("", other.read_text())
    assert "operator: Ada" in one.read_text()


def test_a_session_that_was_stopped_goes_on_where_it_was(tmp_path):
    with hand(seed=43, told=True) as bench:
        session = session_on(bench, tmp_path, orientations=12)
        for step in led(bench, session):
            if step.kind == "rest done" and step.orientations == 4:
                session.stop()
        assert step.kind == "done"
        with pytest.raises(ProcedureError, match=r"shows [34] orientations"):
            tumble.multipose(session.session)
        again = session_on(bench, tmp_path, orientations=12, resume=True)
        steps = list(led(bench, again))
    assert next(step for step in steps if step.kind == "rest done").orientations >= 4
    assert sum(step.kind == "rest done" for step in steps) < 12
    assert tumble.multipose(again.session).directions >= 12


def test_unreached_goal_is_reported_with_exit_code_3(monkeypatch, tmp_path):
    gone = LiveFault("unplugged", start=75.0, end=1e6)
    with hand(seed=44, rest_seconds=4.0, faults={"imu": [gone]}) as bench:
        done = typed(
            *("multipose", "--live", bench.addresses["imu"], "--until", "bias 1e-6", "--pose-seconds", "3s"),
            *("-o", tmp_path),
        )
    assert done.code == 3, done.err
    assert "; accelerometer bias has a sigma of" in done.err
    assert "and 1e-06 were asked for; go on with --resume" in done.err
    assert list(tmp_path.glob("*.multipose.yaml"))


def test_insufficient_session_is_one_line_with_the_recording_place(tmp_path):
    with hand(seed=45, told=True) as bench:
        done = typed("multipose", "--live", bench.addresses["imu"], "--duration", "1s", "-o", tmp_path)
    assert done.code == 2
    last = done.err.splitlines()[-1]
    assert last.startswith("tumble: error: imu: shows ") or "tumble: error: udp-" in last
    assert f"what was recorded is in {tmp_path / 'session'}" in last
    assert "--resume" in last


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--live", "--raw"], "--raw is for recordings"),
        (["--live", "--faces"], "--faces, --sections and --pose-means are for recordings"),
        (["--live", "--until", "mounting 0.1"], "nothing shows how the accelerometer is mounted"),
        (["--live", "--until", "bias 3 %"], "expected [accelerometer|gyroscope]"),
        (["--live", "--orientations", "1001"], "--orientations 1001: give 1 to 1000"),
        (["--until", "bias 0.1"], "--until is for a unit that is read live"),
        (["--duration", "3s"], "--duration is for a unit that is read live"),
    ],
)
def test_impossible_request_is_refused_in_one_line_and_leaves_nothing(options, said, tmp_path):
    done = typed("multipose", *options, "udp://:9", "-o", tmp_path / "out")
    assert done.code == 2
    assert said in one_line(done.err)
    assert list(tmp_path.iterdir()) == []


def test_sigmas_are_stated_in_the_units_of_the_report_or_in_per_cent():
    terms = Goal.parse("bias 0.003 m/s^2, scale 0.02 %, gyroscope bias 1e-4 rad/s").terms
    assert [(each.name, each.sigma) for each in terms] == [
        ("accelerometer bias", 0.003),
        ("accelerometer scale", pytest.approx(2e-4)),
        ("gyroscope bias", 1e-4),
    ]


# Faults of the unit


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (LiveFault("frozen", start=20.0, end=30.0), "is frozen: it repeats one reading"),
        (LiveFault("unplugged", start=20.0, end=30.0), "is silent; check its power and cable"),
    ],
)
def test_fault_of_the_unit_is_reported_at_once(fault, said, monkeypatch, tmp_path):
    with hand(seed=46, rest_seconds=4.0, faults={"imu": [fault]}) as bench:
        session = session_on(bench, tmp_path, orientations=10)
        for step in session.steps():
            if step.kind == "warning":
                break
    assert step.text.startswith(said)
    assert step.orientations < 10


def test_an_orientation_in_which_the_unit_was_away_is_asked_for_again(monkeypatch, tmp_path):
    away = LiveFault("unplugged", start=12.0, end=16.0)
    with hand(seed=49, told=True, faults={"imu": [away]}) as bench:
        asked, broken = [], None
        session = session_on(bench, tmp_path, orientations=10)
        for step in led(bench, session):
            if step.kind == "orientation wanted":
                asked.append(step.subject)
            elif step.kind == "warning" and step.text.startswith("is silent"):
                broken = len(asked)
    assert broken is not None
    assert asked[broken] == asked[broken - 1]
    assert session.is_reached


def test_unit_gone_for_good_ends_the_session_with_the_data_so_far(monkeypatch, tmp_path):
    fault = LiveFault("unplugged", start=30.0, end=1e6)
    with hand(seed=47, rest_seconds=4.0, faults={"imu": [fault]}) as bench:
        steps = list(session_on(bench, tmp_path).steps())
    assert steps[-1].kind == "ended early"
    assert "no unit has sent anything" in steps[-1].text
    assert "go on with --resume" in steps[-1].text


def test_frozen_readings_are_left_out_and_reported():
    made = tumble.simulate_multipose(seed=48, grade="tactical", rate_hz=50.0)
    samples = made.unit.samples
    frozen = (samples.time > 30.0) & (samples.time < 45.0)
    held = int(np.argmax(frozen))
    force, rate = samples.accelerometer.copy(), samples.gyroscope.copy()
    force[frozen], rate[frozen] = force[held], rate[held]
    found = tumble.multipose(
        tumble.Recording.from_arrays("frozen", samples.time, force, rate), g_sensitivity=True
    )
    assert any("stood still from 30.0 to 45.0 s" in line for line in found.warnings)
    assert not any(rest.start < 44.0 and rest.end > 31.0 for rest in found.rests if rest.used)
    scale = np.linalg.norm(made.force_matrix, axis=1)
    shown = {each.name: each for each in found.accelerometer.parameters}
    for axis, true in zip("xyz", scale, strict=True):
        assert abs(shown[f"scale {axis}"].value - true) < MOST_SIGMAS * shown[f"scale {axis}"].sigma


COMMAND = [sys.executable, "-c", "from tumble.cli.main import main; main()"]


def test_session_and_simulated_hand_on_a_pipe_finish_together(tmp_path):
    port = str(free_port())
    session = subprocess.Popen(
        [
            *COMMAND,
            *("multipose", "--live", f"udp://:{port}?clock-rate=8", "--orientations", "10"),
            *("--pose-seconds", "2s", "--g-sensitivity", "-o", str(tmp_path / "out"), "--json"),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    bench = subprocess.run(
        [
            *COMMAND,
            *("simulate", "live", "--motion", "hand", "--told", "--port", port, "--speed", "8"),
            *("--rate", "100", "--seed", "7", "-o", str(tmp_path / "bench")),
        ],
        stdin=session.stdout,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    _, said = session.communicate(timeout=PATIENCE)
    assert session.returncode == 0, said.decode()
    assert bench.returncode == 0, bench.stderr
    assert list((tmp_path / "out").glob("*.multipose.yaml"))
