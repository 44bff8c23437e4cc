"""Units that no log states: readings show them, or they are reported as assumed, or asked for."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from log_fixtures import refusal, write_text
from repetitions import repetitions
from tumble.foundation.recording import ASSUMED, AT_REST, Chunk
from tumble.logs import ReadOptions, open_recording
from tumble.logs.unit_evidence import rest_in
from tumble.logs.units import guess_time_unit, possible_temperature, rate_unit_at_rest

DEGREE = math.pi / 180.0


def resting(seed, rate, bias, noise, samples=400):
    """At rest, tilted anyhow: a Chunk with a bias, rad/s, across gravity, and white noise, rad/s/sqrt(Hz)."""
    random = np.random.default_rng(seed)
    up = random.normal(size=3)
    up /= np.linalg.norm(up)
    across = np.cross(up, random.normal(size=3))
    across *= bias / np.linalg.norm(across)
    force = 9.80665 * up + random.normal(0.0, 0.02, (samples, 3))
    rates = across + random.normal(0.0, noise * math.sqrt(rate), (samples, 3))
    return Chunk(np.arange(samples) / rate, force, rates)


sensors = st.fixed_dictionaries(
    {
        "seed": st.integers(0, 2**32 - 1),
        "rate": st.sampled_from([20.0, 100.0, 400.0]),
        "bias": st.floats(math.log(0.01 * DEGREE), math.log(10.0 * DEGREE)).map(math.exp),
        "noise": st.floats(math.log(0.0005 * DEGREE), math.log(0.03 * DEGREE)).map(math.exp),
    }
)
"""MEMS gyroscopes as data sheets have them: bias to 10 deg/s, noise to 0.03 deg/s/sqrt(Hz)."""


@settings(max_examples=repetitions(300))
@given(sensor=sensors, unit=st.sampled_from(["rad/s", "deg/s"]))
def test_no_rest_shows_a_unit_that_is_not_its_own(sensor, unit):
    chunk = resting(**sensor)
    scale = 1.0 if unit == "rad/s" else 1.0 / DEGREE
    rest = rest_in(chunk.accelerometer, chunk.gyroscope * scale, 1.0 / sensor["rate"])
    assert rate_unit_at_rest(rest) in (None, unit)


optical = st.fixed_dictionaries(
    {
        "seed": st.integers(0, 2**32 - 1),
        "rate": st.sampled_from([50.0, 100.0, 400.0]),
        "bias": st.floats(math.log(0.0005 * DEGREE), math.log(0.006 * DEGREE)).map(math.exp),
        "noise": st.floats(math.log(1.6e-5 * DEGREE), math.log(1.6e-3 * DEGREE)).map(math.exp),
    }
)
"""Gyroscopes of fibres and lasers: 0.001 to 0.1 deg/sqrt(h), and the Earth's rotation."""


@settings(max_examples=repetitions(200))
@given(sensor=optical)
def test_degrees_of_an_optical_gyroscope_are_not_taken_for_radians(sensor):
    chunk = resting(**sensor)
    rest = rest_in(chunk.accelerometer, chunk.gyroscope / DEGREE, 1.0 / sensor["rate"])
    assert rate_unit_at_rest(rest) in (None, "deg/s")


def test_a_log_that_states_degrees_of_an_optical_gyroscope_is_read(tmp_path):
    chunk = resting(5, 100.0, 0.004 * DEGREE, 1.6e-4 * DEGREE)
    header = "time [s],ax,ay,az,gx [deg/s],gy [deg/s],gz [deg/s]"
    path = write_text(tmp_path / "log.csv", chunk, header, scale=(1.0, 1.0, 1.0 / DEGREE))
    assert open_recording(path).metadata.gyroscope_unit.name == "deg/s"


@pytest.mark.parametrize("turns", [0.0, 2.0])
def test_thousandths_of_a_degree_are_known_at_rest(tmp_path, turns):
    """A peak of 136 was taken for deg/s whatever the noise at rest."""
    chunk = resting(5, 100.0, 0.05 * DEGREE, 0.004 * DEGREE)
    chunk.gyroscope[-100:, 2] += turns * DEGREE
    path = write_text(tmp_path / "log.csv", chunk, scale=(1.0, 1.0, 1000.0 / DEGREE))
    unit = open_recording(path).metadata.gyroscope_unit
    assert unit.name == "mdeg/s"
    assert unit.reason in (AT_REST, ASSUMED)


def test_most_gyroscopes_in_degrees_are_known_at_rest():
    random = np.random.default_rng(3)
    known = 0
    for seed in range(200):
        bias = math.exp(random.normal(math.log(1.0), 0.8)) * DEGREE
        noise = math.exp(random.normal(math.log(0.007), 0.7)) * DEGREE
        chunk = resting(seed, 100.0, bias, noise)
        rest = rest_in(chunk.accelerometer, chunk.gyroscope / DEGREE, 0.01)
        known += rate_unit_at_rest(rest) == "deg/s"
    assert known > 140


