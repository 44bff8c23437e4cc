"""A calibration is built up, noise first, then poses, and its file names the origin of each part."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from tumble import Calibration
from tumble.tools.simulate import simulate_multipose, write_multipose
from turntable_sessions import typed

REFERENCE, WARMER = 25.0, 12.0
SERIAL = "SIM-17-1"
SLOPE = np.array([2e-3, -1e-3, 3e-3])
SCALE = np.array([1e-4, -2e-4, 1e-4])
NOISE = {
    "noise_density": [7e-3, 8e-3, 9e-3],
    "bias_instability": [1e-3, None, 1e-3],
    "random_walk": [None] * 3,
}


@pytest.fixture(scope="module")
def hand():
    return simulate_multipose(seed=17, bias_instability=False, g_sensitivity=False, latitude_deg=None)


def start(**sections):
    return Calibration.model_validate({"name": "unit", "serial": SERIAL} | sections)


def section(triad="accelerometer", **more):
    unit = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}[triad]
    return {"unit": unit, "M": np.eye(3), "b": np.zeros(3)} | more


def test_noise_of_the_start_weighs_the_poses_and_stays_in_the_file(hand):
    begun = start(accelerometer=section(**NOISE))
    found = tumble.multipose(hand.recording, calibration=begun)
    made = found.calibration
    np.testing.assert_array_equal(made.accelerometer.noise_density, NOISE["noise_density"])
    assert np.isnan(made.accelerometer.random_walk).all()
    quieter = start(accelerometer=section(noise_density=[7e-4, 8e-4, 9e-4], bias_instability=[0.0] * 3))
    loud, quiet = (
        tumble.multipose(hand.recording, calibration=each).poses[0].sigma for each in (begun, quieter)
    )
    assert loud > 5.0 * quiet


@pytest.mark.parametrize("scale", [False, True])
def test_temperature_drift_is_removed_before_the_fit(hand, scale):
    drift = {"reference": REFERENCE, "range": [-20.0, 70.0], "bias": [SLOPE]}
    factor = 1.0 + (SCALE * WARMER if scale else np.zeros(3))
    if scale:
        drift["scale"] = [SCALE]
    cold = hand.unit.samples
    bias = hand.unit.accelerometer.b
    warm = tumble.Recording.from_arrays(
        "unit",
        cold.time,
        factor * (cold.accelerometer - bias) + bias + SLOPE * WARMER,
        cold.gyroscope,
        temperature=np.full(len(cold.time), REFERENCE + WARMER),
    )
    begun = start(accelerometer=section(temperature_drift=drift))
    expected = tumble.multipose(
        tumble.Recording.from_arrays("unit", cold.time, cold.accelerometer, cold.gyroscope)
    )
    found = tumble.multipose(warm, calibration=begun)
    np.testing.assert_allclose(found.accelerometer.b, expected.accelerometer.b, rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(found.accelerometer.M, expected.accelerometer.M, rtol=0.0, atol=1e-6)
    kept = found.calibration.accelerometer.temperature_drift
    assert kept.content() == begun.accelerometer.temperature_drift.content()


def test_noise_then_poses_then_noise_again_say_what_gave_what(hand, tmp_path):
    log = write_multipose(hand, tmp_path)["log"]
    done = typed("simulate", "static", "--duration", "10min", "--rate", 50, "-o", tmp_path / "static")
    assert done.code == 0, done.err
    still = tmp_path / "static" / "static.csv"
    assert typed("noise", still, "--serial", SERIAL, "-o", tmp_path / "noise").code in (0, 3)
    first = tmp_path / "noise" / "static.noise.yaml"
    noise = Calibration.load(first)
    assert noise.method is None
    (by_noise,) = noise.contributions
    assert by_noise.gave == ("accelerometer noise", "gyroscope noise")
    assert by_noise.method.procedure == "noise"
    assert by_noise.date
    assert [(each.file, len(each.sha256)) for each in by_noise.logs] == [("static.csv", 64)]
    done = typed("multipose", log, "--calibration", first, "-o", tmp_path / "poses")
    assert done.code == 0, done.err
    second = next((tmp_path / "poses").glob("*.yaml"))
    poses = Calibration.load(second)
    assert poses.method.procedure == "multipose"
    assert poses.contributions == (by_noise,)
    np.testing.assert_array_equal(poses.gyroscope.noise_density, noise.gyroscope.noise_density)
    assert typed(
        "noise", still, "--serial", SERIAL, "--calibration", second, "-o", tmp_path / "again"
    ).code in (
        0,
        3,
    )
    third = Calibration.load(tmp_path / "again" / "static.noise.yaml")
    assert third.method == poses.method
    assert [each.gave for each in third.contributions] == [by_noise.gave]
    np.testing.assert_array_equal(third.accelerometer.M, poses.accelerometer.M)


def test_temperature_added_to_poses_names_the_source_of_each_part(hand, tmp_path):
    poses = write_multipose(hand, tmp_path)["log"]
    assert typed("multipose", poses, "-o", tmp_path / "poses").code == 0
    begun = next((tmp_path / "poses").glob("*.yaml"))
    done = typed(
        "simulate", "thermal", "--duration", "10min", "--accelerometer", "2e-3", "-o", tmp_path / "warm"
    )
    assert done.code == 0, done.err
    warm = tmp_path / "warm" / "thermal.csv"
    done = typed("thermal", warm, "--serial", SERIAL, "--calibration", begun, "-o", tmp_path / "out")
    assert done.code in (0, 3), done.err
    found = Calibration.load(tmp_path / "out" / "thermal.yaml")
    assert found.method.procedure == "multipose"
    (by_warmth,) = found.contributions
    assert by_warmth.gave == ("accelerometer temperature drift", "gyroscope temperature drift")
    done = typed(
        "apply", tmp_path / "out" / "thermal.yaml", warm, "--serial", SERIAL, "-o", tmp_path / "flat.csv"
    )
    assert done.code == 0
    assert "warning" not in done.err
    flat = np.loadtxt(tmp_path / "flat.csv", delimiter=",", skiprows=4)
    force, temperature = flat[:, 1:4], flat[:, 7]
    ends = [force[temperature < -5.0].mean(axis=0), force[temperature > 55.0].mean(axis=0)]
    # 2e-3 m/s^2/K over 60 K would be 0.12.
    assert np.abs(ends[1] - ends[0]).max() < 0.01


def test_poses_take_over_from_a_turntable_what_they_find_and_no_more(hand):
    begun = start(
        software="tumble 0.0",
        date="2026-01-01T00:00:00Z",
        method={"procedure": "turntable"},
        log={"file": "table.csv"},
        accelerometer=section(estimated=["bias", "matrix"], noise_density=[1e-3] * 3),
        gyroscope=section("gyroscope", estimated=["bias", "matrix"]),
    )
    made = tumble.multipose(hand.recording, calibration=begun).calibration
    (left,) = made.contributions
    assert left.gave == ("accelerometer noise",)
    assert (left.method.procedure, left.date, left.logs[0].file) == (
        "turntable",
        "2026-01-01T00:00:00Z",
        "table.csv",
    )


def test_a_calibration_of_another_unit_is_no_start(hand, tmp_path):
    start(accelerometer=section()).save(tmp_path / "other.yaml")
    log = write_multipose(hand, tmp_path)["log"]
    done = typed(
        "multipose", log, "--serial", "SN 2", "--calibration", tmp_path / "other.yaml", "-o", tmp_path / "out"
    )
    assert done.code == 2
    assert "--calibration: is of unit SIM-17-1, the log of unit SN 2" in done.err
    done = typed("multipose", log, "--raw", "--calibration", tmp_path / "other.yaml", "-o", tmp_path / "out")
    assert done.code == 2
    assert "--calibration is of readings in SI units, --raw of counts" in done.err
