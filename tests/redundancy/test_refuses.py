"""Inputs that cannot be replayed are refused in one line, before anything is written."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from redundancy_sets import (
    BIASED,
    PRIMARY,
    QUICK,
    SOUND,
    motion,
    record,
    refusal,
    typed,
    units,
    write_table,
)
from tumble.foundation.errors import ProcedureError
from turntable_sessions import contents


@pytest.fixture(scope="module")
def said():
    return record([PRIMARY, BIASED, SOUND], 21, motion(moving=6.0, after=3.0))


@pytest.fixture(scope="module")
def log(said, tmp_path_factory):
    return write_table(tmp_path_factory.mktemp("log") / "flight.csv", said)


EARLIER = '{"time": 1.0, "unit": "imu1", "event": "healthy", "figures": {}}\n'
"""Events of an earlier run."""


@pytest.fixture
def out(tmp_path):
    """A folder in which something stands, to be as it was after a refusal."""
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "imu2.redundancy.yaml").write_text("of an earlier run")
    (folder / "events.jsonl").write_text(EARLIER)
    yield folder
    assert contents(folder) == {
        "imu2.redundancy.yaml": b"of an earlier run",
        "events.jsonl": EARLIER.encode(),
    }


def test_unknown_unit_of_a_log_is_refused_with_the_known_ones(log, out):
    line = refusal(log, "--primary", "imu1", "--secondary", "imu9", "-o", out)
    assert line.startswith(f"{log}: no IMU 'imu9'; found: imu1, imu2, imu3")
    assert "--allow-missing" in line


def test_a_log_that_is_not_there_is_named(log, out, tmp_path):
    line = refusal("--primary", f"{log}:imu1", "--secondary", tmp_path / "gone.csv", "-o", out)
    assert line.startswith(f"{tmp_path / 'gone.csv'}: no such file or folder")


@pytest.mark.parametrize("again", ["imu2", "/imu2/", "{log}:imu2"])
def test_the_same_unit_twice_is_refused_however_it_is_written(log, out, again):
    words = ["--secondary", "imu2", "--secondary", again.format(log=log)]
    assert "is named twice among the secondaries" in refusal(log, "--primary", "imu1", *words, "-o", out)


@pytest.mark.parametrize("again", ["imu1", "{log}:imu1"])
def test_the_primary_cannot_be_its_own_secondary(log, out, again):
    line = refusal(log, "--primary", "imu1", "--secondary", again.format(log=log), "-o", out)
    assert "is the primary and cannot be its own secondary" in line


def test_more_secondaries_than_a_monitor_has_room_for_are_refused(log, out):
    words = [word for number in range(8) for word in ("--secondary", f"imu{number + 2}")]
    assert refusal(log, "--primary", "imu1", *words, "-o", out).startswith("8 secondaries were named")


def test_a_log_given_with_one_of_its_imus_is_refused(log, out):
    line = refusal(f"{log}:imu1", "--primary", "imu1", "--secondary", "imu2", "-o", out)
    assert "give the log alone" in line


def test_logs_of_different_times_are_refused_with_the_times(said, out, tmp_path):
    early = said["imu1"].write(tmp_path / "early.csv")
    late = said["imu2"]
    late = type(late)(late.imu, late.time + 1.7e9, late.readings).write(tmp_path / "late.csv")
    line = refusal(*units([early, late]), "-o", out)
    assert line.startswith("late: shares no time with the primary early: early ends at 13.990 s, late begins")
    assert "units.late.time_offset" in line
    line = refusal(*units([late, early]), "-o", out)
    assert line.startswith("early: shares no time with the primary late: early ends at 13.990 s, late begins")


def test_an_offset_that_takes_the_logs_apart_is_refused(log, out):
    line = refusal(
        log, "--primary", "imu1", "--secondary", "imu2", "--set", "units.imu2.time_offset=-100", "-o", out
    )
    assert "shares no time with the primary" in line


def test_contradictory_settings_are_refused_before_the_log_is_read(log, out):
    line = refusal(log, *units(["imu1", "imu2"]), "--set", "collect=700", "-o", out)
    assert line == "settings: collect_timeout is 300.0 and collect is 700.0; the first needs to be longer"


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (["noise_ratio=1"], "noise_ratio needs to be greater than 1"),
        (["noise_ratio=-3"], "noise_ratio needs to be greater than 1"),
        (["tolerated_specific_force=0"], "tolerated_specific_force needs to be greater than 0"),
        (["tolerated_specific_force=.inf"], "tolerated_specific_force needs to be a finite number"),
        (["tolerated_angular_rate=-0.1"], "tolerated_angular_rate needs to be greater than 0"),
        (["tolerated_angular_rate=.nan"], "tolerated_angular_rate needs to be a finite number"),
        (
            ["tolerated_specific_force=3"],
            "largest_specific_force_bias is 3.0 and tolerated_specific_force is 3.0; the first needs",
        ),
        (
            ["secondary_accelerometer_threshold=9"],
            "largest_specific_force_bias is 3.0 and secondary_accelerometer_threshold is 9; the first needs",
        ),
        (
            ["secondary_gyroscope_threshold=last+0.5", "largest_angular_rate_bias=0.2"],
            "largest_angular_rate_bias is 0.2 and secondary_gyroscope_threshold is last+0.5; the first needs",
        ),
        (
            ["secondary_gyroscope_threshold=0.9", "secondary_accelerometer_threshold=last+0.05"],
            "tolerated_angular_rate is 0.0075 and secondary_gyroscope_threshold is 0.9; the first needs",
        ),
        (["hold=2", "return_after=1"], "return_after is 1.0 and hold is 2.0; the first needs to be longer"),
        (
            ["units.imu2.gyroscope_threshold=2"],
            "imu2: accelerometer_threshold or gyroscope_threshold is beyond",
        ),
    ],
)
def test_settings_that_cannot_be_meant_are_refused_by_name(log, out, changes, says):
    words = [word for change in changes for word in ("--set", change)]
    assert says in refusal(log, *units(["imu1", "imu2"]), *words, "-o", out)


@pytest.mark.parametrize(("setting", "most"), [("frozen=3", "2.79616"), ("saturated=9", "8.38848")])
def test_time_beyond_the_longest_one_is_refused_with_that(log, out, setting, most):
    line = refusal(log, *units(["imu1", "imu2"]), "--set", setting, "-o", out)
    name, value = setting.split("=")
    assert line == (
        f"settings: {name} is {value}.0; the monitor counts up to {most} s here; give a shorter time"
    )


def test_a_settings_file_that_is_not_there_is_named(log, out, tmp_path):
    line = refusal(log, *units(["imu1", "imu2"]), "--settings", tmp_path / "gone.yaml", "-o", out)
    assert line.startswith(f"{tmp_path / 'gone.yaml'}: no such redundancy settings file")


def test_units_in_the_settings_that_are_none_of_these_are_refused(log, out):
    line = refusal(log, *units(["imu1", "imu2"]), "--set", "units.imu3.time_offset=1", "-o", out)
    assert line.startswith("units: imu3: is none of imu1, imu2")


@pytest.mark.parametrize("stated", ["sensor_from_primary=[0,0,1]", "lever_arm=[0,0,1]"])
def test_impossible_primary_is_refused(log, out, stated):
    line = refusal(log, *units(["imu1", "imu2"]), "--set", f"units.imu1.{stated}", "-o", out)
    assert line.startswith("units: imu1: is the primary")


def test_two_units_with_one_identity_are_refused(log, out):
    changes = [word for name in ("imu2", "imu3") for word in ("--set", f"units.{name}.identity=7")]
    line = refusal(log, *units(["imu1", "imu2", "imu3"]), *changes, "-o", out)
    assert line.startswith("imu3: has the identity 7 of imu2")


def test_two_units_whose_files_would_have_one_name_are_refused():
    said = record([PRIMARY, BIASED, SOUND], 22, motion(moving=2.0, after=3.0))
    recordings = [
        tumble.Recording.from_arrays(name, unit.time, unit.readings[:, :3], unit.readings[:, 3:])
        for name, unit in zip(("p", "a/b", "a b"), said.values(), strict=True)
    ]
    with pytest.raises(ProcedureError, match=r"would both be written to a_b\.redundancy\.yaml"):
        tumble.redundancy(recordings[0], recordings[1:])


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ("700:evaluate", "the logs end at"),
        ("-1:return", "lies before the logs"),
        ("5:land", "give TIME:evaluate or TIME:return"),
        ("soon:evaluate", "give TIME:evaluate or TIME:return"),
        ("nan:evaluate", "at a time in s"),
    ],
)
def test_a_command_that_cannot_be_given_is_refused(log, out, command, says):
    assert says in refusal(log, *units(["imu1", "imu2"]), "--command", command, "-o", out)


def test_a_log_cut_off_in_the_middle_of_a_row_is_refused_at_its_line(said, out, tmp_path):
    path = said["imu2"].write(tmp_path / "cut.csv")
    text = path.read_text()
    path.write_text(text[: len(text) // 2].rsplit(",", 3)[0])
    line = refusal(*units([said["imu1"].write(tmp_path / "imu1.csv"), path]), "-o", out)
    assert line.startswith(f"{path}")


def test_a_parquet_log_cut_off_is_refused(said, out, tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = tmp_path / "cut.parquet"
    columns = dict(zip(("ax", "ay", "az", "gx", "gy", "gz"), said["imu2"].readings.T, strict=True))
    pq.write_table(pa.table({"time": said["imu2"].time, **columns}), path)
    path.write_bytes(path.read_bytes()[:-200])
    line = refusal(*units([said["imu1"].write(tmp_path / "imu1.csv"), path]), "-o", out)
    assert line.startswith(f"{path}")


def test_a_folder_with_one_log_a_pose_is_no_log_of_a_flight(said, out, tmp_path):
    folder = tmp_path / "poses"
    folder.mkdir()
    for name in ("a", "b"):
        said["imu2"].write(folder / f"{name}.csv")
    line = refusal(*units([said["imu1"].write(tmp_path / "imu1.csv"), folder]), "-o", out)
    assert "is a folder of 2 logs, one per pose" in line


def test_readings_in_a_wrong_unit_are_refused_with_its_option(said, out, tmp_path):
    turned = said["imu2"]
    wrong = type(turned)(turned.imu, turned.time, turned.readings * np.array([1 / 9.80665] * 3 + [1.0] * 3))
    header = "time,ax (m/s^2),ay (m/s^2),az (m/s^2),gx,gy,gz"
    path = wrong.write(tmp_path / "imu2.csv", header)
    line = refusal(*units([said["imu1"].write(tmp_path / "imu1.csv"), path]), "-o", out)
    assert "read it with --accelerometer-unit g" in line


def test_the_option_for_one_unit_reads_that_unit_only(said, tmp_path):
    degrees = said["imu2"]
    degrees = type(degrees)(
        degrees.imu, degrees.time, degrees.readings * np.array([1.0] * 3 + [180.0 / np.pi] * 3)
    )
    paths = [said["imu1"].write(tmp_path / "imu1.csv"), degrees.write(tmp_path / "imu2.csv")]
    done = typed(
        "redundancy", *units(paths), *QUICK, "--for", "imu2:gyroscope-unit=deg/s", "-o", tmp_path / "out"
    )
    assert done.code in (0, 3), done.err
    result = tumble.redundancy(
        paths[0], [paths[1]], read={str(paths[1]): tumble.ReadOptions(gyroscope_unit="deg/s")}
    )
    rates = result.traces[1].angular_rate - result.traces[0].angular_rate
    assert np.nanmax(np.abs(rates)) < 0.1


def test_a_primary_calibration_that_is_none_is_refused(log, out, tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text("schema: tumble-calibration/1\nname: imu1\n")
    line = refusal(log, *units(["imu1", "imu2"]), "--calibration", path, "-o", out)
    assert line.startswith(f"{path}: line 1: has no accelerometer, gyroscope or magnetometer section")


def test_an_output_folder_that_cannot_be_written_to_is_refused(log, tmp_path):
    path = tmp_path / "file"
    path.write_text("")
    assert refusal(log, *units(["imu1", "imu2"]), "-o", path).startswith(f"{path}: cannot write")
