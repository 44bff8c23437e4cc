"""`tumble spin` on the log of a robot, from recording to files: what whoever runs a robot does and gets."""

from __future__ import annotations

import json

import numpy as np
import pytest

import tumble
from spin_sessions import Robot, drive, record, still, turn
from turntable_sessions import contents, one_line, typed

SIGMAS = 5.0
"""A miss this large comes by chance once in 1.7 million normal draws; there are some hundred here."""
BOTH_WAYS = (still(), turn(3), still(3), turn(-3), still())


def spun(session, folder, *options, code=0):
    """Writes the log, runs the command as typed with `--json`, returns what it printed."""
    log = session.write(folder / "robot.csv")
    done = typed("spin", log, "-o", folder / "out", "--json", *options)
    assert done.code == code, f"exit code {done.code}: {done.out}{done.err}"
    return json.loads(done.out)


def assert_recovered(found, robot, triads=("accelerometer", "gyroscope")):
    """The biases are those of the robot, within their sigmas."""
    for triad in triads:
        bias = found[f"{triad}_bias"]
        miss = (np.array(bias["value"]) - getattr(robot, f"{triad}_bias")) / bias["sigma"]
        assert np.all(np.abs(miss) < SIGMAS), f"{triad} bias is off by {miss.round(1)} sigmas"


def parameter(found, name, spin=0):
    """One parameter of a spin by its name."""
    return next(each for each in found["spins"][spin]["parameters"] if each["name"] == name)


def assert_near(parameter, truth):
    miss = (parameter["value"] - truth) / parameter["sigma"]
    assert abs(miss) < SIGMAS, f"{parameter['name']} is off by {miss:.1f} sigmas"


@pytest.mark.parametrize("floor_tilt", [0.0, 0.2, 1.0, 3.0])
def test_both_biases_are_found_whatever_the_tilt_of_the_floor(tmp_path, floor_tilt):
    session = record(BOTH_WAYS, 21, floor_tilt=floor_tilt)
    found = spun(session, tmp_path)
    assert_recovered(found, session.robot)
    assert len(found["spins"]) == 1
    assert found["spins"][0]["method"] == "level-free"


def test_everything_else_about_robot_and_floor_is_found(tmp_path):
    session = record(BOTH_WAYS, 22)
    found = spun(session, tmp_path)
    robot = session.robot
    assert_near(parameter(found, "mounting roll"), robot.roll)
    assert_near(parameter(found, "mounting pitch"), robot.pitch)
    assert_near(parameter(found, "floor tilt"), robot.floor_tilt)
    assert_near(parameter(found, "uphill bearing"), robot.uphill)
    across = np.array(robot.lever_arm) - np.dot(robot.lever_arm, robot.up) * robot.up
    for axis, truth in zip("xyz", across, strict=True):
        assert_near(parameter(found, f"lever arm {axis}"), truth)


@pytest.mark.parametrize(
    "moves",
    [
        (still(), turn(2)),
        (still(), turn(-2), still()),
        (still(), turn(3), turn(-3)),
        (still(), *(move for _ in range(8) for move in (turn(0.25), still(2)))),
        (still(), turn(2, 1.0, unevenness=0.5), still(), turn(-2, 1.0, unevenness=0.5), still()),
    ],
    ids=[
        "one way, no rest after",
        "the other way",
        "back without a rest",
        "stops every quarter",
        "uneven speed",
    ],
)
def test_a_robot_may_turn_as_it_can(tmp_path, moves):
    session = record(moves, 23)
    found = spun(session, tmp_path)
    assert len(found["spins"]) == 1
    assert_recovered(found, session.robot)


@pytest.mark.parametrize(
    "moves",
    [
        (still(), turn(1)),
        (still(), *(move for _ in range(8) for move in (turn(0.25), still(2)))),
        (still(), turn(2, 1.0, unevenness=0.5), still()),
    ],
    ids=["one turn", "stops every quarter", "uneven speed"],
)
def test_inspect_says_beforehand_that_the_log_serves(tmp_path, moves):
    log = record(moves, 47).write(tmp_path / "robot.csv")
    assert "spin: yes" in typed("inspect", log).text


