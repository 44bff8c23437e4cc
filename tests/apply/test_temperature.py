"""Temperature drift is corrected; where it is unknown, that is reported."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from log_fixtures import made_up, read, write
from spin_sessions import record, still, turn
from tumble.calibration.document import Calibration
from tumble.calibration.temperature_counts import SCATTER
from tumble.foundation.errors import ArrayError
from tumble.foundation.recording import Chunk
from turntable_sessions import typed

REFERENCE, LOW, HIGH = 25.0, -20.0, 70.0
DRIFT = {
    "reference": REFERENCE,
    "range": [LOW, HIGH],
    "bias": [[1e-3, 0.0, -2e-3], [0.0, 1e-5, 0.0], [0.0, 0.0, 1e-7]],
    "scale": [[1e-5, -2e-5, 0.0]],
}
M = np.array([[1.01, 0.002, -0.003], [0.001, 0.99, 0.004], [-0.002, 0.003, 1.005]])
B = np.array([0.3, -0.2, 0.1])
G = 1e-3 * np.array([[1.0, 0.2, 0.0], [0.0, -1.0, 0.3], [0.1, 0.0, 0.5]])
UNIT = Calibration.model_validate(
    {
        "name": "unit",
        "serial": "SN 1",
        "accelerometer": {"unit": "m/s^2", "M": M, "b": B, "temperature_drift": DRIFT},
        "gyroscope": {"unit": "rad/s", "M": M, "b": B, "g_sensitivity": G, "temperature_drift": DRIFT},
    }
)
VALUE = st.floats(-20.0, 20.0)


def drifted(truth, temperature):
    """(n, 3) readings of a triad for the truth at temperatures (n,), degC: the model, written out."""
    t = np.clip(temperature, LOW, HIGH) - REFERENCE
    scale, bias = (
        sum(np.outer(t ** (k + 1), row) for k, row in enumerate(DRIFT[name])) for name in ("scale", "bias")
    )
    return (1.0 + scale) * (truth @ M.T) + B + bias


def measured(truth, temperature):
    rate = drifted(truth.gyroscope, temperature) + truth.accelerometer @ G.T
    return Chunk(truth.time, drifted(truth.accelerometer, temperature), rate, temperature)


@given(st.tuples(VALUE, VALUE, VALUE), st.tuples(VALUE, VALUE, VALUE), st.floats(-80.0, 150.0))
def test_at_any_temperature_a_reading_is_corrected_to_the_truth(force, rate, temperature):
    truth = Chunk(np.zeros(1), np.array([force]), np.array([rate]))
    said = measured(truth, np.array([temperature]))
    found_force, found_rate = UNIT.correct(said.accelerometer, said.gyroscope, temperature)
    np.testing.assert_allclose(found_force, [force], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found_rate, [rate], rtol=0.0, atol=1e-12)


def test_without_a_temperature_the_reference_is_assumed():
    rows = np.arange(6.0).reshape(2, 3)
    expected = UNIT.correct(rows, rows, REFERENCE)
    for temperature in (None, np.nan, [np.nan, REFERENCE]):
        np.testing.assert_allclose(UNIT.correct(rows, rows, temperature), expected, rtol=1e-15)


def test_one_temperature_serves_all_readings_and_other_counts_fail():
    rows = np.arange(9.0).reshape(3, 3)
    np.testing.assert_array_equal(UNIT.correct(rows, rows, 40.0), UNIT.correct(rows, rows, [40.0] * 3))
    with pytest.raises(ArrayError, match="readings: holds 3 samples, temperature 2"):
        UNIT.correct(rows, rows, [40.0, 41.0])


def applied(tmp_path, log, *options):
    UNIT.save(tmp_path / "unit.yaml")
    out = tmp_path / "out.csv"
    source = f"replay:{log}?speed=max" if "--live" in options else log
    done = typed(
        "apply", tmp_path / "unit.yaml", source, "--to" if "--live" in options else "-o", out, *options
    )
    assert done.code == 0, done.err
    return done, read(out)


@pytest.mark.parametrize("options", [(), ("--live",)])
def test_each_sample_is_corrected_at_its_temperature_or_counted(tmp_path, options):
    truth = made_up(3000)
    temperature = np.linspace(20.0, 80.0, 3000)
    log = write(tmp_path / "log.csv", measured(truth, temperature), serial="SN 1")
    done, found = applied(tmp_path, log, *options)
    np.testing.assert_allclose(found.accelerometer, truth.accelerometer, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found.gyroscope, truth.gyroscope, rtol=0.0, atol=1e-12)
    beyond = int((temperature > HIGH + SCATTER * (HIGH - LOW)).sum())
    assert f"warning: {beyond} samples of 3000 beyond the temperatures of the calibration" in done.err
    assert "-20 to 70 degC" in done.err
    assert "to 80: the drift at the edge is held" in done.err


@pytest.mark.parametrize("options", [(), ("--live",)])
def test_log_without_temperature_is_corrected_at_the_reference(tmp_path, options):
    truth = made_up(3000, temperature=False)
    said = measured(truth, np.full(3000, REFERENCE))
    log = write(tmp_path / "log.csv", Chunk(said.time, said.accelerometer, said.gyroscope), serial="SN 1")
    done, found = applied(tmp_path, log, *options)
    np.testing.assert_allclose(found.accelerometer, truth.accelerometer, rtol=0.0, atol=1e-12)
    (line,) = [line for line in done.err.splitlines() if "warning" in line]
    assert line == (
        "tumble: warning: the calibration depends on temperature, which was not recorded: 25 degC, its "
        "reference, is assumed"
    )


def test_a_log_within_the_range_raises_no_warning(tmp_path):
    log = write(tmp_path / "log.csv", measured(made_up(300), np.full(300, 30.0)), serial="SN 1")
    assert "warning" not in applied(tmp_path, log)[0].err


def test_thermometer_noise_at_the_end_of_the_range_raises_no_warning(tmp_path):
    temperature = HIGH + 0.5 * np.sin(np.arange(300))
    log = write(tmp_path / "log.csv", measured(made_up(300), temperature), serial="SN 1")
    assert "warning" not in applied(tmp_path, log)[0].err


def test_a_spin_takes_the_drift_off_before_it_finds_the_bias(tmp_path):
    session = record((still(), turn(3), still(3), turn(-3), still()), 91)
    slope, warmer = np.array([2e-3, -1e-3, 3e-3]), 10.0
    drift = {"reference": REFERENCE, "range": [LOW, HIGH], "bias": [slope]}
    content = {"name": "robot", "accelerometer": {"M": np.eye(3), "b": np.zeros(3)}}
    Calibration.model_validate(content).save(tmp_path / "plain.yaml")
    content["accelerometer"]["temperature_drift"] = drift
    Calibration.model_validate(content).save(tmp_path / "drift.yaml")
    temperature = np.full(len(session.time), REFERENCE + warmer)
    chunk = Chunk(session.time, session.accelerometer, session.gyroscope, temperature)
    log = write(tmp_path / "robot.csv", chunk)
    found = {}
    for name in ("plain", "drift"):
        done = typed("spin", log, "--calibration", tmp_path / f"{name}.yaml", "-o", tmp_path / name, "--json")
        assert done.code == 0, done.err
        found[name] = json.loads(done.out)["calibration"]["accelerometer"]
    np.testing.assert_allclose(
        np.array(found["plain"]["b"]) - found["drift"]["b"], slope * warmer, rtol=0.0, atol=1e-6
    )
    assert found["drift"]["temperature_drift"]["bias"] == [slope.tolist()]


def test_a_spin_without_temperatures_says_what_it_assumes(tmp_path):
    log = record((still(), turn(3), still(3), turn(-3), still()), 92).write(tmp_path / "robot.csv")
    drift = {"reference": REFERENCE, "range": [LOW, HIGH], "bias": [[1e-3, 0.0, 0.0]]}
    section = {"M": np.eye(3), "b": np.zeros(3), "temperature_drift": drift}
    Calibration.model_validate({"name": "robot", "accelerometer": section}).save(tmp_path / "drift.yaml")
    done = typed("spin", log, "--calibration", tmp_path / "drift.yaml", "-o", tmp_path / "out", "--json")
    assert "which was not recorded: 25 degC" in " ".join(json.loads(done.out)["warnings"])
