"""Refusals of unusable logs by `tumble spin`: a line with place, cause and remedy; no file changes."""

from __future__ import annotations

import re

import numpy as np
import pytest

import tumble
from spin_sessions import drive, record, still, turn
from turntable_sessions import contents, one_line, typed

GOOD = (still(), turn(3), still())


def refused(session, folder, *options, header="time,ax,ay,az,gx,gy,gz", named=True):
    """The one line for a log, beside results of an earlier run, which stay as they are."""
    log = session.write(folder / "robot.csv", header)
    out = folder / "out"
    out.mkdir()
    (out / "robot.spin.yaml").write_text("schema: tumble-calibration/1\n")
    before = contents(out)
    done = typed("spin", log, "-o", out, *options)
    assert done.code == 2, f"exit code {done.code}: {done.out}{done.err}"
    assert done.out == ""
    assert contents(out) == before
    line = one_line(done.err)
    assert not named or line.startswith("robot: ") or "robot.csv" in line, f"the log is not named: {line}"
    return line


def lifted(session):
    """Taken off the floor and put down again: a second of acceleration up, then down."""
    part = session.during(1, 0.5, 0.55)
    push = 4.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, part.sum()))
    session.accelerometer[part] += np.outer(push, session.robot.up)


def over_a_sill(session):
    """One wheel goes up and down: half a second of roll and back."""
    part = session.during(1, 0.5, 0.53)
    roll = 0.6 * np.sin(np.linspace(0.0, 2.0 * np.pi, part.sum()))
    session.gyroscope[part] += np.outer(roll, session.robot.case_from_floor[:, 0])


def carried(session):
    """Turned in the hand about every axis."""
    part = session.during(1)
    time = session.time[part]
    session.gyroscope[part] = np.column_stack([np.sin(1.1 * time), np.cos(0.7 * time), np.sin(0.9 * time)])


def beyond_the_range(session):
    session.gyroscope[:] = np.clip(session.gyroscope, -0.9, 0.9)


@pytest.mark.parametrize(
    ("corrupt", "parts"),
    [
        (lifted, ["was lifted", "m/s^2", "on its wheels"]),
        (over_a_sill, ["about more than one axis", "rad/s", "sills"]),
        (carried, ["across the vertical"]),
        (beyond_the_range, ["gyroscope z is saturated at 0.9 rad/s", "turn more slowly"]),
    ],
    ids=["lifted", "over a sill", "carried", "gyroscope saturated"],
)
def test_disturbance_of_the_robot_is_reported(tmp_path, corrupt, parts):
    session = record(GOOD, 51)
    corrupt(session)
    line = refused(session, tmp_path)
    for part in parts:
        assert part in line


PUSH = drive(1.5, speed=0.5, turns=0.03, vibration=0.5)


def test_robot_moved_during_its_rest_must_rest_again(tmp_path):
    line = refused(record((still(1.5), PUSH, still(1.5), turn(3)), 75), tmp_path)
    assert "drove: reached about 0.5 m/s" in line
    assert "stood still for 1.3 s at most, 2 s are asked for" in line


