"""Remarks on usable recordings: they name the event, and the options that are still missing."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from tumble import Calibration, Recording
from tumble.poses.pose_list import SIX_FACES
from turntable_sessions import calibrate, simulate

G = 9.80665


def changed(recording, change, name=""):
    """The recording with its specific force and angular rate changed in place, and by a name of its own."""
    (chunk,) = recording.chunks()
    force, rate = chunk.accelerometer.copy(), chunk.gyroscope.copy()
    change(chunk.time, force, rate)
    return Recording.from_arrays(name or recording.name, chunk.time, force, rate)


def knocked_at(*times):
    """Knock at the unit for 0.2 s at each time."""

    def knock(time, force, rate):
        for at in times:
            struck = (time >= at) & (time < at + 0.2)
            force[struck] += np.random.default_rng(1).normal(0.0, 2.0, (struck.sum(), 3))
            rate[struck] += np.random.default_rng(2).normal(0.0, 0.2, (struck.sum(), 3))

    return knock


@pytest.fixture(scope="module")
def session():
    return simulate(5, grades=("industrial", "industrial"), rest_seconds=12.0)


def test_a_rest_that_was_knocked_at_is_one_record_of_its_pose(session):
    at = [rest.start + 2.0 for rest in calibrate(session).reference.rests][1]
    knock = knocked_at(at, at + 2.5, at + 5.0)
    result = tumble.turntable(changed(session.reference, knock), changed(session.targets[0], knock))
    assert [rest.pose for rest in result.reference.rests].count("X down") == 4
    assert not any("more than once" in warning for warning in result.warnings)
    assert "the rest at X down was disturbed and fell into 4 rests; all are used" in result.warnings


def test_a_pose_that_was_taken_again_and_knocked_at_counts_as_two():
    session = simulate(5, rest_seconds=8.0, visits=[*(pose.name for pose in SIX_FACES), "X up"])
    knock = knocked_at(4.0)
    result = tumble.turntable(changed(session.reference, knock), changed(session.targets[0], knock))
    assert any("more than once, all used: X up (2 times)" in warning for warning in result.warnings)
    assert "the rest at X up was disturbed and fell into 2 rests; all are used" in result.warnings


def turned_at(time, angle):
    """Turn the unit about the vertical by deg, over 2 s of a rest that begins at a time."""

    def turn(times, force, rate):
        x = np.clip((times - time) / 2.0, 0.0, 1.0)
        up = force[np.searchsorted(times, time)] / np.linalg.norm(force[np.searchsorted(times, time)])
        rate += np.outer(np.radians(angle) / 2.0 * 30.0 * (x * (1.0 - x)) ** 2, up)

    return turn


@pytest.mark.parametrize(("angle", "is_disturbed"), [(4.0, True), (90.0, False), (-360.0, False)])
def test_a_turn_about_the_vertical_is_no_disturbance(session, angle, is_disturbed):
    at = [rest.start + 5.0 for rest in calibrate(session).reference.rests][1]
    turn = turned_at(at, angle)
    result = tumble.turntable(changed(session.reference, turn), changed(session.targets[0], turn))
    assert [rest.pose for rest in result.reference.rests].count("X down") == 2
    said = [each for each in result.warnings if "X down" in each]
    assert bool(said) == is_disturbed, said
    assert ("the rest at X down was disturbed and fell into 2 rests; all are used" in said) == is_disturbed


def test_without_a_gyroscope_two_rests_in_a_row_leave_both_open(session):
    at = [rest.start + 5.0 for rest in calibrate(session).reference.rests][1]
    (chunk,) = changed(session.reference, knocked_at(at)).chunks()
    reference = Recording.from_arrays("reference", chunk.time, chunk.accelerometer, None)
    result = tumble.turntable(reference, changed(session.targets[0], knocked_at(at)))
    (said,) = (each for each in result.warnings if "X down" in each)
    assert said.startswith("2 rests in a row at X down: one that was disturbed, or turns about the vertical")


CASES = {
    "standard gravity": (
        {},
        9.75,
        "give the local gravity with --latitude and --height or --gravity, or",
    ),
    "gravity that was given": ({"gravity": 9.75}, 9.80665, "check the value of --gravity, or give"),
    "a latitude that was given": (
        {"latitude": 48.0},
        9.75,
        "check --latitude and --height, or",
    ),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("calibrated", [False, True])
def test_gravity_that_does_not_fit_asks_only_for_what_was_not_given(session, case, calibrated):
    options, true_gravity, remedy = CASES[case]

    def weigh(_, force, __):
        force *= true_gravity / G

    logs = [changed(each, weigh) for each in (session.reference, session.targets[0])]
    ideal = {"M": np.eye(3), "b": np.zeros(3)}
    known = Calibration.model_validate({"name": "reference", "accelerometer": ideal, "gyroscope": ideal})
    if calibrated:
        options = options | {"reference_calibration": known}
    (said,) = [each for each in tumble.turntable(*logs, **options).warnings if "|f| deviates" in each]
    assert remedy in said or (calibrated and remedy.removesuffix(" give") in said)
    assert ("--reference-calibration" in said) == (not calibrated)
    assert ("calibrate the reference anew" in said) == calibrated


@pytest.mark.parametrize("share", [0.83, 1.17])
def test_accelerometer_that_reads_far_from_gravity_gets_a_remark(session, share):
    def scale(_, force, __):
        force *= share

    log = changed(session.targets[0], scale, "odd")
    said = f"{share:.2f} of gravity: check its unit and its range, or whether it is damaged"
    result = tumble.turntable(session.reference, [log, session.targets[1]])
    assert any(said in warning for warning in result["odd"].warnings)
    assert not any("of gravity" in warning for warning in result[1].warnings)
    assert any(said in remark for remark in tumble.inspect(log).remarks)


def test_a_spin_by_an_accelerometer_far_from_gravity_says_so():
    def scale(_, force, __):
        force *= 0.83

    sound = tumble.simulate_spin(seed=7).recording
    assert any("0.83 of gravity" in each for each in tumble.spin(changed(sound, scale)).warnings)
    assert not any("of gravity" in each for each in tumble.spin(sound).warnings)


TWINS = "read the same to the bit: they are one sensor, or one log is a copy of the other"


def same_gyroscope(one, other, name):
    """The accelerometer of one unit with the gyroscope of the other."""
    (chunk,), (theirs,) = one.chunks(), other.chunks()
    return Recording.from_arrays(name, chunk.time, chunk.accelerometer, theirs.gyroscope)


def test_target_with_the_reference_gyroscope_is_the_same_sensor(session):
    log = same_gyroscope(session.targets[0], session.reference, "twin")
    result = tumble.turntable(session.reference, [log, session.targets[1]])
    assert any(f"reference and twin {TWINS}" in warning for warning in result["twin"].warnings)
    assert not any(TWINS in warning for warning in result[1].warnings)


def test_target_with_the_gyroscope_of_another_is_the_same_sensor(session):
    first, second = session.targets
    result = tumble.turntable(session.reference, [first, same_gyroscope(second, first, "twin")])
    assert any(f"target_1 and twin {TWINS}" in warning for warning in result["twin"].warnings)
    assert not any(TWINS in warning for warning in result["target_1"].warnings)


@pytest.mark.parametrize("procedure", [tumble.align, tumble.redundancy])
def test_units_with_one_gyroscope_are_reported_as_one_sensor(session, procedure):
    first, second = session.targets
    log = same_gyroscope(first, second, "twin")
    assert any(f"target_2 and twin {TWINS}" in each for each in procedure(second, [log]).warnings)
    assert not any(TWINS in each for each in procedure(second, [first]).warnings)


def test_two_dead_gyroscopes_are_not_reported_as_one(session):
    def kill(_, __, rate):
        rate[:] = 0.0

    dead = [changed(each, kill) for each in session.targets]
    assert not any(TWINS in each for each in tumble.redundancy(dead[0], [dead[1]]).warnings)
