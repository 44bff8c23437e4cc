"""A simulated spin is consistent: kinematics agree with themselves, truth with what was recorded."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from tumble import simulate_spin
from tumble.tools.simulate import Fault, SimulatedDisturbance, Step, parse_plan
from turntable_sessions import typed

QUIET = {
    "accelerometer_noise": 0.0,
    "gyroscope_noise": 0.0,
    "accelerometer_bias": (0.0, 0.0, 0.0),
    "gyroscope_bias": (0.0, 0.0, 0.0),
    "bias_instability": False,
    "quantisation": False,
}
GRAVITY = 9.80665


def quiet(**changes):
    return simulate_spin(**{**QUIET, **changes})


@given(
    turns=st.floats(0.3, 3.0),
    rate=st.floats(0.2, 3.0),
    unevenness=st.floats(0.0, 0.5),
    slips=st.sampled_from([0.0, 2.0]),
    seed=st.integers(0, 1000),
)
@settings(max_examples=25)
def test_heading_is_the_integral_of_the_rate(turns, rate, unevenness, slips, seed):
    spin = quiet(
        plan=(Step("rest", 2.0), Step("turn", turns=turns), Step("turn", turns=-turns), Step("rest", 1.0)),
        turn_rate=rate,
        unevenness=unevenness,
        slips=slips,
        seed=seed,
        rate_hz=1000.0,
    )
    about = spin.samples.gyroscope @ spin.up
    time = spin.samples.time
    integral = np.concatenate([[0.0], np.cumsum((about[1:] + about[:-1]) / 2 * np.diff(time))])
    np.testing.assert_allclose(integral, spin.heading, rtol=0.0, atol=2e-4)
    assert np.sum(spin.turned) == pytest.approx(spin.heading[-1], abs=1e-9)
    np.testing.assert_allclose(spin.samples.gyroscope, np.outer(about, spin.up), rtol=0.0, atol=1e-12)


def test_specific_force_is_that_of_a_point_moving_in_the_world():
    """Position of the IMU in the world, differentiated twice, less gravity, turned into the case."""
    spin = quiet(
        plan=parse_plan("rest 1, 1 turns, rest 1"), rate_hz=1000.0, unevenness=0.3, floor_tilt_deg=3.0
    )
    time, heading = spin.samples.time, spin.heading
    up = spin.up
    forward = np.array([1.0, 0.0, 0.0]) - up[0] * up
    forward /= np.linalg.norm(forward)
    frame = np.column_stack([forward, np.cross(up, forward), up])
    arm = frame.T @ spin.lever_arm
    cosine, sine = np.cos(heading), np.sin(heading)
    place = np.column_stack([cosine * arm[0] - sine * arm[1], sine * arm[0] + cosine * arm[1]])
    pull = np.gradient(np.gradient(place, time, axis=0), time, axis=0)
    tilt, bearing = spin.floor_tilt, spin.uphill_bearing
    world = np.column_stack(
        [
            pull[:, 0] + GRAVITY * np.sin(tilt) * np.cos(bearing),
            pull[:, 1] + GRAVITY * np.sin(tilt) * np.sin(bearing),
            np.full(len(time), GRAVITY * np.cos(tilt)),
        ]
    )
    turned = np.column_stack(
        [
            cosine * world[:, 0] + sine * world[:, 1],
            -sine * world[:, 0] + cosine * world[:, 1],
            world[:, 2],
        ]
    )
    expected = turned @ frame.T
    # The difference at either end of the recording is one-sided.
    inner = slice(5, -5)
    np.testing.assert_allclose(spin.samples.accelerometer[inner], expected[inner], rtol=0.0, atol=2e-3)


def test_at_rest_the_length_of_specific_force_is_gravity():
    spin = quiet(floor_tilt_deg=8.0, roll_deg=170.0, pitch_deg=40.0, yaw_deg=-60.0)
    start, end = spin.rests[0]
    resting = (spin.samples.time > start) & (spin.samples.time < end)
    lengths = np.linalg.norm(spin.samples.accelerometer[resting], axis=1)
    assert lengths == pytest.approx(GRAVITY, abs=1e-9)
    assert spin.moving[resting].max() == 0.0


def test_bias_and_noise_are_those_asked_for():
    bias = (0.3, -0.2, 0.1)
    spin = simulate_spin(
        plan=(Step("rest", 60.0),),
        accelerometer_bias=bias,
        accelerometer_noise=0.02,
        gyroscope_noise=0.002,
        bias_instability=False,
        quantisation=False,
    )
    assert spin.accelerometer_bias == pytest.approx(bias)
    assert spin.samples.accelerometer.std(axis=0) == pytest.approx(0.02, rel=0.06)
    assert spin.samples.gyroscope.std(axis=0) == pytest.approx(0.002, rel=0.06)


def test_a_drive_leads_to_another_floor():
    plan = (Step("rest", 2.0), Step("drive", 8.0, turns=0.2, floor_tilt_deg=0.0), Step("rest", 2.0))
    spin = quiet(plan=plan, floor_tilt_deg=4.0)
    before, after = (spin.samples.accelerometer[rows] for rows in (slice(0, 150), slice(-150, None)))
    tilt = [np.degrees(np.arccos(force.mean(axis=0) @ spin.up / GRAVITY)) for force in (before, after)]
    assert tilt == pytest.approx([4.0, 0.0], abs=1e-4)
    assert spin.heading[-1] == pytest.approx(0.2 * 2 * np.pi)


def test_a_floor_stays_what_it_was_where_a_drive_names_no_other():
    plan = "rest 1, drive 4 tilt 2 uphill 90, rest 1, drive 4 bend 90, rest 1"
    spin = quiet(plan=parse_plan(plan), floor_tilt_deg=5.0, roll_deg=0.0, pitch_deg=0.0)
    last = spin.samples.accelerometer[-1] / GRAVITY
    # Uphill lay to the left; the bend to the left has brought it ahead.
    assert last == pytest.approx([np.sin(np.radians(2.0)), 0.0, np.cos(np.radians(2.0))], abs=1e-9)
    assert spin.heading[-1] == pytest.approx(np.pi / 2)


def test_earth_rate_at_rest_is_that_of_the_latitude_with_north_ahead():
    level = {"floor_tilt_deg": 0.0, "roll_deg": 0.0, "pitch_deg": 0.0}
    spin = quiet(latitude_deg=60.0, plan=(Step("rest", 2.0),), **level)
    earth = 7.292115e-5
    expected = [earth * np.cos(np.pi / 3), 0.0, earth * np.sin(np.pi / 3)]
    assert spin.samples.gyroscope[7] == pytest.approx(expected, rel=1e-6)


def test_slips_shorten_a_turn_and_unevenness_does_not():
    plan = (Step("turn", turns=-3.0),)
    uneven, slipping = quiet(plan=plan, unevenness=0.6), quiet(plan=plan, unevenness=0.6, slips=2.0)
    assert uneven.turned == pytest.approx([-6.0 * np.pi])
    assert -6.0 * np.pi + 0.1 < slipping.turned[0] < -4.0 * np.pi
    for spin in (uneven, slipping):
        assert np.diff(spin.heading).max() <= 0.0


def test_a_slow_turn_hides_in_the_rest_before_the_first_turn_only():
    spin = quiet(slow_turn=0.01)
    assert spin.samples.gyroscope[10] @ spin.up == pytest.approx(0.01)
    assert spin.moving[10] == 1.0
    assert spin.samples.gyroscope[-1] @ spin.up == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    "kind", [SimulatedDisturbance.picked_up, SimulatedDisturbance.over_a_sill, SimulatedDisturbance.lifted]
)
def test_a_disturbance_comes_and_goes_and_leaves_the_robot_as_it_was(kind):
    calm, disturbed = quiet(), quiet(disturbances=[kind(9.0)])
    apart = np.linalg.norm(disturbed.samples.accelerometer - calm.samples.accelerometer, axis=1)
    inside = (calm.samples.time > 8.99) & (calm.samples.time < 9.01 + kind(9.0).seconds)
    assert apart[~inside].max() < 1e-9
    assert apart[inside].max() > 0.5


def test_gyroscope_scale_is_in_its_readings_and_in_the_truth():
    spin = quiet(gyroscope_scale=0.02)
    assert pytest.approx(1.02 * np.eye(3)) == spin.gyroscope.M
    assert (spin.samples.gyroscope @ spin.up).max() == pytest.approx(1.02, abs=1e-6)


def test_a_log_that_is_cut_off_ends_there():
    spin = simulate_spin(faults=[Fault("gap", start=20.0, end=1e9)])
    assert spin.samples.time[-1] == pytest.approx(20.0, abs=0.02)
    assert len(spin.heading) == len(spin.samples)


def test_the_command_writes_a_log_and_its_truth(tmp_path):
    done = typed("simulate", "spin", "--plan", "rest 5, 2 turns", "--floor-tilt", "2", "-o", tmp_path)
    assert done.code == 0, done.err
    truth = yaml.safe_load((tmp_path / "truth.yaml").read_text())
    assert truth["floor_tilt_deg"] == 2.0
    assert truth["turned"] == pytest.approx([4.0 * np.pi])
    assert (tmp_path / "spin.csv").read_text().count("\n") > 1500


def test_turns_typed_are_turned_to_the_last_digit(tmp_path):
    done = typed("simulate", "spin", "--turns", "1.23456789", "-o", tmp_path)
    assert done.code == 0, done.err
    truth = yaml.safe_load((tmp_path / "truth.yaml").read_text())
    expected = 1.23456789 * 2.0 * np.pi
    assert truth["turned"] == pytest.approx([expected, -expected], rel=1e-9)


def test_biases_and_noise_typed_are_those_of_the_unit(tmp_path):
    words = ["--accelerometer-bias", "0.3,-0.2,0.1", "--gyroscope-bias", "0.02,0.01,-0.03"]
    noise = ["--accelerometer-noise", "0.02", "--gyroscope-noise", "0.002", "--no-quantisation"]
    done = typed("simulate", "spin", *words, *noise, "--no-bias-instability", "-o", tmp_path)
    assert done.code == 0, done.err
    truth = yaml.safe_load((tmp_path / "truth.yaml").read_text())
    assert truth["accelerometer_bias"] == pytest.approx([0.3, -0.2, 0.1])
    assert truth["gyroscope_bias"] == pytest.approx([0.02, 0.01, -0.03])
    columns = np.genfromtxt(tmp_path / "spin.csv", delimiter=",", skip_header=2, names=True)
    at_rest = columns[:500]
    for name, sigma in [("ax", 0.02), ("az", 0.02), ("gx", 0.002), ("gz", 0.002)]:
        assert at_rest[name].std() == pytest.approx(sigma, rel=0.15)
