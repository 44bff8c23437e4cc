"""`tumble align` as typed: tables, JSON, files that `tumble redundancy` reads, exit codes, help."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

import tumble
from align_motions import Motion, Sensor, drawn, errors, record
from tumble.procedures.redundancy.settings import RedundancySettings
from turntable_sessions import contents, typed, write_table

SECONDS = 30.0
SENSORS = (
    Sensor(rate_hz=100.0),
    drawn(61, rate_hz=100.0, skew=0.0, offset=0.0),
    drawn(62, rate_hz=100.0, skew=0.0, offset=0.0),
)


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Three units in one table, on one clock."""
    tables = [np.column_stack(record(Motion(61), sensor, SECONDS, k)) for k, sensor in enumerate(SENSORS)]
    header = ",".join(
        ["time", *(f"imu{k}_{c}" for k in (1, 2, 3) for c in ("ax", "ay", "az", "gx", "gy", "gz"))]
    )
    joined = np.column_stack([tables[0][:, :1], *(table[:, 1:] for table in tables)])
    return write_table(tmp_path_factory.mktemp("align") / "flight.csv", joined, header)


@pytest.fixture(scope="module")
def done(log):
    out = log.parent / "out"
    return typed("align", log, "--primary", "imu1", "--secondary", "imu2", "--secondary", "imu3", "-o", out)


def test_the_table_shows_every_unit_with_sigmas(done):
    assert done.code == 0, done.err
    head, *rows = [line for line in done.out.splitlines() if line.strip()]
    assert head == "Relative to imu1:"
    assert rows[0].split() == ["imu2", "imu3"]
    names = [row.strip() for row in rows[2:]]
    for name in ("rotation x", "time offset", "clock skew", "lever arm z", "gyroscope bias y"):
        row = next(each for each in names if each.startswith(name))
        assert row.count("±") == (0 if name == "clock skew" else 2)


def test_json_equals_the_table_and_sigmas_cover_the_truth(log):
    out = log.parent / "json"
    done = typed("align", log, "--primary", "imu1", "--secondary", "imu2", "--json", "-o", out)
    content = json.loads(done.out)
    assert content["primary"] == "imu1"
    assert content["files"]["settings"] == str(out / "align.yaml")
    (unit,) = content["units"]
    result = tumble.align("imu1", ["imu2"], log)["imu2"]
    assert unit["lever_arm"] == pytest.approx(result.lever_arm.tolist())
    for name, (error, sigma) in errors(result, SENSORS[0], SENSORS[1], SECONDS).items():
        if name != "skew":
            assert np.all(np.abs(error) < 6.0 * np.asarray(sigma)), name


def test_json_has_null_where_the_motion_shows_nothing(tmp_path):
    motion = Motion(63, turning=(0.0, 0.0, 1.0), pushing=0.0)
    paths = [
        write_table(tmp_path / f"{name}.csv", np.column_stack(record(motion, sensor, SECONDS, k)))
        for k, (name, sensor) in enumerate(zip(("a", "b"), SENSORS, strict=False))
    ]
    done = typed("align", "--primary", paths[0], "--secondary", paths[1], "--json", "-o", tmp_path / "out")
    assert done.code == 3
    (unit,) = json.loads(done.out)["units"]
    assert unit["sensor_from_primary"] is None
    assert unit["lever_arm"] == [None] * 3
    assert yaml.safe_load((tmp_path / "out/align.yaml").read_text())["units"]["b"].keys() == {"time_offset"}


def test_the_file_is_what_redundancy_takes_as_settings_of_its_units(done, log):
    settings = RedundancySettings.load(log.parent / "out" / "align.yaml")
    assert set(settings.units) == {"imu2", "imu3"}
    for sensor, unit in zip(SENSORS[1:], settings.units.values(), strict=True):
        assert unit.sensor_from_primary == pytest.approx(sensor.sensor_from_body.as_matrix(), abs=1e-3)
        assert unit.lever_arm == pytest.approx(sensor.lever_arm, abs=1e-3)
        assert unit.time_offset == pytest.approx(0.0, abs=1e-4)


def test_units_in_logs_of_their_own_are_named_by_their_files(tmp_path, log):
    done = typed("align", "--primary", f"{log}:imu1", "--secondary", f"{log}:imu3", "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert "Relative to flight-imu1:" in done.out
    assert set(contents(tmp_path / "out")) == {"align.yaml", "align.html"}


def test_the_same_log_gives_the_same_file_byte_for_byte(done, log):
    again = log.parent / "again"
    typed("align", log, "--primary", "imu1", "--secondary", "imu2", "--secondary", "imu3", "-o", again)
    assert (again / "align.yaml").read_bytes() == (log.parent / "out" / "align.yaml").read_bytes()


def test_a_later_run_takes_the_place_of_an_earlier_one_and_says_so(log, tmp_path):
    for secondary in ("imu2", "imu3"):
        done = typed("align", log, "--primary", "imu1", "--secondary", secondary, "-o", tmp_path / "out")
        assert done.code == 0, done.err
    assert set(RedundancySettings.load(tmp_path / "out" / "align.yaml").units) == {"imu3"}
    assert "replaced in" in done.err
    assert "align.yaml" in done.err


def test_the_order_of_the_secondaries_changes_nothing_but_their_order(log):
    result = tumble.align("imu1", ["imu2", "imu3"], log)
    turned = tumble.align("imu1", ["imu3", "imu2"], log)
    assert [unit.name for unit in turned] == ["imu3", "imu2"]
    for unit in result:
        assert np.array_equal(unit.lever_arm, turned[unit.name].lever_arm)


def test_progress_ends_at_all_samples_of_all_units(log):
    told = []
    tumble.align("imu1", ["imu2", "imu3"], log, progress=lambda done, expected: told.append((done, expected)))
    samples = [done for done, _ in told]
    assert samples == sorted(samples)
    assert samples[-1] == 3 * round(SECONDS * 100.0)


def test_help_has_an_example_that_runs():
    done = typed("align", "--help")
    assert done.code == 0
    assert "tumble align flight.parquet --primary imu1 --secondary imu2" in " ".join(done.out.split())
