"""Simulated thermal sessions: what was put in comes out, within its sigmas, as typed and from Python."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import yaml

import tumble
from log_fixtures import of_one_unit
from tumble._core import VOCABULARY
from tumble.calibration.document import Calibration
from tumble.foundation.recording import Chunk, Recording
from tumble.procedures.thermal.messages import MESSAGES
from tumble.tools.simulate import simulate_thermal
from turntable_sessions import contents, one_line, typed

SEED = 5
RATE = 10.0
ACCELEROMETER = (1e-3, 2e-5)
GYROSCOPE = (2e-5,)
FAR = 4.5
"""Sigmas that no estimate misses by."""
POWERS = {"accelerometer": "1e-3,2e-5", "gyroscope": "2e-5"}


def session(**changes):
    usual = {"seed": SEED, "rate_hz": RATE, "accelerometer": ACCELEROMETER, "gyroscope": GYROSCOPE}
    print(f"seed {changes.get('seed', SEED)}")
    return simulate_thermal(**{**usual, **changes})


def off(axis, truth):
    """Errors of the powers of an axis over their sigma, those beyond the truth's among them."""
    sigmas = np.sqrt(np.diag(axis.covariance))[: len(axis.bias)]
    true = np.pad(np.array(truth), (0, max(0, len(axis.bias) - len(truth))))[: len(axis.bias)]
    return (axis.bias - true) / sigmas


def changed(recording, change):
    """The same samples with something done to each chunk."""
    return Recording(recording.metadata, lambda: (change(chunk) for chunk in recording.chunks()))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("thermal")
    done = typed(
        *("simulate", "thermal", "--rate", RATE, "--seed", SEED, "-o", folder),
        *("--accelerometer", POWERS["accelerometer"], "--gyroscope", POWERS["gyroscope"]),
    )
    assert done.code == 0, done.err
    return folder


@pytest.fixture(scope="module")
def content(folder):
    done = typed("thermal", folder / "thermal.csv", "--json", "-o", folder / "out")
    assert done.code == 0, done.out + done.err
    return json.loads(done.out)


def test_drift_and_order_of_every_axis_come_out_within_their_sigma(content, folder):
    truth = yaml.safe_load((folder / "truth.yaml").read_text())
    assert content["verdict"] == "measured"
    for axis in content["axes"]:
        powers = [row[0] for row in truth[axis["triad"]]["bias"]]
        assert len(axis["bias"]) >= len(powers), axis["name"]
        if len(axis["bias"]) == len(powers):
            sigmas = np.sqrt(np.diag(axis["covariance"]))[: len(powers)]
            assert np.all(np.abs(np.array(axis["bias"]) - powers) < FAR * sigmas), axis["name"]
        assert abs(axis["hysteresis"]["value"]) < FAR * axis["hysteresis"]["sigma"]
    assert sum(len(axis["bias"]) == len(truth[axis["triad"]]["bias"]) for axis in content["axes"]) >= 5


def test_the_calibration_file_corrects_what_temperature_did(folder, content):
    drift = Calibration.load(content["files"]["calibration"]).gyroscope.temperature_drift
    assert drift.range[0] == pytest.approx(-10.0, abs=1.0)
    assert drift.range[1] == pytest.approx(60.0, abs=1.0)
    assert drift.reference == pytest.approx(25.0, abs=1.0)
    assert drift.bias[0] == pytest.approx([GYROSCOPE[0]] * 3, rel=0.3)
    assert np.isfinite(drift.bias_sigma[0]).all()
    assert np.isfinite(drift.hysteresis).all()