def test_turned_angle_is_distinguished_by_direction(tmp_path):
    (spin,) = spun(record((still(), turn(3), still(), turn(-2), still()), 24), tmp_path)["spins"]
    assert spin["turned_counter_clockwise"] == pytest.approx(3 * 2 * np.pi, rel=1e-3)
    assert spin["turned_clockwise"] == pytest.approx(2 * 2 * np.pi, rel=1e-3)


def test_a_bias_far_above_that_of_any_rest_gate_is_found(tmp_path):
    session = record(BOTH_WAYS, 25, gyroscope_bias=(0.3, -0.2, 0.4))
    assert_recovered(spun(session, tmp_path), session.robot)


@pytest.mark.parametrize("vibration", [0.1, 0.3, 1.0, 3.0])
def test_robot_that_shakes_while_turning_is_not_called_lifted(tmp_path, vibration):
    moves = (still(), turn(3, vibration=vibration), still(3), turn(-3, vibration=vibration), still())
    session = record(moves, 48)
    found = spun(session, tmp_path)
    assert len(found["spins"]) == 1
    assert_recovered(found, session.robot)


@pytest.mark.parametrize("vibration", [0.0, 0.3])
def test_several_spins_with_driving_between_are_found_and_agree(tmp_path, vibration):
    moves = (still(), turn(2), still(), drive(turns=0.4, vibration=vibration), still(), turn(-2), still())
    session = record(moves, 26)
    found = spun(session, tmp_path)
    assert len(found["spins"]) == 2
    assert_recovered(found, session.robot)
    assert found["agreement"]["observable"]
    assert found["agreement"]["value"] < found["agreement"]["high"]
    (refused,) = [each for each in found["refused"] if each["end"] - each["start"] > 2.0]
    assert "drove" in refused["reason"]
    start, end = session.spans[3]
    assert refused["start"] == pytest.approx(start, abs=1.0)
    assert refused["end"] == pytest.approx(end, abs=1.0)


def test_two_spins_are_better_than_one(tmp_path):
    moves = (still(), turn(2), still(), drive(turns=0.4, vibration=0.3), still(), turn(-2), still())
    found = spun(record(moves, 27), tmp_path)
    for bias in ("accelerometer_bias", "gyroscope_bias"):
        alone = [spin[bias]["sigma"] for spin in (_with_bias(spin) for spin in found["spins"])]
        assert np.all(np.array(found[bias]["sigma"]) < np.min(alone, axis=0))


def _with_bias(spin):
    return {"accelerometer_bias": spin["level_free"], "gyroscope_bias": spin["gyroscope_bias"]}


def test_a_robot_that_drives_off_at_once_has_still_turned(tmp_path):
    session = record((still(), turn(2), drive(turns=0.3, vibration=0.3), still()), 28)
    found = spun(session, tmp_path)
    (spin,) = found["spins"]
    assert spin["end"] == pytest.approx(session.spans[1][1], abs=0.5)
    assert_recovered(found, session.robot)


def test_times_may_be_given(tmp_path):
    moves = (still(), turn(2), still(), drive(turns=0.4, vibration=0.3), still(), turn(-2), still())
    session = record(moves, 29)
    (_, first), (second, _) = session.spans[2], session.spans[4]
    found = spun(session, tmp_path, "--at", f"0:{first}", "--at", f"{second}:{session.spans[-1][1]}")
    assert [spin["label"] for spin in found["spins"]] == ["spin 1", "spin 2"]
    assert found["refused"] == []
    assert_recovered(found, session.robot)
    only = spun(session, tmp_path, "--at", f"{second}:{session.spans[-1][1]}")
    assert len(only["spins"]) == 1
    assert only["spins"][0]["start"] >= second


@pytest.mark.parametrize("scale", [0.98, 1.0, 1.03])
def test_turns_known_from_elsewhere_show_the_scale_of_the_gyroscope(tmp_path, scale):
    session = record(BOTH_WAYS, 30, gyroscope_scale=scale)
    found = spun(session, tmp_path, "--true-turns", "+3,-3", "--true-turns-sigma", "0.5")
    for direction in ("clockwise", "counter-clockwise"):
        shown = parameter(found, f"gyroscope scale {direction}")
        assert_near(shown, scale)
        assert shown["sigma"] < 0.01
    assert_recovered(found, session.robot)


