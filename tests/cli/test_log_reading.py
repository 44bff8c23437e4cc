"""A calibration states how its log was read, and holds for no log that was read otherwise."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from calibrated_commands import CALIBRATED, write_log
from made_up_calibrations import made_up
from tumble.calibration.document import Calibration, Reading
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.procedures import PROCEDURES
from tumble.logs import ReadOptions, open_recording
from tumble.tools.simulate import simulate_multipose
from turntable_sessions import one_line, typed

AXES = "y,-x,z"
CHANGES = {
    "--axes": AXES,
    "--accelerometer-sign": "-1",
    "--accelerometer-zero": "0.5,0,0",
    "--gyroscope-zero": "0.01,0,0",
    "--accelerometer-scale": "1.02",
}
SIMULATED = {
    "turntable": ("turntable", ("--rest", "2", "--rate", "50"), ("reference.csv", "target_1.csv")),
    "spin": ("spin", ("--plan", "rest 6, 1 turns, rest 6"), ("spin.csv",)),
    "multipose": ("multipose", ("--rate", "50"), ("multipose.csv",)),
    "magnetometer": ("magnetometer", ("--rate", "50"), ("magnetometer.csv",)),
    "noise": ("static", ("--duration", "60s", "--rate", "50"), ("static.csv",)),
    "thermal": ("thermal", ("--duration", "60min"), ("thermal.csv",)),
}
"""Simulator, its options, and the logs of each procedure that makes a calibration of a log."""
OTHERS = {"align", "redundancy"}
"""Procedures that make none, or one of two logs."""


@pytest.fixture
def log(tmp_path):
    return write_log(tmp_path / "log.csv", "SN-1")


def calibration(path, bias=0.1, **reading):
    """Saves a calibration whose log was read so."""
    made_up("SN-1", bias=(bias, 0.0, 0.0)).model_copy(update={"reading": Reading(**reading)}).save(path)
    return path


def test_each_procedure_is_in_the_law():
    assert {row.word for row in PROCEDURES} == set(SIMULATED) | OTHERS


@pytest.mark.parametrize("word", SIMULATED)
def test_a_calibration_states_how_its_log_was_read(word, tmp_path):
    simulator, options, logs = SIMULATED[word]
    assert typed("simulate", simulator, *options, "-o", tmp_path).code == 0
    done = typed(word, *(tmp_path / name for name in logs), "--axes", AXES, "-o", tmp_path / "out")
    assert done.code in (0, 3), done.err
    (path,) = (
        path for path in (tmp_path / "out").glob("*.yaml") if b"tumble-calibration/" in path.read_bytes()
    )
    assert yaml.safe_load(path.read_text())["reading"] == {"axes": AXES}
    assert Calibration.load(path).log_reading == {"axes": AXES}


@pytest.mark.parametrize("command", CALIBRATED)
def test_a_log_that_is_read_otherwise_is_refused(command, log, tmp_path):
    known = calibration(tmp_path / "known.yaml", axes=AXES)
    (tmp_path / "b").mkdir()
    other = write_log(tmp_path / "b" / "log2.csv", "SN-22")
    output = () if command == "view" else ("-o", tmp_path / ("x.csv" if command == "apply" else "out"))
    done = typed(command, *CALIBRATED[command](log, other, known), *output)
    assert done.code == 2, done.out + done.err
    line = one_line(done.err)
    assert "was read with --axes x,y,z, that of " in line
    assert f"with --axes {AXES}" in line
    assert not (tmp_path / "x.csv").exists()


@pytest.mark.parametrize("option", CHANGES)
def test_each_option_that_changes_readings_counts(option, log, tmp_path):
    scale = {"accelerometer_scale": [1.0] * 3} if option.endswith("scale") else {}
    known = calibration(tmp_path / "known.yaml", **scale)
    done = typed("apply", known, log, option, CHANGES[option], "-o", tmp_path / "x.csv")
    assert done.code == 2, done.err
    line = one_line(done.err)
    assert f"was read with {option} {CHANGES[option]}" in line
    assert ", that of the calibration with" in line


def test_a_file_that_does_not_state_it_holds_for_any_reading(log, tmp_path):
    made_up("SN-1").save(tmp_path / "known.yaml")
    assert Calibration.load(tmp_path / "known.yaml").log_reading == {}
    assert typed("apply", tmp_path / "known.yaml", log, "--axes", AXES, "-o", tmp_path / "x.csv").code == 0


def test_a_calibration_on_top_of_a_correction_is_for_such_logs_only(log, tmp_path):
    made_up("SN-1", bias=(0.0, 0.0, 0.1)).save(tmp_path / "first.yaml")
    assert typed("apply", tmp_path / "first.yaml", log, "-o", tmp_path / "once.csv").code == 0
    reading = open_recording(tmp_path / "once.csv").metadata.reading
    assert reading["correction"] == f"sha256:{Calibration.load(tmp_path / 'first.yaml').hash()}"
    second = calibration(tmp_path / "second.yaml", **reading)
    assert typed("apply", second, tmp_path / "once.csv", "-o", tmp_path / "twice.csv").code == 0
    for path, why in ((log, "was not corrected before"), (tmp_path / "twice.csv", "was corrected already")):
        done = typed("apply", second, path, "-o", tmp_path / "no.csv")
        assert done.code == 2
        assert why in one_line(done.err)
        assert typed("spin", path, "--calibration", second, "-o", tmp_path / "out").code == 2


READ = [({"axes": "x,y,z"}, 0), ({"axes": AXES}, 2), ({"accelerometer_zero": [0.5, 0.0, 0.0]}, 2)]


@pytest.mark.parametrize(("reading", "code"), READ)
def test_registers_of_a_chip_are_not_made_of_a_turned_log(reading, code, tmp_path):
    gyroscope = {"unit": "rad/s", "M": np.eye(3), "b": np.zeros(3)}
    content = made_up("SN-1").content() | {"gyroscope": gyroscope, "reading": reading}
    Calibration.model_validate(content).save(tmp_path / "unit.yaml")
    words = ("--format", "registers-mpu6050", "-o", tmp_path / "registers.h")
    done = typed("export", tmp_path / "unit.yaml", *words)
    assert done.code == code, done.err
    assert (tmp_path / "registers.h").exists() == (code == 0)


def test_a_file_for_others_names_the_correction_it_is_on_top_of(tmp_path):
    known = calibration(tmp_path / "unit.yaml", correction="by the flight controller")
    done = typed("export", known, "--format", "ardupilot", "-o", tmp_path / "unit.parm")
    assert done.code == 0, done.err
    assert "holds on top of another correction (by the flight controller)" in done.err


def test_plateaus_are_of_logs_that_were_read_alike(tmp_path):
    paths = [
        calibration(tmp_path / f"{k}.yaml", float(k), axes=axes)
        for k, axes in enumerate(("x,y,z", "x,y,z", AXES))
    ]
    done = typed("plateaus", *paths, "-o", tmp_path / "out")
    assert done.code == 2
    assert "its log was read with --axes y,-x,z" in one_line(done.err)


SCALE = 16384.0 / STANDARD_GRAVITY
"""Counts per m/s^2 of a sensor of 16384 counts a g."""
SAME = {
    "the same": ("--accelerometer-scale", f"{SCALE:.6g}"),
    "with its unit": ("--accelerometer-scale", f"{SCALE:.6g}", "--accelerometer-unit", "m/s^2"),
    "in g": ("--accelerometer-scale", "16384", "--accelerometer-unit", "g"),
    "in mg": ("--accelerometer-scale", "16.384", "--accelerometer-unit", "mg"),
}
"""Ways to state one scale."""
OTHER = {
    "another": ("--accelerometer-scale", f"{1.0005 * SCALE:.6g}"),
    "another in g": ("--accelerometer-scale", "16400", "--accelerometer-unit", "g"),
    "by range": ("--counts", "2.01,250"),
}


def counts(path):
    """Writes a log of counts, 16384 a g, that states no unit of the gyroscope."""
    rng = np.random.default_rng(1)
    force = SCALE * (np.array([0.0, 0.0, 9.81]) + rng.normal(0.0, 0.01, (500, 3)))
    rows = np.column_stack([np.arange(500) / 50.0, np.round(force), rng.normal(0.0, 0.01, (500, 3))])
    np.savetxt(path, rows, "%.6g", ",", header="time,ax,ay,az,gx [rad/s],gy [rad/s],gz [rad/s]", comments="")
    return path


@pytest.mark.parametrize(
    ("words", "code"), [*((w, 0) for w in SAME.values()), *((w, 2) for w in OTHER.values())]
)
def test_scales_are_compared_whatever_their_unit(words, code, tmp_path):
    known = calibration(
        tmp_path / "known.yaml", accelerometer_scale=[SCALE] * 3, accelerometer_unit="m/s^2", raw=True
    )
    done = typed("apply", known, counts(tmp_path / "log.csv"), *words, "-o", tmp_path / "x.csv")
    assert done.code == code, done.err
    assert (tmp_path / "x.csv").exists() == (code == 0)
    if code:
        assert (
            f"that of the calibration with --accelerometer-scale {SCALE:.6g} --accelerometer-unit m/s^2"
            in (one_line(done.err))
        )


def test_a_unit_that_the_log_states_is_that_of_its_scale(tmp_path):
    path = counts(tmp_path / "log.csv")
    path.write_text(path.read_text().replace("ax,ay,az", "ax [g],ay [g],az [g]"))
    reading = open_recording(path, ReadOptions(accelerometer_scale=16384.0)).metadata.reading
    assert (reading["accelerometer_scale"], reading["accelerometer_unit"]) == ([16384.0] * 3, "g")


@pytest.mark.parametrize(("raw", "code"), [(True, 2), (None, 0)])
def test_nominal_scales_hold_for_counts_alone(raw, code, log, tmp_path):
    """A log in units need not state the scale of a sensor; an assumed one is none of the sensor."""
    known = calibration(tmp_path / "known.yaml", accelerometer_scale=[SCALE] * 3, raw=raw)
    done = typed("apply", known, log, "-o", tmp_path / "x.csv")
    assert done.code == code, done.err
    assert not code or "was read without --accelerometer-scale" in one_line(done.err)


@pytest.mark.parametrize("columns", [slice(0, 7), slice(0, 4)])
def test_counts_are_calibrated_and_corrected_by_one_scale(columns, tmp_path):
    hand = simulate_multipose(seed=1, rate_hz=50.0)
    samples = hand.unit.samples
    force, rate = 1671.0 * samples.accelerometer, 7510.0 * samples.gyroscope
    rows = np.column_stack([samples.time, np.round(force), np.round(rate)])[:, columns]
    head = ",".join(["time", "ax", "ay", "az", "gx", "gy", "gz"][columns])
    path = tmp_path / "counts.csv"
    np.savetxt(path, rows, "%.6f", ",", header=head, comments="")
    done = typed("multipose", path, "--raw", "-o", tmp_path / "out")
    assert done.code in (0, 3), done.err
    known = Calibration.load(tmp_path / "out" / "counts.multipose.yaml")
    has_gyroscope = known.gyroscope is not None
    reading = known.log_reading
    assert reading["raw"] is True
    assert reading["accelerometer_scale"][0] == pytest.approx(1671.0, rel=0.05)
    assert ("gyroscope_scale" in reading) == has_gyroscope
    words = [f"--accelerometer-scale={reading['accelerometer_scale'][0]:g}"]
    if has_gyroscope:
        words += [f"--gyroscope-scale={reading['gyroscope_scale'][0]:g}"]
    for options, code in ((words, 0), (["--counts", "2,250"], 2)):
        done = typed(
            "apply", tmp_path / "out" / "counts.multipose.yaml", path, *options, "-o", tmp_path / "x.csv"
        )
        assert done.code == code, done.err
    corrected = np.concatenate([chunk.accelerometer for chunk in open_recording(tmp_path / "x.csv").chunks()])
    at_rest = [(samples.time >= each.start) & (samples.time <= each.end) for each in hand.session.rests]
    lengths = [np.linalg.norm(corrected[rows].mean(axis=0)) for rows in at_rest]
    assert np.allclose(lengths, STANDARD_GRAVITY, atol=5e-3)


def test_a_file_for_others_names_the_scale_that_it_assumes(tmp_path):
    known = calibration(
        tmp_path / "unit.yaml", accelerometer_scale=[1663.0] * 3, accelerometer_unit="m/s^2", raw=True
    )
    done = typed("export", known, "--format", "ardupilot", "-o", tmp_path / "unit.parm")
    assert done.code == 0, done.err
    assert "read with --accelerometer-scale 1663 --accelerometer-unit m/s^2" in done.err
