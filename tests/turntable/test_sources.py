"""Where recordings come from: tables, bags and MCAP, one IMU a file or several, each unit by its name."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import tumble
from bag_fixtures import write_mcap, write_ros1, write_ros2
from tumble.tools.simulate import Fault
from turntable_sessions import (
    assert_recovered,
    calibrate,
    calibrated,
    chi_square,
    columns,
    errors,
    refusal,
    rows,
    simulate,
    write,
    write_table,
)

GRADES = ("industrial", "tactical")


@pytest.fixture(scope="module")
def session():
    return simulate(71, grades=GRADES)


def assert_calibrates(session, folder, names):
    """The files written belong to the units of the session and agree with what it gives in memory."""
    expected = calibrate(session)
    assert list(rows(folder)) == names
    for name, target in zip(names, expected.targets, strict=True):
        found = tumble.Calibration.load(folder / f"{name}.yaml")
        np.testing.assert_allclose(found.accelerometer.M, target.accelerometer.M, rtol=0.0, atol=1e-8)
        np.testing.assert_allclose(found.gyroscope.b, target.gyroscope.b, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("log_format", ["csv", "parquet", "mcap"])
def test_the_format_of_the_logs_makes_no_difference(session, tmp_path, log_format):
    logs = write(session, tmp_path / "logs", log_format)
    calibrated(*logs, "-o", tmp_path / "out")
    assert_calibrates(session, tmp_path / "out", ["target_1", "target_2"])


@pytest.fixture(scope="module")
def table(session, tmp_path_factory):
    """All units in one Parquet file: a time column, and a prefix for each."""
    names, values = ["time"], [session.reference_unit.samples.time]
    for number, unit in enumerate(session.units, start=1):
        names += [f"imu{number}_{channel}" for channel in ("ax", "ay", "az", "gx", "gy", "gz")]
        values += [*unit.samples.accelerometer.T, *unit.samples.gyroscope.T]
    path = tmp_path_factory.mktemp("table") / "session.parquet"
    pq.write_table(pa.table(dict(zip(names, values, strict=True))), path)
    return path


def test_several_imus_of_one_table_are_reference_and_targets(session, table, tmp_path):
    calibrated(f"{table}:imu1", f"{table}:imu2", f"{table}:imu3", "-o", tmp_path)
    assert_calibrates(session, tmp_path, ["session-imu2", "session-imu3"])


def test_a_table_of_several_imus_asks_which_one_is_meant(table, tmp_path):
    line = refusal(table, f"{table}:imu2", "-o", tmp_path / "out")
    assert "holds 3 IMUs" in line
    assert "session.parquet:imu1" in line


def test_unknown_imu_of_a_table_is_refused_with_the_known_ones(table, tmp_path):
    line = refusal(f"{table}:imu1", f"{table}:imu9", "-o", tmp_path / "out")
    assert "'imu9'" in line
    assert "imu1, imu2, imu3" in line


@pytest.mark.parametrize("kind", ["ros1", "ros2", "mcap"])
def test_topics_of_one_bag_are_reference_and_targets(tmp_path, kind):
    session = simulate(72, grades=GRADES[:1], rate_hz=50.0)
    topics = {
        "/reference/imu": session.reference_unit.samples,
        "/left/imu": session.target_units[0].samples,
    }
    ways = {
        "ros1": lambda: write_ros1(tmp_path / "log.bag", topics),
        "ros2": lambda: write_ros2(tmp_path / "log", topics),
        "mcap": lambda: write_mcap(tmp_path / "log.mcap", topics),
    }
    path = ways[kind]()
    calibrated(f"{path}:/reference/imu", f"{path}:/left/imu", "-o", tmp_path / "out")
    assert_calibrates(session, tmp_path / "out", ["log-left_imu"])
    assert rows(tmp_path / "out")["log-left_imu"]["verdict"] == "calibrated"


def test_logs_of_one_name_in_different_folders_keep_apart(session, tmp_path):
    reference, first, second = write(session, tmp_path / "logs")
    for number, path in enumerate((first, second), start=1):
        (tmp_path / f"unit_{number}").mkdir()
        path.rename(tmp_path / f"unit_{number}/imu.csv")
    calibrated(reference, tmp_path / "unit_1/imu.csv", tmp_path / "unit_2/imu.csv", "-o", tmp_path / "out")
    assert_calibrates(session, tmp_path / "out", ["imu-1", "imu-2"])


def test_units_stated_in_the_columns_are_heeded(session, tmp_path):
    reference, _, _ = write(session, tmp_path / "logs")
    rates = columns(session.target_units[0].samples) * [1000.0, *[1 / 9.80665] * 3, *[np.degrees(1.0)] * 3]
    header = "time [ms],ax [g],ay [g],az [g],gx [deg/s],gy [deg/s],gz [deg/s]"
    path = write_table(tmp_path / "target_1.csv", rates, header)
    calibrated(reference, path, "-o", tmp_path / "out")
    found = tumble.Calibration.load(tmp_path / "out/target_1.yaml")
    np.testing.assert_allclose(
        found.accelerometer.M, calibrate(session)["target_1"].accelerometer.M, rtol=0.0, atol=1e-8
    )


def test_options_for_one_log_leave_the_others_alone(session, tmp_path):
    reference, _, second = write(session, tmp_path / "logs")
    rates = columns(session.target_units[0].samples) * [1.0, 1.0, 1.0, -1.0, *[np.degrees(1.0)] * 3]
    rates[:, 6] *= -1.0
    path = write_table(tmp_path / "odd.csv", rates)
    calibrated(
        *(reference, path, second, "-o", tmp_path / "out"),
        *("--for", "odd:gyroscope-unit=deg/s", "--for", "odd:axes=x,y,-z"),
    )
    assert_calibrates(session, tmp_path / "out", ["odd", "target_2"])


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("target_9:gyroscope-unit=deg/s", "no recording is named 'target_9'"),
        ("target_1:colour=red", "expected NAME:OPTION=VALUE"),
        ("target_1:gyroscope-unit", "expected NAME:OPTION=VALUE"),
        ("target_1:rate=fast", "--rate fast: give a number"),
        ("target_1:gyroscope-unit=furlong", "not a unit of gyroscope"),
    ],
)
def test_an_option_for_one_log_that_makes_no_sense_is_one_line(session, tmp_path, text, part):
    logs = write(session, tmp_path / "logs")
    assert part in refusal(*logs[:2], "-o", tmp_path / "out", "--for", text)


def test_calibration_of_the_reference_removes_its_errors_from_targets(tmp_path):
    session = simulate(73, grades=("tactical",), faults={"reference": Fault("scale", axis="y", size=1.01)})
    reference, target = write(session, tmp_path / "logs")
    truth = session.reference_unit
    brought = tumble.Calibration.model_validate(
        {
            "name": "reference",
            "serial": "SIM-73-0",
            "accelerometer": {"unit": "m/s^2", "M": truth.accelerometer.M, "b": truth.accelerometer.b},
            "gyroscope": {"unit": "rad/s", "M": truth.gyroscope.M, "b": truth.gyroscope.b},
        }
    )
    brought.save(tmp_path / "reference.yaml")
    calibrated(reference, target, "-o", tmp_path / "without")
    calibrated(
        *(reference, target, "-o", tmp_path / "with"),
        *("--reference-calibration", tmp_path / "reference.yaml"),
    )
    off = {
        way: np.abs(
            tumble.Calibration.load(tmp_path / way / "target_1.yaml").accelerometer.M
            - session.target_units[0].accelerometer.M
        ).max()
        for way in ("with", "without")
    }
    assert off["with"] < 0.1 * off["without"]
    written = tumble.Calibration.load(tmp_path / "with/target_1.yaml").reference
    assert written.calibration_hash == brought.hash()
    result = calibrate(session, reference_calibration=brought)
    assert_recovered(session, result)


def test_target_inherits_the_errors_of_the_reference_in_its_sigmas():
    """The accelerometer shows the error of the reference by |f| = g; the gyroscope shows none."""
    session = simulate(74, grades=("reference",), perfect_reference=False)
    found = calibrate(session)["target_1"]
    assert chi_square(session.target_units[0], found, "accelerometer") < 45.0
    sigmas = np.sqrt(np.diag(found.accelerometer.covariance))[:9]
    off = np.abs(errors(session.target_units[0], found, "accelerometer"))[:9]
    assert (off < 5.0 * sigmas).all()