def test_turns_known_of_one_direction_say_nothing_of_the_other(tmp_path):
    found = spun(record(BOTH_WAYS, 31), tmp_path, "--true-turns", "-3")
    assert parameter(found, "gyroscope scale clockwise")["observable"]
    hidden = parameter(found, "gyroscope scale counter-clockwise")
    assert not hidden["observable"]
    assert hidden["value"] is None


@pytest.mark.parametrize("option", ["--level-floor", "--as-published"])
def test_a_level_floor_taken_for_granted_is_the_published_method(tmp_path, option):
    session = record(BOTH_WAYS, 32, floor_tilt=0.0)
    found = spun(session, tmp_path, option)
    assert found["spins"][0]["method"] == "published"
    assert_recovered(found, session.robot)
    assert not any("tilts" in warning for warning in found["spins"][0]["warnings"])


def test_a_floor_that_is_not_level_is_noticed_all_the_same(tmp_path):
    found = spun(record(BOTH_WAYS, 33), tmp_path, "--level-floor")
    (warning,) = [line for line in found["spins"][0]["warnings"] if "tilts" in line]
    assert "0.17 m/s^2" in warning
    assert "--level-floor" in warning


@pytest.mark.parametrize("turns", [0.15, 0.3, 0.5, 0.9])
def test_part_of_a_turn_is_reported_with_its_value(tmp_path, turns):
    session = record((still(), turn(turns), still()), 34)
    found = spun(session, tmp_path)
    (warning,) = [line for line in found["spins"][0]["warnings"] if "of a turn" in line]
    assert f"only {360 * turns:.0f} deg" in warning
    assert f"known to {max(found['accelerometer_bias']['sigma']):.2g} m/s^2" in warning
    assert_recovered(found, session.robot)


def test_too_small_a_part_leaves_the_published_method_with_tilt(tmp_path):
    session = record((still(), turn(0.15)), 45, accelerometer_noise=0.3)
    found = spun(session, tmp_path)
    (spin,) = found["spins"]
    assert spin["method"] == "published"
    assert_recovered(found, session.robot)
    one_degree = 9.80665 * np.sin(np.radians(1.0))
    assert np.all(np.array(found["accelerometer_bias"]["sigma"][:2]) > 0.9 * one_degree)
    (warning,) = [line for line in spin["warnings"] if "of a turn" in line]
    assert "0.17 m/s^2 for each degree" in warning


def test_a_level_floor_that_somebody_vouches_for_costs_no_sigma(tmp_path):
    session = record((still(), turn(0.15)), 46, floor_tilt=0.0, accelerometer_noise=0.3)
    found = spun(session, tmp_path, "--level-floor")
    assert_recovered(found, session.robot)
    assert np.all(np.array(found["accelerometer_bias"]["sigma"]) < 0.02)


def test_a_slow_turn_at_the_start_does_not_become_bias(tmp_path):
    # Too slow for gravity to be seen to move at rest, yet it would be 0.6 deg/s of bias.
    session = record((turn(0.0095, 0.01), turn(3), turn(-3)), 35)
    found = spun(session, tmp_path)
    assert any("while it seemed to stand still" in line for line in found["spins"][0]["warnings"])
    assert_recovered(found, session.robot, ["gyroscope"])


def test_a_gyroscope_that_warms_up_is_worth_a_word(tmp_path):
    session = record(BOTH_WAYS, 49)
    session.gyroscope[:, 0] += 3e-5 * session.time
    warnings = spun(session, tmp_path)["spins"][0]["warnings"]
    assert any("bias drifted by 0.00" in line for line in warnings)
    steady = spun(record(BOTH_WAYS, 49), tmp_path)["spins"][0]["warnings"]
    assert not any("wandered" in line for line in steady)


def test_a_coarse_sensor_that_shows_one_value_at_rest_serves(tmp_path):
    session = record(BOTH_WAYS, 50, accelerometer_noise=1e-3, gyroscope_noise=1e-4)
    force_step, rate_step = 9.80665 / 4096, np.radians(1.0 / 16.4)
    session.accelerometer = np.round(session.accelerometer / force_step) * force_step
    session.gyroscope = np.round(session.gyroscope / rate_step) * rate_step
    found = spun(session, tmp_path)
    # Rounding is no noise that averages out: it may be wrong by half a step all along, of bias and tilt.
    for bias, step in (("accelerometer_bias", force_step), ("gyroscope_bias", rate_step)):
        miss = np.abs(np.array(found[bias]["value"]) - getattr(session.robot, bias))
        sigma = np.array(found[bias]["sigma"])
        assert np.all(miss < 3.0 * sigma)
        assert np.all(sigma < step)


