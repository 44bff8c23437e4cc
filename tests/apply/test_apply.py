"""`apply`: a log and a calibration make the corrected log."""

from __future__ import annotations

import json

import numpy as np
import pytest

from log_fixtures import made_up, read, same, write, write_text
from tumble.calibration.document import Calibration
from tumble.foundation.errors import OutputError
from tumble.foundation.recording import Chunk, Recording
from tumble.logs import open_recording
from tumble.tools.apply.procedure import apply
from turntable_sessions import one_line, typed

M_ACCELEROMETER = np.array([[1.01, 0.002, -0.003], [0.001, 0.99, 0.004], [-0.002, 0.003, 1.005]])
M_GYROSCOPE = np.array([[0.98, -0.001, 0.002], [0.003, 1.02, 0.001], [0.002, -0.002, 1.01]])
BIAS_ACCELEROMETER = np.array([0.3, -0.2, 0.1])
BIAS_GYROSCOPE = np.array([0.01, -0.02, 0.005])


def calibration(**more):
    content = {
        "schema": "tumble-calibration/1",
        "name": "unit",
        "serial": "SN 1",
        "accelerometer": {"unit": "m/s^2", "M": M_ACCELEROMETER, "b": BIAS_ACCELEROMETER},
        "gyroscope": {"unit": "rad/s", "M": M_GYROSCOPE, "b": BIAS_GYROSCOPE},
    }
    return Calibration.model_validate(content | more)


def measured(truth):
    """Readings of a sensor with that error."""
    return Chunk(
        truth.time,
        truth.accelerometer @ M_ACCELEROMETER.T + BIAS_ACCELEROMETER,
        truth.gyroscope @ M_GYROSCOPE.T + BIAS_GYROSCOPE,
        truth.temperature,
    )