def test_corrected_readings_no_longer_drift(folder, content, tmp_path):
    output = tmp_path / "corrected.csv"
    tumble.apply(content["files"]["calibration"], folder / "thermal.csv", output)
    before, after = (
        np.concatenate([chunk.accelerometer for chunk in tumble.open_recording(log).chunks()])
        for log in (folder / "thermal.csv", output)
    )
    minutes = [
        values[: len(values) // 600 * 600].reshape(-1, 600, 3).mean(axis=1) for values in (before, after)
    ]
    drift, left = (np.ptp(each, axis=0) for each in minutes)
    assert (drift > 0.05).all()
    assert (left < 0.1 * drift).all()


def test_the_page_shows_both_legs_orders_and_where_the_range_ends(folder, content):
    text = (folder / "out" / "thermal.html").read_text()
    for words in ("while warming", "Weight of each order", "largest hysteresis"):
        assert words in text
    assert "the drift at that edge is held" in text


def test_extended_calibration_keeps_m_and_b_valid_at_their_reference(folder, tmp_path):
    before = tumble.Calibration.model_validate(
        {
            "name": "drive",
            "method": {"procedure": "multipose"},
            "temperature": {"low": 39.0, "mean": 40.0, "high": 41.0},
            "accelerometer": {
                "M": np.diag([1.01, 0.99, 1.0]),
                "b": np.array([0.1, 0.2, 0.3]),
                "estimated": ["bias", "matrix"],
            },
        }
    )
    before.save(tmp_path / "drive.yaml")
    done = typed(
        "thermal", folder / "thermal.csv", "--calibration", tmp_path / "drive.yaml", "-o", tmp_path / "out"
    )
    assert done.code == 0, done.out + done.err
    after = Calibration.load(tmp_path / "out" / "thermal.yaml")
    assert after.accelerometer.b.tolist() == [0.1, 0.2, 0.3]
    assert after.accelerometer.M.tolist() == before.accelerometer.M.tolist()
    assert after.method == before.method
    drift = after.accelerometer.temperature_drift
    assert drift.reference == 40.0
    # d/dT of a polynomial about 25 degC, seen at 40.
    slope = ACCELEROMETER[0] + 2.0 * ACCELEROMETER[1] * 15.0
    assert drift.bias[0] == pytest.approx([slope] * 3, rel=0.2)


def test_a_calibration_of_nobody_knows_which_temperature_is_refused(folder, tmp_path):
    start = tmp_path / "start.yaml"
    unit = {"M": np.eye(3), "b": np.array([0.1, 0.0, 0.0])}
    tumble.Calibration.model_validate({"name": "drive", "accelerometer": unit}).save(start)
    done = typed("thermal", folder / "thermal.csv", "--calibration", start, "-o", tmp_path / "out")
    assert done.code == 2
    assert "drive: does not say at which temperature it was made" in one_line(done.err)
    assert contents(tmp_path / "out") == {}
    told = tumble.thermal(folder / "thermal.csv", calibration=start, calibration_temperature=30.0)
    assert told.reference == 30.0


def test_a_calibration_made_beyond_the_range_is_told(folder, tmp_path):
    start = tmp_path / "start.yaml"
    unit = {"M": np.eye(3), "b": np.array([0.1, 0.0, 0.0])}
    tumble.Calibration.model_validate({"name": "drive", "accelerometer": unit}).save(start)
    told = tumble.thermal(folder / "thermal.csv", calibration=start, calibration_temperature=80.0)
    assert told.reference == told.range[1]
    assert any("was made at 80.0 degC" in line for line in told.warnings)


def test_warming_alone_leaves_hysteresis_open_and_says_so(tmp_path):
    result = tumble.thermal(session(cycles=0.5).recording)
    assert result.verdict == "partly measured"
    assert not result["gyroscope x"].hysteresis.observable
    assert any("hysteresis is not known" in line for line in result.warnings)
    drift = result.calibration.gyroscope.temperature_drift
    assert np.isnan(drift.hysteresis).all()


def test_hysteresis_too_large_for_one_curve_is_reported():
    result = tumble.thermal(session(accelerometer=(2e-4,), accelerometer_hysteresis=0.02).recording)
    axis = result["accelerometer y"]
    assert abs(axis.hysteresis.value - 0.02) < FAR * axis.hysteresis.sigma
    assert result.verdict == "model not met"
    assert any("warming and cooling differ" in line for line in result.warnings)
    assert axis.bias_sigma_at(np.array([25.0]))[0] >= 0.5 * abs(axis.hysteresis.value)


def test_a_thermometer_that_is_behind_is_set_right():
    result = tumble.thermal(session(lag=60.0, step=0.25, gyroscope=(2e-4,)).recording)
    assert result.lag.observable
    assert abs(result.lag.value - 60.0) < max(FAR * result.lag.sigma, 6.0)


def test_poses_turned_over_by_hand_show_scale():
    result = tumble.thermal(session(poses=6, duration=5400.0, scale=(1e-4,), step=0.0).recording)
    axis = result["accelerometer z"]
    assert axis.scale_change.observable
    assert abs(axis.scale_change.value - 1e-4) < FAR * axis.scale_change.sigma
    assert not result["gyroscope z"].scale_change.observable


def test_sessions_are_joined_and_sharpen_the_drift():
    logs = of_one_unit([session(seed=seed).recording for seed in (SEED, SEED + 1)])
    alone, both = tumble.thermal(logs[0]), tumble.thermal(logs)
    assert both.blocks.poses == 2
    assert both["gyroscope x"].slope.sigma < alone["gyroscope x"].slope.sigma
    assert abs(off(both["gyroscope x"], GYROSCOPE)[0]) < FAR


def test_beyond_the_range_the_edge_is_held():
    axis = tumble.thermal(session().recording)["accelerometer x"]
    low, high = axis.range
    held = axis.bias_at(np.array([low - 30.0, low, high, high + 30.0]))
    assert held[0] == held[1]
    assert held[2] == held[3]


def test_chunking_of_samples_changes_nothing():
    recording = session(duration=600.0).recording

    def halves():
        for chunk in recording.chunks():
            for part in (slice(0, 1001), slice(1001, None)):
                rows = (chunk.time, chunk.accelerometer, chunk.gyroscope, chunk.temperature)
                yield Chunk(*(row[part] for row in rows))

    whole = tumble.thermal(recording)
    parts = tumble.thermal(Recording(replace(recording.metadata), halves))
    for one, other in zip(whole, parts, strict=True):
        np.testing.assert_allclose(other.bias, one.bias, rtol=1e-9)


def test_a_log_without_temperature_is_refused_in_one_line(tmp_path):
    typed("simulate", "static", "--duration", "60s", "-o", tmp_path)
    done = typed("thermal", tmp_path / "static.csv", "-o", tmp_path / "out")
    assert done.code == 2
    assert "static: holds no temperature" in one_line(done.err)
    assert contents(tmp_path / "out") == {}


def test_a_log_of_even_temperature_is_refused_in_one_line(tmp_path):
    typed("simulate", "thermal", "--duration", "10min", "--low", 24, "--high", 26, "-o", tmp_path)
    done = typed("thermal", tmp_path / "thermal.csv", "-o", tmp_path / "out")
    assert done.code == 2
    assert "its temperature changes by" in one_line(done.err)


def test_a_unit_that_keeps_turning_is_refused_in_one_line():
    def turning(chunk):
        angle = 0.3 * chunk.time[:, None]
        force = 9.8 * (np.sin(angle) * np.array([1.0, 0.0, 0.0]) + np.cos(angle) * np.array([0.0, 0.0, 1.0]))
        rate = chunk.gyroscope + np.array([0.0, 0.3, 0.0])
        return replace(chunk, accelerometer=chunk.accelerometer - [0.0, 0.0, 9.8] + force, gyroscope=rate)

    with pytest.raises(tumble.TumbleError, match="stands still for 0 s") as refused:
        tumble.thermal(changed(session(duration=600.0).recording, turning))
    assert "\n" not in str(refused.value)


def test_shocks_to_the_unit_are_left_out_and_reported():
    shaking = np.random.default_rng(SEED)

    def shaken(chunk):
        at_times = (np.floor(chunk.time / 3.0) % 2.0)[:, None]
        return replace(
            chunk, gyroscope=chunk.gyroscope + at_times * shaking.normal(0.0, 1.0, chunk.gyroscope.shape)
        )

    result = tumble.thermal(changed(session(gyroscope=(2e-4,)).recording, shaken))
    assert abs(off(result["gyroscope x"], (2e-4,))[0]) < FAR
    assert any("in which the unit did not stand still" in line for line in result.warnings)


def test_result_is_a_table_a_notebook_and_files(tmp_path):
    result = tumble.thermal(session().recording)
    frame = result.to_pandas()
    assert set(frame["channel"]) == {axis.name for axis in result}
    assert "<table>" in result._repr_html_()
    assert "ThermalResult" in repr(result)
    files = result.save(tmp_path)
    assert files["report"].is_file()
    assert files["calibration"].is_file()


@pytest.mark.parametrize("given", ["one", "1,2,3,4"])
def test_powers_that_are_none_are_refused_in_one_line(given, tmp_path):
    done = typed("simulate", "thermal", "--gyroscope", given, "-o", tmp_path / "out")
    assert done.code == 2
    assert done.err.count("\n") == 1


def test_every_refusal_of_the_core_has_its_message():
    assert set(VOCABULARY["thermal error"]) == set(MESSAGES)


def test_log_of_half_a_hertz_counts_its_time_at_rest():
    random = np.random.default_rng(46)
    time = np.arange(0.0, 2 * 3600.0, 2.0)
    temperature = 20.0 + 40.0 * time / time[-1]
    drift = 0.002 * (temperature - 40.0)[:, None]
    force = np.array([0.1, 0.2, 9.8]) + drift + 0.002 * random.normal(size=(len(time), 3))
    rate = 0.05 * drift + 1e-4 * random.normal(size=(len(time), 3))
    found = tumble.thermal(Recording.from_arrays("slow", time, force, rate, temperature))
    assert found.blocks.still == pytest.approx(2 * 3600.0, rel=0.02)
    assert found["accelerometer x"].swing.value == pytest.approx(0.08, rel=0.02)