def test_slow_turning_is_worth_a_word(tmp_path):
    found = spun(record((still(), turn(1.1, 0.15), still()), 36), tmp_path)
    assert any("about 1 rad/s is good" in line for line in found["spins"][0]["warnings"])


def test_gravity_follows_from_latitude_and_height(tmp_path):
    found = spun(record(BOTH_WAYS, 37), tmp_path, "--latitude", 48.1, "--height", 520)
    # WGS 84 normal gravity at 48.1 deg is 9.8090 m/s^2 on the ellipsoid and falls 3.086e-6 a metre.
    assert found["gravity"]["value"] == pytest.approx(9.8090 - 520 * 3.086e-6, abs=2e-4)
    assert "48.1" in found["gravity"]["source"]


def test_effect_of_a_scale_error_is_reported(tmp_path):
    found = spun(record(BOTH_WAYS, 38), tmp_path)
    assert any("1 % of it would be 0.098 m/s^2" in warning for warning in found["warnings"])


def test_files_are_named_after_the_log_and_equal_the_screen(tmp_path):
    session = record(BOTH_WAYS, 39)
    found = spun(session, tmp_path)
    assert set(contents(tmp_path / "out")) == {"robot.spin.yaml", "robot.spin.html"}
    calibration = tumble.Calibration.load(tmp_path / "out/robot.spin.yaml")
    np.testing.assert_array_equal(calibration.accelerometer.b, found["accelerometer_bias"]["value"])
    np.testing.assert_array_equal(calibration.gyroscope.b, found["gyroscope_bias"]["value"])
    assert calibration.method.procedure == "spin"
    assert found["files"]["calibration"] == str(tmp_path / "out/robot.spin.yaml")


def test_screen_shows_parameters_with_sigma_or_as_not_observable(tmp_path):
    log = record(BOTH_WAYS, 40).write(tmp_path / "robot.csv")
    done = typed("spin", log, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert "3.00 turns clockwise" in done.text
    for row in ("gyroscope bias x", "accelerometer bias z", "floor tilt", "lever arm y", "published x"):
        (line,) = [line for line in done.out.splitlines() if line.strip().startswith(row)]
        assert "±" in line
    assert "gyroscope scale clockwise not observable" in done.text


def test_python_gives_what_the_command_gives(tmp_path):
    session = record(BOTH_WAYS, 41)
    found = spun(session, tmp_path)
    recording = tumble.Recording.from_arrays("robot", session.time, session.accelerometer, session.gyroscope)
    result = tumble.spin(recording)
    np.testing.assert_allclose(
        result.accelerometer_bias.value, found["accelerometer_bias"]["value"], rtol=1e-9
    )
    assert "accelerometer bias x" in repr(result)


def test_second_run_replaces_the_first_and_a_failed_one_does_not(tmp_path):
    good = record(BOTH_WAYS, 42)
    spun(good, tmp_path)
    before = contents(tmp_path / "out")
    log = record((still(), drive(vibration=0.3), still()), 43).write(tmp_path / "robot.csv")
    done = typed("spin", log, "-o", tmp_path / "out")
    assert done.code == 2
    one_line(done.err)
    assert contents(tmp_path / "out") == before


def test_the_order_of_the_imu_axes_does_not_matter(tmp_path):
    upside_down = Robot(roll=178.0, pitch=4.0)
    session = record(BOTH_WAYS, 44, roll=upside_down.roll, pitch=upside_down.pitch)
    found = spun(session, tmp_path)
    assert_recovered(found, session.robot)
    assert_near(parameter(found, "mounting roll"), 178.0)


def test_lever_arm_of_turns_one_way_begins_where_the_robot_turned(tmp_path):
    one_way = record((still(), turn(3), still()), 91)
    words = "turned one way only: the lever arm is counted from the point about which the robot turned"
    (line,) = [line for line in spun(one_way, tmp_path)["spins"][0]["warnings"] if words in line]
    assert "1 cm/s move that point by 1" in line
    assert words in (tmp_path / "out/robot.spin.html").read_text()
    both = spun(record(BOTH_WAYS, 91), tmp_path)["spins"][0]["warnings"]
    assert not any("lever arm" in line for line in both)