def test_robot_moved_before_a_long_rest_is_calibrated_by_that_rest(tmp_path):
    session = record((still(3), PUSH, still(4), turn(3)), 76)
    log = session.write(tmp_path / "robot.csv")
    done = typed("spin", log, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert "Not used: 2.9 to 4.6 s drove" in done.text
    found = tumble.Calibration.load(tmp_path / "out/robot.spin.yaml")
    for triad in ("accelerometer", "gyroscope"):
        section, truth = getattr(found, triad), getattr(session.robot, f"{triad}_bias")
        assert np.all(np.abs(section.b - truth) < 5.0 * section.sigma.bias)


def test_time_of_a_mishap_is_reported(tmp_path):
    session = record(GOOD, 52)
    lifted(session)
    start, end = session.spans[1]
    line = refused(session, tmp_path)
    said = float(re.search(r"at (\d+\.\d) s", line)[1])
    assert said == pytest.approx(0.5 * (start + end), abs=1.0)


def test_accelerometer_saturated_in_a_turn_is_reported(tmp_path):
    session = record((still(), turn(6, 6.0), still()), 53, lever_arm=(0.6, 0.0, 0.0), rate_hz=200.0)
    session.accelerometer[:, 0] = np.clip(session.accelerometer[:, 0], -19.6133, 19.6133)
    line = refused(session, tmp_path)
    assert "accelerometer x is saturated at -19.61 m/s^2" in line
    assert "larger range" in line


def test_floor_beyond_the_limit_is_reported_with_its_tilt(tmp_path):
    line = refused(record(GOOD, 54, floor_tilt=12.0), tmp_path)
    assert "floor tilts by 12.0 deg" in line
    assert "10.0 deg are allowed" in line


def test_too_few_samples_for_the_speed_are_refused_with_the_number(tmp_path):
    line = refused(record((still(), turn(6, 3.0), still()), 55, rate_hz=5.0), tmp_path)
    assert "5 samples a second are too few" in line
    assert "10.9 are needed; log faster or turn more slowly" in line


def test_missing_samples_are_reported_with_time_and_length(tmp_path):
    session = record(GOOD, 56)
    kept = ~session.during(1, 0.5, 0.53)
    for name in ("time", "accelerometer", "gyroscope", "heading"):
        setattr(session, name, getattr(session, name)[kept])
    line = refused(session, tmp_path)
    assert "samples are missing for 0.59 s" in line
    assert "at 15.7 s" in line


@pytest.mark.parametrize(
    ("moves", "parts"),
    [
        ((still(20),), ["did not turn", "turn on the spot once round or more"]),
        ((still(), turn(0.06, 0.5), still()), ["turned only 2"]),
        ((still(), drive(vibration=0.3), still()), ["drove or was pushed", "stand still"]),
        ((turn(5, 1.0, unevenness=0.6),), ["no rest"]),
        ((turn(3), still()), ["before it had stood still"]),
        (
            (still(), drive(20, speed=2.0, turns=0.8, vibration=0.3), still()),
            ["drove"],
        ),
    ],
    ids=["stood", "hardly turned", "drove", "never stood", "turned first", "drove a bend"],
)
def test_robot_off_the_plan_gets_instructions(tmp_path, moves, parts):
    line = refused(record(moves, 57), tmp_path)
    for part in parts:
        assert part in line


def test_fewer_turns_than_asked_for_are_refused_with_both_numbers(tmp_path):
    session = record(GOOD, 58)
    line = refused(session, tmp_path, "--turns", 5)
    assert "3.00 turns" in line
    assert "5.00 turns were asked for" in line


def test_requested_number_of_turns_suffices_despite_inexact_stops(tmp_path):
    log = record((still(), turn(2.99), still()), 59).write(tmp_path / "robot.csv")
    assert typed("spin", log, "-o", tmp_path / "out", "--turns", 3).code == 0


def test_a_log_that_stops_half_way_is_used_if_what_is_there_is_enough(tmp_path):
    session = record(GOOD, 60).part(until=15.0)
    log = session.write(tmp_path / "robot.csv")
    assert typed("spin", log, "-o", tmp_path / "out").code == 0


def test_a_log_that_stops_before_what_was_asked_for_is_refused(tmp_path):
    line = refused(record(GOOD, 61).part(until=15.0), tmp_path, "--turns", 3)
    assert "3.00 turns were asked for" in line


def test_a_log_cut_in_the_middle_of_a_line_is_refused(tmp_path):
    log = record(GOOD, 62).write(tmp_path / "robot.csv")
    log.write_text(log.read_text()[:-90])
    done = typed("spin", log, "-o", tmp_path / "out")
    assert done.code == 2
    assert "cut short" in one_line(done.err)


@pytest.mark.parametrize("still_for", ["10", "10s", "10 s", "10000ms"])
def test_a_rest_shorter_than_asked_for_is_refused_with_both_times(tmp_path, still_for):
    line = refused(record(GOOD, 63), tmp_path, "--still", still_for)
    assert "stood still for 5.8 s at most, 10 s are asked for" in line


def test_requested_rest_suffices_though_its_ends_are_left_out(tmp_path):
    log = record(GOOD, 64).write(tmp_path / "robot.csv")
    assert typed("spin", log, "-o", tmp_path / "out", "--still", "6s").code == 0


@pytest.mark.parametrize(
    ("turns", "parts"),
    [
        ("4", ["3.00 times counter-clockwise", "truly 4 times"]),
        ("-3", ["0.00 times clockwise", "truly 3 times"]),
        ("three", ["'three'", "+3 counter-clockwise"]),
        ("+3,+3", ["'+3,+3'"]),
        ("0", ["'0'"]),
        ("inf", ["'inf'"]),
    ],
)
def test_true_turns_that_cannot_be_are_refused(tmp_path, turns, parts):
    log = record(GOOD, 65).write(tmp_path / "robot.csv")
    done = typed("spin", log, "-o", tmp_path / "out", "--true-turns", turns)
    assert done.code == 2
    line = one_line(done.err)
    for part in parts:
        assert part in line


@pytest.mark.parametrize(
    ("times", "part"),
    [
        (["100:120"], "outside the log, which lasts 31"),
        (["5:2"], "ends before it begins"),
        (["1:20", "10:30"], "overlaps that from 10 s"),
        (["1-20"], "START:END"),
        (["0:5.5"], "did not turn"),
        (["10:20"], "no rest"),
    ],
)
def test_times_that_make_no_sense_are_refused(tmp_path, times, part):
    options = [word for time in times for word in ("--at", time)]
    log = record(GOOD, 66).write(tmp_path / "robot.csv")
    done = typed("spin", log, "-o", tmp_path / "out", *options)
    assert done.code == 2
    assert part in one_line(done.err)


def test_deg_taken_for_rad_are_noticed(tmp_path):
    session = record(GOOD, 67)
    session.gyroscope = np.degrees(session.gyroscope)
    line = refused(session, tmp_path, "--gyroscope-unit", "rad/s")
    assert "deg/s were taken for rad/s; give --gyroscope-unit deg/s" in line


def test_rad_taken_for_deg_are_suspected(tmp_path):
    line = refused(record(GOOD, 68), tmp_path, "--gyroscope-unit", "deg/s")
    assert "turned only 19 deg" in line
    assert "give --gyroscope-unit rad/s" in line


def test_g_taken_for_si_are_noticed_with_the_option_that_mends_it(tmp_path):
    session = record(GOOD, 69)
    session.accelerometer = session.accelerometer / 9.80665
    line = refused(session, tmp_path, "--accelerometer-unit", "m/s^2")
    assert line.endswith("read it with --accelerometer-unit g")
    recording = tumble.Recording.from_arrays("robot", session.time, session.accelerometer, session.gyroscope)
    with pytest.raises(tumble.ProcedureError, match="g were taken for m/s"):
        tumble.spin(recording)


def test_a_stuck_channel_is_named(tmp_path):
    session = record(GOOD, 70)
    session.gyroscope[:, 1] = 0.0
    line = refused(session, tmp_path)
    assert "gyroscope y is stuck at 0 rad/s" in line


def test_a_folder_of_poses_is_no_log_of_a_robot(tmp_path):
    folder = tmp_path / "poses"
    folder.mkdir()
    for name in ("x_up", "y_up"):
        record((still(3),), 71).write(folder / f"{name}.csv")
    done = typed("spin", folder, "-o", tmp_path / "out")
    assert done.code == 2
    assert "one per pose" in one_line(done.err)


@pytest.mark.parametrize(
    ("words", "part"),
    [
        ([], "either a log or --live"),
        (["robot.csv", "--live", "udp:14550"], "either a log or --live"),
        (["robot.csv", "--from", "10.0.0.1"], "--from"),
        (["--live", "udp:14550", "--at", "1:2"], "--at"),
        (["robot.csv", "--still", "long"], "--still long"),
        (["robot.csv", "--height", "100"], "--latitude"),
        (["robot.csv", "--gravity", "9.8", "--latitude", "48"], "give one of them"),
        (["robot.csv"], "robot.csv"),
    ],
)
def test_wrong_command_line_is_one_line(tmp_path, monkeypatch, words, part):
    monkeypatch.chdir(tmp_path)
    done = typed("spin", *words, "-o", tmp_path / "out")
    assert done.code == 2
    assert part in one_line(done.err)


def test_gravity_of_nowhere_on_earth_is_refused(tmp_path):
    line = refused(record(GOOD, 73), tmp_path, "--gravity", "1.6", named=False)
    assert "nowhere on Earth" in line


def test_a_spin_that_is_refused_does_not_corrupt_a_good_one(tmp_path):
    session = record((still(), turn(2), still(), drive(turns=0.3, vibration=0.3), *GOOD), 72)
    part = session.during(5, 0.5, 0.55)
    push = 4.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, part.sum()))
    session.accelerometer[part] += np.outer(push, session.robot.up)
    log = session.write(tmp_path / "robot.csv")
    done = typed("spin", log, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert "was lifted" in done.text


def test_refused_spin_beside_a_good_one_exits_3(tmp_path):
    session = record((*GOOD, drive(turns=0.3, vibration=0.3), *GOOD), 73)
    part = session.during(5, 0.5, 0.55)
    push = 4.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, part.sum()))
    session.accelerometer[part] += np.outer(push, session.robot.up)
    log = session.write(tmp_path / "robot.csv")
    (_, first), (second, _), (_, end) = session.spans[2], session.spans[4], session.spans[-1]
    done = typed("spin", log, "-o", tmp_path / "out", "--at", f"0:{first}", "--at", f"{second}:{end}")
    assert done.code == 3, done.err
    assert "was lifted" in done.text
    assert (tmp_path / "out/robot.spin.yaml").exists()


def test_the_output_folder_is_tried_before_the_log_is_read(tmp_path):
    (tmp_path / "out").write_text("a file")
    log = record(GOOD, 74).write(tmp_path / "robot.csv")
    done = typed("spin", log, "-o", tmp_path / "out")
    assert done.code == 2
    assert "output folder" in one_line(done.err)
