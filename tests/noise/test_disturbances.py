"""Steps, ramps and knocks of a record at rest: found, named and left out; nothing is found of noise alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

import tumble
from tumble import _core
from tumble.foundation.noise_terms import RANDOM_WALK, WHITE
from tumble.foundation.recording import Recording
from tumble.procedures.noise.course import NoiseCourse
from tumble.procedures.noise.result import KNOCK, STEP
from tumble.procedures.noise.result import RAMP_OF_LEVEL as RAMP
from tumble.procedures.noise.samples import without
from turntable_sessions import typed

CASE = Path(__file__).parents[3] / "shared" / "data" / "cases" / "noise_step"
RATE = 100.0
DENSITY = 1e-3
SEED = 271
HOUR = 3600.0


def drawn(terms, seconds=HOUR, seed=SEED):
    print(f"seed {seed}")
    samples = round(seconds * RATE)
    values = _core.StillNoise(seed, np.array([terms] * 6), RATE, samples).draw(samples)
    return np.arange(samples) / RATE, values


def found_in(time, values):
    watch = _core.NoiseWatch(6)
    watch.push(time, np.ascontiguousarray(values), True)
    return [of_channel for of_channel, _ in watch.conclude()]


def at_rest(time, values):
    return Recording.from_arrays("still", time, values[:, :3] + [0.0, 0.0, 9.8], values[:, 3:])


@pytest.mark.parametrize(
    "terms",
    [(0.0, DENSITY, 0.0, 0.0, 0.0), (0.0, DENSITY, 3e-4, 6e-5, 0.0), (0.0, DENSITY, 0.0, DENSITY, 0.0)],
    ids=["white", "flicker and walk", "random walk"],
)
def test_noise_alone_of_any_kind_is_no_disturbance(terms):
    assert found_in(*drawn(terms)) == [[]] * 6


def test_noise_behind_a_filter_is_no_disturbance():
    time, values = drawn((0.0, DENSITY, 0.0, 0.0, 0.0))
    response = np.exp(-np.arange(40) / 3.0)
    smooth = np.column_stack([np.convolve(column, response, "same") for column in values.T])
    assert found_in(time, smooth) == [[]] * 6


def test_a_step_is_found_with_its_time_and_size():
    time, values = drawn((0.0, DENSITY, 1e-4, 1e-5, 0.0))
    values[time >= 1800.0] += 20.0 * 1e-4
    for channel in found_in(time, values):
        (step,) = channel
        assert step["kind"] == STEP
        assert step["time"][0] - 30.0 < 1800.0 < step["time"][1] + 30.0
        assert abs(step["size"] - 2e-3) < 4.5 * step["sigma"]


def test_a_ramp_is_no_step_and_a_knock_is_neither():
    time, values = drawn((0.0, DENSITY, 1e-4, 1e-5, 0.0))
    values[:, 0] += 5e-3 * np.clip((time - 1000.0) / 100.0, 0.0, 1.0)
    burst = (time > 1000.0) & (time < 1000.2)
    values[burst, 1] += 0.05 * np.sin(40.0 * np.pi * time[burst])
    values[50_000, 2] += 0.3
    ramp, burst, spike, *others = found_in(time, values)
    assert [each["kind"] for each in ramp] == [RAMP]
    assert ramp[0]["time"][0] < 1050.0 < ramp[0]["time"][1]
    assert ramp[0]["size"] > 2e-3
    for knock, at in ((burst, 1000.1), (spike, 500.0)):
        assert [each["kind"] for each in knock] == [KNOCK]
        assert knock[0]["time"][0] - 0.5 < at < knock[0]["time"][1] + 0.5
    assert others == [[]] * 3


def test_a_knock_that_ends_a_rest_is_named_and_not_silent():
    time, values = drawn((0.0, DENSITY, 0.0, 0.0, 0.0), seconds=300.0)
    struck = (time > 100.0) & (time < 100.3)
    values[struck, :3] += 2.0 * np.sin(30.0 * time[struck])[:, None]
    result = tumble.noise(at_rest(time, values))
    (line,) = (line for line in result.warnings if "is knocked" in line)
    assert "accelerometer x, y and z is knocked" in line
    assert "at 100." in line
    assert result["accelerometer x"].term(WHITE).value == pytest.approx(DENSITY, rel=0.02)


def test_a_pose_of_its_own_is_no_step():
    time, values = drawn((0.0, DENSITY, 0.0, 0.0, 0.0), seconds=300.0)
    turning = (time > 100.0) & (time < 120.0)
    values[turning] += np.sin(time[turning])[:, None]
    values[time > 110.0, 0] += 5.0
    result = tumble.noise(at_rest(time, values))
    assert not [each for each in result.disturbances if each.kind == STEP]


def test_steps_do_not_change_what_is_found_of_the_noise():
    time, values = drawn((0.0, DENSITY, 0.0, 0.0, 0.0), seconds=900.0)
    plain = tumble.noise(at_rest(time, values))
    values[time >= 400.0] += 0.01
    stepped = tumble.noise(at_rest(time, values))
    assert [each.channel for each in sorted(stepped.disturbances, key=lambda each: each.channel)] == [
        f"{triad} {axis}" for triad in ("accelerometer", "gyroscope") for axis in "xyz"
    ]
    for one, other in zip(plain, stepped, strict=True):
        assert other.term(WHITE).value == pytest.approx(one.term(WHITE).value, rel=5e-3)
        assert other.misfit == 0.0


def test_rests_are_parted_where_they_were_disturbed():
    rests = np.array([[0.0, 10.0], [20.0, 30.0]])
    parted = without(rests, [(4.0, 5.0), (25.0, 40.0)])
    np.testing.assert_allclose(parted, [[0.0, 4.0], [5.0, 10.0], [20.0, 25.0]])
    np.testing.assert_array_equal(without(rests, []), rests)


@pytest.mark.skipif(not CASE.is_dir(), reason="the recordings in ../shared/data are not here")
def test_the_step_of_a_given_case_is_named_and_costs_nothing(tmp_path):
    done = typed("noise", CASE / "still.parquet", "--gyroscope-unit", "rad/s", "-o", tmp_path)
    assert "accelerometer x steps by 0.02 m/s^2 at 1800.0 s" in done.out
    assert "low-pass" not in done.out
    found = tumble.Calibration.load(tmp_path / "still.noise.yaml").accelerometer.noise_density
    np.testing.assert_allclose(found, 1.5e-3, rtol=0.005)


QUARTER = 900.0


def test_drift_while_warming_up_is_no_random_walk():
    time, values = drawn((0.0, DENSITY, 0.0, 0.0, 0.0), QUARTER)
    drift = 10.0 * DENSITY * np.exp(-time / 60.0)
    warmed = tumble.noise(at_rest(time, values + drift[:, None] * [1.0, 0.0, 0.0, 0.3, 0.0, 0.0]))
    for name in ("accelerometer x", "gyroscope x"):
        walk = warmed[name].term(RANDOM_WALK)
        assert not walk.observable
        assert walk.high > 0.0
        assert warmed[name].term(WHITE).observable
    assert any(
        "accelerometer x" in line and "level drifts from 0 to 12 %" in line for line in warmed.warnings
    )


def test_noise_that_is_the_same_throughout_does_not_drift():
    for terms in (
        (0.0, DENSITY, 0.0, 0.0, 0.0),
        (0.0, DENSITY, 5e-4, 0.0, 0.0),
        (0.0, DENSITY, 0.0, 1e-4, 0.0),
    ):
        course = NoiseCourse()
        course.push(drawn(terms, QUARTER)[1])
        assert course.drifts() == []


def test_quiet_parts_of_slow_noise_are_not_chosen_for_rests():
    time, values = drawn((0.0, DENSITY, 0.0, 0.0, 0.0), QUARTER)
    share = 1.0 - np.exp(-1.0 / (RATE * 1.3))
    slow = lfilter([share], [1.0, share - 1.0], values, axis=0)
    filtered = tumble.noise(at_rest(time, slow))
    assert filtered.still.used > 0.9 * filtered.still.samples
    assert filtered.verdict == "model not met"
    assert any("sways between rests" in line for line in filtered.warnings)
