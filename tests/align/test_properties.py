"""Two units on one body: rotation, offset and lever arm are found, to within their sigmas."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, lfilter
from scipy.spatial.transform import Rotation

import tumble
from align_motions import GRAVITY, Motion, Sensor, drawn, errors, record, recordings
from repetitions import repetitions
from tumble.foundation.results import INTERVAL
from tumble.procedures.align.procedure import unit_settings

SIGMAS = 6.0
"""A multiple of sigma that three thousand figures do not exceed."""

coordinates = st.floats(-0.5, 0.5, width=32)
rotation_vectors = st.tuples(*[st.floats(-3.0, 3.0, width=32)] * 3)


def aligned(motion, primary, secondary, seconds=30.0, **options):
    """The one secondary of a made-up log."""
    first, second = recordings(motion, (primary, secondary), seconds)
    return tumble.align(first, [second], **options).units[0]


def assert_found(unit, motion, primary, secondary, seconds=30.0):
    for name, (error, sigma) in errors(unit, primary, secondary, seconds).items():
        assert np.all(np.abs(error) < SIGMAS * sigma), f"{name}: {error} of sigma {sigma}, seed {motion.seed}"


@settings(max_examples=25)
@given(st.integers(0, 10**6), rotation_vectors, st.floats(-2.0, 2.0), st.tuples(*[coordinates] * 3))
def test_any_rotation_offset_and_lever_arm_is_found(seed, vector, offset, arm):
    motion = Motion(seed)
    secondary = drawn(
        seed,
        sensor_from_body=Rotation.from_rotvec(vector),
        offset=offset,
        lever_arm=arm,
        rate_hz=100.0,
    )
    primary = Sensor(rate_hz=100.0)
    assert_found(aligned(motion, primary, secondary), motion, primary, secondary)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, -1, 0), (0.6, 0.0, 0.8)])
def test_unit_on_the_other_side_of_the_board_is_rotated_by_180_deg(axis):
    half = Rotation.from_rotvec(np.pi * np.array(axis) / np.linalg.norm(axis))
    motion, secondary = Motion(11), drawn(11, sensor_from_body=half)
    unit = aligned(motion, Sensor(), secondary)
    assert np.abs(unit.sensor_from_primary - half.as_matrix()).max() < 1e-3
    assert_found(unit, motion, Sensor(), secondary)


@pytest.mark.parametrize(("ours", "theirs"), [(50.0, 400.0), (400.0, 50.0), (100.0, 250.0), (62.5, 1000.0)])
def test_sigmas_hold_for_units_at_different_rates(ours, theirs):
    motion, primary = Motion(12), Sensor(rate_hz=ours)
    secondary = drawn(12, rate_hz=theirs)
    assert_found(aligned(motion, primary, secondary), motion, primary, secondary)


def test_irregular_time_stamps_do_no_harm():
    motion, primary = Motion(13), Sensor(jitter=0.9)
    secondary = drawn(13, jitter=0.9, rate_hz=130.0)
    assert_found(aligned(motion, primary, secondary), motion, primary, secondary)


def test_askew_primary_keeps_the_lever_arm_in_its_own_frame():
    motion = Motion(14)
    primary = Sensor(sensor_from_body=Rotation.from_rotvec([0.4, -1.2, 2.0]), lever_arm=(0.05, 0.02, -0.3))
    secondary = drawn(14)
    assert_found(aligned(motion, primary, secondary), motion, primary, secondary)


def test_clocks_of_which_one_is_fast_agree_in_the_middle_of_the_log():
    motion, secondary = Motion(15), drawn(15, skew=4e-4)
    unit = aligned(motion, Sensor(), secondary, 120.0)
    assert_found(unit, motion, Sensor(), secondary, 120.0)
    (warning,) = unit.warnings
    told = re.match(r"the clocks drift apart by ([\d.]+) ppm: the offset holds at 60\.0 s", warning)
    assert float(told[1]) == pytest.approx(400.0, abs=1.0)


def test_units_on_one_clock_have_no_skew_but_may_be_late():
    motion, secondary = Motion(16), drawn(16, skew=0.0, offset=-0.0123)
    first, second = recordings(motion, (Sensor(), secondary), 30.0, clock="one")
    unit = tumble.align(first, [second]).units[0]
    assert (unit.skew, unit.skew_sigma) == (0.0, 0.0)
    assert unit.time_offset == pytest.approx(-0.0123, abs=SIGMAS * unit.time_offset_sigma)


def test_clocks_of_different_epochs_are_aligned_by_first_samples():
    motion, secondary = Motion(17), drawn(17, skew=0.0, offset=1.7e9 + 0.4)
    unit = aligned(motion, Sensor(), secondary)
    assert unit.time_offset - 1.7e9 == pytest.approx(0.4, abs=1e-4)
    assert any("no time in common" in warning for warning in unit.warnings)


def test_swapping_primary_and_secondary_inverts_the_alignment():
    exact = drawn(18, skew=0.0, gyroscope_stretch=(0.0, 0.0, 0.0))
    first, second = recordings(Motion(18), (Sensor(), exact), 60.0)
    there = tumble.align(first, [second]).units[0]
    back = tumble.align(second, [first]).units[0]
    assert np.abs(there.sensor_from_primary @ back.sensor_from_primary - np.eye(3)).max() < 1e-4
    assert there.time_offset + back.time_offset == pytest.approx(0.0, abs=1e-5)
    returned = there.lever_arm + there.sensor_from_primary.T @ back.lever_arm
    assert np.abs(returned).max() < 3.0 * np.sqrt(np.diag(there.lever_arm_covariance)).max()


def test_added_bias_is_recovered_and_changes_nothing_else():
    motion, secondary = Motion(19), drawn(19)
    before = aligned(motion, Sensor(), secondary)
    put = np.array([0.2, -0.1, 0.05])
    biased = replace(secondary, gyroscope_bias=tuple(secondary.gyroscope_bias + put))
    after = aligned(motion, Sensor(), biased)
    assert after.gyroscope_bias - before.gyroscope_bias == pytest.approx(put, abs=1e-6)
    assert after.sensor_from_primary == pytest.approx(before.sensor_from_primary, abs=1e-6)
    assert after.time_offset == pytest.approx(before.time_offset, abs=1e-7)
    assert after.lever_arm == pytest.approx(before.lever_arm, abs=1e-6)


def test_a_few_shocks_that_one_unit_alone_felt_hardly_matter():
    motion, secondary = Motion(20), drawn(20)
    arrays = [record(motion, sensor, 60.0, k) for k, sensor in enumerate((Sensor(), secondary))]
    generator = np.random.default_rng(20)
    struck = generator.integers(0, len(arrays[1][0]), 20)
    arrays[1][1][struck] += generator.normal(0.0, 100.0, (20, 3))
    arrays[1][2][struck] += generator.normal(0.0, 20.0, (20, 3))
    first, second = (tumble.Recording.from_arrays(f"u{k}", *each) for k, each in enumerate(arrays))
    assert_found(tumble.align(first, [second]).units[0], motion, Sensor(), secondary, 60.0)


def test_errors_follow_the_sigmas_and_intervals_cover_the_truth():
    scores, runs = {}, repetitions(40)
    for seed in range(500, 500 + runs):
        secondary = drawn(seed, rate_hz=120.0)
        unit = aligned(Motion(seed), Sensor(rate_hz=100.0), secondary, 60.0)
        for name, (error, sigma) in errors(unit, Sensor(), secondary, 60.0).items():
            scores.setdefault(name, []).extend(np.atleast_1d(error / sigma))
    assert {name: len(each) for name, each in scores.items()} == {
        "rotation": 3 * runs,
        "time offset": runs,
        "skew": runs,
        "lever arm": 3 * runs,
        "gyroscope bias": 3 * runs,
        "accelerometer bias": 3 * runs,
    }
    for name, each in scores.items():
        score = np.array(each)
        # Four sigmas of what such a sample has by chance.
        spread = 4.0 / np.sqrt(2.0 * len(score))
        assert 1.0 - spread < np.sqrt(np.mean(score**2)) < 1.0 + spread, name
        assert abs(score.mean()) < 4.0 / np.sqrt(len(score)), name
        assert np.mean(np.abs(score) < INTERVAL) > 0.95 - 4.0 * np.sqrt(0.95 * 0.05 / len(score)), name


def low_pass(values, rate_hz):
    """A low-pass of the second order at 10 Hz, as settled at the first sample."""
    return values[0] + lfilter(*butter(2, 10.0, fs=rate_hz), values - values[0], axis=0)


def delayed(values, rate_hz):
    """The same 20 ms late."""
    late = round(0.02 * rate_hz)
    return np.vstack([np.repeat(values[:1], late, axis=0), values[:-late]])


@pytest.mark.parametrize("respond", [low_pass, delayed])
@pytest.mark.parametrize(("unit", "triad"), [(1, 1), (1, 2), (0, 1), (0, 2)])
def test_lever_arm_holds_where_one_sensor_has_a_filter(respond, unit, triad):
    scores = []
    for seed in range(700, 700 + repetitions(6)):
        sensors = (Sensor(), drawn(seed, rate_hz=100.0))
        arrays = [list(record(Motion(seed), sensor, 60.0, k)) for k, sensor in enumerate(sensors)]
        arrays[unit][triad] = respond(arrays[unit][triad], sensors[unit].rate_hz)
        first, second = (tumble.Recording.from_arrays(f"u{k}", *each) for k, each in enumerate(arrays))
        error, sigma = errors(tumble.align(first, [second]).units[0], *sensors, 60.0)["lever arm"]
        scores.extend(error / sigma)
    assert np.sqrt(np.mean(np.square(scores))) < 1.8, scores


@pytest.mark.parametrize("seed", range(6))
def test_biases_hold_where_rests_are_rounded(seed):
    motion, primary, secondary = Motion(seed), Sensor(), drawn(seed, offset=0.0, skew=0.0)
    up = motion.world_from_body(np.zeros(1)).inv().apply([0.0, 0.0, GRAVITY])[0]
    step, rest, generator = 0.02, 6000, np.random.default_rng(seed)
    logs = []
    for k, sensor in enumerate((primary, secondary)):
        _, force, rate = record(motion, sensor, 30.0, k)
        still = np.tile(sensor.sensor_from_body.apply(up) + sensor.accelerometer_bias, (rest, 1))
        force = np.vstack([still + generator.normal(0.0, sensor.accelerometer_noise, (rest, 3)), force])
        noise = generator.normal(0.0, sensor.gyroscope_noise, (rest, 3))
        rate = np.vstack([sensor.gyroscope_bias + noise, rate])
        times = np.arange(len(rate)) / sensor.rate_hz
        logs.append(tumble.Recording.from_arrays(f"unit_{k}", times, force, step * np.rint(rate / step)))
    unit = tumble.align(logs[0], [logs[1]]).units[0]
    error = unit.gyroscope_bias - secondary.gyroscope_bias
    assert np.all(np.abs(error) < 5.0 * unit.gyroscope_bias_sigma), (error, unit.gyroscope_bias_sigma)


@pytest.mark.parametrize(("degrees", "seed"), [(0.3, 41), (2.0, 42), (10.0, 43)])
def test_a_unit_that_slips_half_way_is_named_and_both_rotations_hold(degrees, seed):
    before = drawn(seed)
    slip = Rotation.from_rotvec(np.radians(degrees) * np.array([0.6, 0.0, 0.8]))
    after = replace(before, sensor_from_body=slip * before.sensor_from_body)
    motion, seconds = Motion(seed), 60.0
    first, _ = recordings(motion, (Sensor(), before), seconds)
    time, *early = record(motion, before, seconds, 1)
    _, *late = record(motion, after, seconds, 1)
    half = len(time) // 2
    joined = [np.vstack([a[:half], b[half:]]) for a, b in zip(early, late, strict=True)]
    unit = tumble.align(first, [tumble.Recording.from_arrays("slipped", time, *joined)]).units[0]
    warning = next(warning for warning in unit.warnings if warning.startswith("from "))
    told = re.match(r"from ([\d.]+) s on the rotation differs by about ([\d.]+) deg", warning)
    assert float(told[1]) == pytest.approx(0.5 * seconds, abs=2.0)
    assert float(told[2]) == pytest.approx(degrees, rel=0.5)
    for sensor in (before, after):
        error, sigma = errors(unit, Sensor(), sensor, seconds)["rotation"]
        assert np.all(np.abs(error) < 3.0 * sigma), (error, sigma)


@pytest.mark.parametrize("at", [0.25, 0.5, 0.75])
@pytest.mark.parametrize("jump", [0.01, 0.05, 0.15])
def test_a_clock_that_is_set_has_no_offset_and_is_named(jump, at):
    motion, seconds = Motion(21), 60.0
    time, force, rate = record(motion, drawn(21, offset=0.3), seconds, 1)
    stamped = time + jump * (time > at * seconds)
    secondary = tumble.Recording.from_arrays("secondary", stamped, force, rate)
    primary = tumble.Recording.from_arrays("primary", *record(motion, Sensor(), seconds))
    result = tumble.align(primary, [secondary])
    (unit,) = result.units
    found = {each.name: each for each in unit.parameters}
    named = any("offset jumps by about" in line or "its clock was set" in line for line in unit.warnings)
    assert named, unit.warnings
    if found["time offset"].observable:
        assert found["time offset"].sigma > 0.2 * abs(jump)
    else:
        assert result.verdict == "partly aligned"
        assert "time_offset" not in unit_settings(result)["secondary"]
