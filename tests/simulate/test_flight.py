"""A simulated flight is consistent: motion, lever arms, vibration and clocks agree with each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from flight_units import GRAVITY, fly, ideal, within
from tumble.tools.simulate import VIBRATIONS, Fault, FlightUnit, Grade, Vibration

motions = st.sampled_from(["quadrotor", "vehicle"])
seeds = st.integers(0, 2**64 - 1)
GRAVITY_UP = np.array([0.0, 0.0, GRAVITY])
vectors = st.tuples(*[st.floats(-0.3, 0.3)] * 3)


def rotation(vectors):
    """Rotation matrices of rotation vectors in rad."""
    return Rotation.from_rotvec(vectors).as_matrix()


@given(motion=motions, seed=seeds, intensity=st.floats(0.0, 1.0))
@settings(max_examples=15)
def test_the_rate_turns_the_attitude(motion, seed, intensity):
    flight = fly(motion=motion, seed=seed, intensity=intensity)
    step = 0.002
    time = np.arange(0.0, flight.duration, step)
    attitude = flight.path(time).level_from_case
    middle = flight.truth(time[:-1] + step / 2).angular_rate
    turned = attitude[:-1].transpose(0, 2, 1) @ attitude[1:]
    np.testing.assert_allclose(turned, rotation(middle * step), rtol=0.0, atol=1e-6)


@given(motion=motions, seed=seeds, intensity=st.floats(0.0, 1.0), arm=vectors)
@settings(max_examples=15)
def test_specific_force_is_acceleration_minus_gravity_at_its_place(motion, seed, intensity, arm):
    """Velocity of the place is that of the primary and of the lever arm that turns with it."""
    flight = fly(motion=motion, seed=seed, intensity=intensity, units=(ideal(), ideal(lever_arm_m=arm)))
    place = flight["secondary_1"]
    step = 1e-4

    def velocity(time):
        path = flight.path(time)
        swing = np.cross(flight.truth(time).angular_rate, arm)
        return path.velocity + np.einsum("nij,nj->ni", path.level_from_case, swing)

    pull = (velocity(place.time + step) - velocity(place.time - step)) / (2.0 * step)
    level_from_case = flight.path(place.time).level_from_case
    expected = np.einsum("nji,nj->ni", level_from_case, pull + GRAVITY_UP)
    np.testing.assert_allclose(place.specific_force, expected, rtol=0.0, atol=2e-4)


@given(motion=motions, seed=seeds, arm=vectors, mounting=vectors)
@settings(max_examples=15)
def test_ideal_units_differ_by_lever_arm_and_mounting_alone(motion, seed, arm, mounting):
    mounting_deg = tuple(600.0 * part for part in mounting)
    units = (ideal(), ideal(lever_arm_m=arm, mounting_deg=mounting_deg))
    rigid = replace(VIBRATIONS[motion], flexing=0.0)
    flight = fly(motion=motion, seed=seed, units=units, vibration=rigid)
    primary, secondary = flight.units
    rate, acceleration = primary.angular_rate, flight.truth(primary.time).angular_acceleration
    placed = primary.specific_force + np.cross(acceleration, arm) + np.cross(rate, np.cross(rate, arm))
    turn = rotation(np.radians(mounting_deg))
    np.testing.assert_allclose(secondary.specific_force, placed @ turn.T, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(secondary.angular_rate, rate @ turn.T, rtol=0.0, atol=1e-12)
    assert secondary.nominal_mounting == pytest.approx(turn, abs=1e-12)


@given(motion=motions, seed=seeds, tilt=st.floats(0.0, 30.0), flights=st.integers(1, 3))
@settings(max_examples=15)
def test_at_rest_a_unit_reads_gravity_and_no_turn(motion, seed, tilt, flights):
    flight = fly(
        motion=motion, seed=seed, ground_tilt_deg=tilt, flights=flights, motion_seconds=10.0, roll_deg=160.0
    )
    primary = flight["primary"]
    assert len(flight.rests) == (flights + 1 if motion == "quadrotor" else 2 * flights + 1)
    resting = within(primary.time, flight.rests)
    force = np.linalg.norm(primary.specific_force[resting], axis=1)
    assert force == pytest.approx(GRAVITY, abs=1e-9)
    assert np.abs(primary.angular_rate[resting]).max() == 0.0
    up = flight.path(primary.time[:1]).level_from_case[0] @ rotation([np.radians(-160.0), 0.0, 0.0])[:, 2]
    assert np.degrees(np.arccos(min(1.0, up[2]))) == pytest.approx(tilt, abs=1e-5)


def test_quadrotor_turns_about_all_axes_and_feels_thrust_and_drag():
    flight = fly(motion_seconds=60.0)
    time = np.arange(*flight.manoeuvres[0], 0.01)
    truth = flight.truth(time)
    assert np.all(truth.angular_rate.std(axis=0) > 0.3)
    assert np.all(truth.specific_force.std(axis=0) > 0.7)
    assert np.abs(truth.angular_rate).max() < 4.0


def test_a_vehicle_hardly_pitches_or_rolls_but_brakes_and_corners():
    flight = fly(motion="vehicle", motion_seconds=120.0)
    time = np.arange(*flight.manoeuvres[0], 0.01)
    truth = flight.truth(time)
    assert np.all(truth.specific_force.std(axis=0)[:2] > 0.4)
    assert np.all(truth.angular_rate.std(axis=0)[:2] < 0.15)


def test_with_no_sway_a_quadrotor_turns_about_up_alone():
    flight = fly(sway=(0.0, 0.0, 0.0), ground_tilt_deg=0.0)
    truth = flight.truth(np.arange(*flight.manoeuvres[0], 0.01))
    assert np.abs(truth.angular_rate[:, :2]).max() < 1e-12
    assert np.abs(truth.angular_rate[:, 2]).max() > 0.1
    assert truth.specific_force == pytest.approx(np.tile([0.0, 0.0, GRAVITY], (len(truth.time), 1)))


def test_the_earths_rate_is_felt_at_rest_where_a_latitude_is_given():
    flight = fly(latitude_deg=60.0, ground_tilt_deg=0.0)
    expected = 7.292115e-5 * np.array([0.0, 0.5, np.sqrt(0.75)])
    assert flight["primary"].angular_rate[7] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("motion", ["quadrotor", "vehicle"])
def test_vibration_has_its_root_mean_square_in_motion_and_not_at_rest(motion):
    calm = fly(motion=motion)
    shaken = fly(motion=motion, vibration=VIBRATIONS[motion])
    apart = shaken["primary"].specific_force - calm["primary"].specific_force
    turned = shaken["primary"].angular_rate - calm["primary"].angular_rate
    time = calm["primary"].time
    start, end = calm.manoeuvres[0]
    running, resting = within(time, [[start + 1.5, end - 1.5]]), within(time, calm.rests)
    usual = VIBRATIONS[motion]
    assert apart[running].std(axis=0) == pytest.approx(usual.specific_force, rel=0.1)
    assert turned[running].std(axis=0) == pytest.approx(usual.angular_rate, rel=0.1)
    assert np.abs(apart[resting]).max() == np.abs(turned[resting]).max() == 0.0


def test_permanent_vibration_is_equal_at_rest_and_in_motion():
    restless = replace(VIBRATIONS["quadrotor"], at_rest=1.0)
    flight = fly(vibration=restless)
    primary = flight["primary"]
    resting = within(primary.time, flight.rests)
    assert primary.specific_force[resting].std(axis=0) == pytest.approx(4.0, rel=0.1)


def test_filter_reads_the_mean_of_a_period_and_no_filter_the_instant():
    units = (ideal(filtered=True), ideal(filtered=False), ideal(filtered=True, rate_hz=50.0))
    rigid = replace(VIBRATIONS["quadrotor"], flexing=0.0)
    flight = fly(units=units, vibration=rigid)
    for unit, averaging in zip(flight.units, (0.005, 0.0, 0.02), strict=True):
        truth = flight.truth(unit.time, averaging)
        np.testing.assert_allclose(unit.specific_force, truth.specific_force, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(unit.angular_rate, truth.angular_rate, rtol=0.0, atol=1e-12)
    usual = flight.truth(flight["primary"].time)
    assert np.array_equal(usual.specific_force, flight.truth(usual.time, 0.005).specific_force)
    shaking = [
        (unit.specific_force - fly(units=units)[unit.name].specific_force).std() for unit in flight.units
    ]
    assert shaking[1] > 1.3 * shaking[0] > 2.0 * shaking[2]


def test_separate_vibration_of_places_has_the_requested_share():
    vibration = Vibration(
        specific_force=2.0, angular_rate=0.0, tones_hz=(90.0,), band_hz=(60.0, 140.0), flexing=0.1
    )
    primary, *others = fly(vibration=vibration, units=(ideal(), ideal(), ideal())).units
    running = within(primary.time, [[12.0, 30.0]])
    apart = [(other.specific_force - primary.specific_force)[running] for other in others]
    for each in apart:
        assert each.std(axis=0) == pytest.approx(0.2, rel=0.1)
    assert np.abs(apart[0] - apart[1]).max() > 0.1


def test_truth_is_there_for_any_time_though_the_primary_has_died():
    dead = fly(units=(ideal(faults=[Fault("dead", start=10.0)]), ideal()))
    alive = fly(units=(ideal(), ideal()))
    assert dead["primary"].time[-1] < 10.0
    truth = dead.truth(alive["primary"].time)
    np.testing.assert_allclose(truth.specific_force, alive["primary"].specific_force, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(truth.angular_rate, alive["primary"].angular_rate, rtol=0.0, atol=1e-12)


def test_clock_shows_its_offset_and_samples_arrive_after_latency():
    units = (
        ideal(latency_seconds=0.004),
        ideal(clock_offset_seconds=2.5, clock_skew_ppm=100.0, rate_hz=50.0, latency_seconds=0.02),
    )
    primary, secondary = fly(units=units).units
    assert primary.arrival - primary.time == pytest.approx(0.004)
    taken = secondary.arrival - 0.02
    assert secondary.time == pytest.approx(taken + 2.5 + 1e-4 * taken, abs=1e-9)
    assert np.diff(secondary.time) == pytest.approx(0.02)
    assert primary.recording.metadata.clock == secondary.recording.metadata.clock == ""
    assert fly()["primary"].recording.metadata.clock == "flight"


def test_phases_are_drawn_by_default_and_the_primary_has_zero():
    flight = fly(units=[replace(ideal(), phase=None)] * 3)
    first = [unit.time[0] * 200.0 for unit in flight.units]
    assert first[0] == 0.0
    assert first[1] != first[2]
    assert all(0.0 < phase < 1.0 for phase in first[1:])


def test_biases_age_by_grade_or_by_request_and_the_truth_states_it():
    grade = Grade.named("consumer")
    drawn = [
        fly(seed=seed, units=(FlightUnit(ageing=2.0),), motion_seconds=5.0)["primary"] for seed in range(60)
    ]
    scatter = np.sqrt(np.mean([unit.accelerometer_ageing**2 for unit in drawn]))
    assert scatter == pytest.approx(2.0 * grade.accelerometer.turn_on_bias, rel=4.0 / np.sqrt(2 * 180))
    young = fly(units=(FlightUnit(ageing=0.0),))["primary"]
    old = fly(units=(FlightUnit(accelerometer_ageing=(0.3, 0.0, -0.1), gyroscope_ageing=(0.0, 0.02, 0.0)),))
    aged = old["primary"]
    assert aged.accelerometer.b - young.accelerometer.b == pytest.approx([0.3, 0.0, -0.1])
    assert aged.gyroscope.b - young.gyroscope.b == pytest.approx([0.0, 0.02, 0.0])
    assert aged.specific_force - young.specific_force == pytest.approx(
        np.tile([0.3, 0.0, -0.1], (len(aged.time), 1)), abs=1e-9
    )
    assert np.array_equal(aged.accelerometer.M, young.accelerometer.M)


def test_a_unit_that_warms_up_drifts_by_its_coefficient():
    unit = FlightUnit(grade="consumer", ageing=0.0)
    warming = {"warm_up_kelvin": 20.0, "warm_up_seconds": 15.0}
    flights = [fly(units=(unit,), **each) for each in ({"warm_up_kelvin": 0.0}, warming)]
    cold, warm = (flight["primary"] for flight in flights)
    rise = 20.0 * (1.0 - np.exp(-warm.time / 15.0))
    assert flights[1].temperature(warm.time) == pytest.approx(25.0 + rise)
    assert warm.samples.temperature == pytest.approx(25.0 + rise, abs=0.01)
    expected = np.outer(rise, warm.accelerometer.temperature_coefficient)
    np.testing.assert_allclose(warm.specific_force - cold.specific_force, expected, rtol=0.0, atol=1e-9)
    assert warm.accelerometer.drift == pytest.approx(expected.mean(axis=0))


def test_one_more_unit_changes_nothing_for_the_others():
    units = (FlightUnit(), FlightUnit(grade="tactical"))
    two = fly(units=units, vibration=None)
    three = fly(units=(*units, FlightUnit()), vibration=None)
    for unit, same in zip(two.units, three.units[:2], strict=True):
        assert np.array_equal(unit.specific_force, same.specific_force)
        assert np.array_equal(unit.time, same.time)