@pytest.mark.parametrize("source", ["csv", "parquet", "mcap"])
@pytest.mark.parametrize("target", ["csv", "parquet", "mcap"])
def test_a_corrected_log_holds_the_truth_in_any_format(tmp_path, source, target):
    truth = made_up(150_000 if source == target == "parquet" else 3000)
    log = write(tmp_path / f"log.{source}", measured(truth))
    applied = apply(calibration(), open_recording(log), tmp_path / f"out.{target}")
    found = read(tmp_path / f"out.{target}")
    assert applied.samples == len(truth)
    np.testing.assert_allclose(found.time, truth.time, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(found.accelerometer, truth.accelerometer, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found.gyroscope, truth.gyroscope, rtol=0.0, atol=1e-12)
    assert np.array_equal(found.temperature, truth.temperature)


@pytest.mark.parametrize("kind", ["csv", "parquet", "mcap"])
def test_corrected_log_is_marked_and_corrected_again_only_if_forced(tmp_path, kind):
    calibration().save(tmp_path / "unit.yaml")
    log = write(tmp_path / "log.csv", measured(made_up(300)), serial="SN 1")
    once, twice = tmp_path / f"once.{kind}", tmp_path / f"twice.{kind}"
    assert tumble("apply", tmp_path / "unit.yaml", log, "-o", once).err == ""
    assert open_recording(once).metadata.serial == "SN 1"
    said = tumble("apply", tmp_path / "unit.yaml", once, "-o", twice, code=2)
    line = one_line(said.err)
    assert line.startswith(str(once))
    assert "was corrected already" in line
    assert not twice.exists()
    said = tumble("apply", tmp_path / "unit.yaml", once, "-o", twice, "--force")
    assert said.err == "tumble: warning: the log was corrected already\n"
    assert twice.exists()


def test_a_log_of_another_unit_is_not_corrected_unless_forced(tmp_path):
    calibration().save(tmp_path / "unit.yaml")
    log = write(tmp_path / "log.csv", measured(made_up(300)), serial="SN 2")
    words = ("apply", tmp_path / "unit.yaml", log, "-o", tmp_path / "out.csv")
    assert "is of unit SN 2, the calibration of unit SN 1" in one_line(tumble(*words, code=2).err)
    assert not (tmp_path / "out.csv").exists()
    assert "is of unit SN 2" in tumble(*words, "--force").err
    assert tumble(*words, "--serial", "SN 1").err.startswith("tumble: replaced")


def test_that_nobody_knows_the_unit_of_a_log_is_warned_of(tmp_path):
    log = write(tmp_path / "log.csv", measured(made_up(300)))
    (warning,) = apply(calibration(), open_recording(log), tmp_path / "out.csv").warnings
    assert warning.endswith("is not known: the log has no serial number")
    assert apply(calibration(name="log"), open_recording(log), tmp_path / "out.csv").warnings == ()


def test_triad_without_calibration_stays_raw_with_a_warning(tmp_path):
    truth = made_up(3000)
    log = write(tmp_path / "log.parquet", measured(truth), serial="SN 1")
    warnings = apply(calibration(gyroscope=None), open_recording(log), tmp_path / "out.parquet").warnings
    assert warnings == ("the calibration has no gyroscope section; the gyroscope is left as measured",)
    assert np.array_equal(read(tmp_path / "out.parquet").gyroscope, measured(truth).gyroscope)


def test_omission_from_the_log_raises_a_warning(tmp_path):
    chunk = measured(made_up(3000))
    chunk.accelerometer[7, 1] = np.nan
    log = write(tmp_path / "log.csv", chunk, serial="SN 1")
    applied = apply(calibration(), open_recording(log), tmp_path / "out.csv")
    assert applied.samples == 2999
    assert applied.warnings == ("left out 1 sample without a number (ay 1)",)


def test_the_log_itself_is_never_overwritten(tmp_path):
    log = write(tmp_path / "log.csv", measured(made_up(100)))
    before = log.read_bytes()
    with pytest.raises(OutputError, match="is what is read"):
        apply(calibration(), open_recording(log), tmp_path / "." / "log.csv")
    assert log.read_bytes() == before


def test_a_log_that_breaks_off_leaves_the_last_result_as_it_was(tmp_path):
    chunk = measured(made_up(200_000))
    chunk.time[190_000] = 0.0
    log = write(tmp_path / "log.parquet", chunk)
    out = tmp_path / "out.csv"
    write(out, measured(made_up(10)))
    before = out.read_text()
    with pytest.raises(Exception, match="backwards"):
        apply(calibration(), open_recording(log), out)
    assert out.read_text() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["log.parquet", "out.csv"]


def test_arrays_in_memory_are_corrected_like_any_recording(tmp_path):
    truth = made_up(1000, temperature=False)
    said = measured(truth)
    recording = Recording.from_arrays("arrays", said.time, said.accelerometer, said.gyroscope)
    apply(calibration(), recording, tmp_path / "out.parquet")
    np.testing.assert_allclose(read(tmp_path / "out.parquet").accelerometer, truth.accelerometer, atol=1e-12)


def tumble(*arguments, code=0):
    """Runs the command as typed; returns what it printed."""
    done = typed(*arguments)
    assert done.code == code, done.err
    return done


def test_apply_and_inspect_work_from_the_command_line(tmp_path):
    truth = made_up(3000)
    log = write(tmp_path / "log.csv", measured(truth))
    calibration().save(tmp_path / "unit.yaml")
    out = tmp_path / "out.mcap"
    said = tumble("apply", tmp_path / "unit.yaml", log, "-o", out)
    assert f"3000 samples corrected: {out}" in said.out
    np.testing.assert_allclose(read(out).accelerometer, truth.accelerometer, rtol=0.0, atol=1e-12)
    shown = tumble("inspect", f"{out}:/imu/data")
    assert "mcap, frame case, serial SN 1, already corrected" in shown.out
    facts = json.loads(tumble("inspect", "--json", out).out)["logs"]
    assert [fact["timing"]["samples"] for fact in facts] == [3000]


def test_read_options_are_options_of_the_command_line(tmp_path):
    chunk = made_up(3000, temperature=False)
    counts = Chunk(
        chunk.time, chunk.accelerometer * 16384 / 9.80665 + 100.0, np.rad2deg(chunk.gyroscope) * 131
    )
    log = write_text(tmp_path / "log.csv", counts, header="t,p,q,r,u,v,w")
    calibration(accelerometer={"unit": "m/s^2", "M": np.eye(3), "b": np.zeros(3)}, gyroscope=None).save(
        tmp_path / "unit.yaml"
    )
    options = [
        *("--columns", "time=t,ax=p,ay=q,az=r,gx=u,gy=v,gz=w"),
        *("--accelerometer-scale", "16384,16384,16384", "--accelerometer-unit", "g"),
        *("--accelerometer-zero", "100", "--gyroscope-scale", "131", "--gyroscope-unit", "deg/s"),
    ]
    tumble("apply", tmp_path / "unit.yaml", log, "-o", tmp_path / "out.csv", *options)
    found = read(tmp_path / "out.csv")
    np.testing.assert_allclose(found.accelerometer, chunk.accelerometer, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(found.gyroscope, chunk.gyroscope, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    "options",
    [
        ("--axes", "x,x,z"),
        ("--columns", "ax"),
        ("--accelerometer-scale", "1,2"),
        ("--gyroscope-unit", "knots"),
    ],
)
def test_an_option_that_makes_no_sense_ends_with_one_line_and_code_2(tmp_path, options):
    log = write(tmp_path / "log.csv", made_up(300))
    calibration().save(tmp_path / "unit.yaml")
    said = tumble("apply", tmp_path / "unit.yaml", log, "-o", tmp_path / "out.csv", *options, code=2)
    assert said.err.startswith(f"tumble: error: {options[0]}")
    assert said.err.count("\n") == 1
    assert not (tmp_path / "out.csv").exists()


def test_unreadable_log_does_not_stop_the_inspection_of_others(tmp_path):
    log = write(tmp_path / "log.csv", made_up(3000))
    said = tumble("inspect", tmp_path / "nothing.csv", log, code=2)
    assert "nothing.csv: no such file" in said.err
    assert "3000 samples" in said.out


def test_inspect_shows_every_imu_of_a_file_that_holds_several(tmp_path):
    chunk = made_up(1000, temperature=False)
    names = [f"imu{i}_{c}" for i in (1, 2) for c in ("ax", "ay", "az", "gx", "gy", "gz")]
    table = np.column_stack([chunk.time, *[chunk.accelerometer, chunk.gyroscope] * 2])
    path = tmp_path / "pair.csv"
    np.savetxt(path, table, delimiter=",", header=",".join(["time", *names]), comments="")
    facts = json.loads(tumble("inspect", "--json", path).out)["logs"]
    assert [fact["metadata"]["name"] for fact in facts] == ["pair-imu1", "pair-imu2"]


def test_a_corrected_file_reads_as_plain_as_any(tmp_path):
    chunk = made_up(500, temperature=False)
    identity = calibration(
        accelerometer={"unit": "m/s^2", "M": np.eye(3), "b": np.zeros(3)},
        gyroscope={"unit": "rad/s", "M": np.eye(3), "b": np.zeros(3)},
    )
    apply(identity, open_recording(write(tmp_path / "log.csv", chunk)), tmp_path / "out.csv")
    assert same(read(tmp_path / "out.csv"), chunk)