def test_a_unit_in_flight_shows_nothing():
    chunk = resting(1, 100.0, 0.5, 0.3 * DEGREE)
    chunk.accelerometer[:] += np.random.default_rng(2).normal(0.0, 1.0, chunk.accelerometer.shape)
    assert rest_in(chunk.accelerometer, chunk.gyroscope, 0.01) is None


def test_a_frozen_unit_shows_nothing():
    force, rate = np.tile([0.0, 0.0, 9.8], (100, 1)), np.tile([1.0, 0.0, 0.0], (100, 1))
    assert rest_in(force, rate, 0.01) is None


@pytest.mark.parametrize("bias", [0.5, 3.0, 10.0])
def test_degrees_without_a_unit_are_read_as_degrees(tmp_path, bias):
    chunk = resting(5, 100.0, bias * DEGREE, 0.008 * DEGREE)
    path = write_text(tmp_path / "log.csv", chunk, scale=(1.0, 1.0, 1.0 / DEGREE))
    unit = open_recording(path).metadata.gyroscope_unit
    assert (unit.name, unit.reason) == ("deg/s", AT_REST)


def test_a_unit_that_nothing_shows_is_reported_as_assumed(tmp_path):
    chunk = resting(5, 100.0, 0.02 * DEGREE, 0.08 * DEGREE)
    metadata = open_recording(write_text(tmp_path / "log.csv", chunk)).metadata
    assert metadata.gyroscope_unit.reason == ASSUMED
    assert "--gyroscope-unit" in " ".join(metadata.assumptions)


def test_a_stated_unit_that_gravity_contradicts_is_refused(tmp_path):
    chunk = resting(5, 100.0, 3.0 * DEGREE, 0.008 * DEGREE)
    header = "time_s,ax_mps2,ay_mps2,az_mps2,gx_radps,gy_radps,gz_radps"
    path = write_text(tmp_path / "log.csv", chunk, header=header, scale=(1.0, 1.0, 1.0 / DEGREE))
    assert "read it with --gyroscope-unit deg/s" in refusal(path)
    assert open_recording(path, ReadOptions(gyroscope_unit="rad/s")).metadata.gyroscope_unit.name == "rad/s"


@settings(max_examples=repetitions(300))
@given(
    rate=st.floats(math.log(1.0), math.log(10_000.0)).map(math.exp),
    duration=st.floats(math.log(5.0), math.log(10_000.0)).map(math.exp),
    unit=st.sampled_from(["s", "ms", "us", "ns"]),
)
def test_no_step_shows_a_unit_of_time_that_is_not_its_own(rate, duration, unit):
    ticks = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[unit]
    time = np.arange(50) * ticks / rate
    time = time if unit == "s" else np.round(time)
    if (np.diff(time) <= 0.0).any():
        return
    guess = guess_time_unit(time, samples=max(50, round(rate * duration)))
    assert guess.name == unit or guess.is_open or unit in guess.others


@pytest.mark.parametrize(("step", "rates"), [(500, ("2 Hz in ms", "2000 Hz in us")), (1, ("1 Hz in s",))])
def test_a_step_that_two_units_explain_is_asked_for(tmp_path, step, rates):
    chunk = resting(5, 2.0, 0.01, 1e-4, samples=2000)
    path = write_text(tmp_path / "log.csv", chunk, scale=(2.0 * step, 1.0, 1.0))
    rows = path.read_text().splitlines()
    path.write_text("\n".join([rows[0], *(row.replace(".0,", ",", 1) for row in rows[1:])]) + "\n")
    line = refusal(path)
    assert all(rate in line for rate in rates)
    assert "--time-unit" in line


@pytest.mark.parametrize(("shift", "read"), [(0.0, True), (273.15, True), (20_000.0, False)])
def test_temperatures_of_no_sensor_are_not_taken_for_degrees_celsius(tmp_path, shift, read):
    chunk = resting(5, 100.0, 0.01, 1e-4)
    path = write_text(tmp_path / "log.csv", chunk)
    head, *rows = path.read_text().splitlines()
    warm = np.linspace(20.0, 40.0, len(rows)) + shift
    lines = [f"{row},{value}" for row, value in zip(rows, warm, strict=True)]
    path.write_text("\n".join([f"{head},temperature", *lines]) + "\n")
    recording = open_recording(path)
    found = [chunk.temperature for chunk in recording.chunks()]
    if read:
        assert np.concatenate(found) == pytest.approx(np.linspace(20.0, 40.0, len(rows)))
    else:
        assert found == [None] * len(found)
        assert "--temperature-unit" in recording.metadata.temperature_fault
    assert (shift == 0.0) == (not recording.metadata.remarks)


def test_ranges_of_sensors_are_possible_temperatures():
    assert possible_temperature(np.array([-55.0, 175.0]), "degC")
    assert possible_temperature(np.array([218.0, 448.0]), "K")
    assert not possible_temperature(np.array([298.0]), "degC")


def test_stamps_that_fit_no_rate_of_an_imu_are_said(tmp_path):
    chunk = resting(5, 100.0, 0.01, 1e-4)
    path = write_text(tmp_path / "log.csv", chunk, scale=(1e-3, 1.0, 1.0))
    metadata = open_recording(path).metadata
    assert any("--time-unit" in line for line in (*metadata.remarks, *metadata.assumptions))
