"""Triads of one table with stamps of their own: each is read by its own."""

from __future__ import annotations

import json

import h5py
import numpy as np
import pandas as pd
import pytest

from log_fixtures import read, refusal
from message_fixtures import write_messages
from tumble.logs import ReadOptions, open_recording

ROWS, STEP, LATE = 600, 0.01, 0.02
TIME = np.arange(ROWS) * STEP
STATED = {"accelerometer_unit": "m/s^2", "gyroscope_unit": "rad/s"}


def readings(time):
    """Readings that turn with time, of both triads."""
    force = np.column_stack([np.sin(time), np.cos(time), 9.8 + 0.1 * time])
    return force, np.column_stack([np.cos(time), np.sin(2.0 * time), 0.1 * time])


def table_of(
    late, names=("t", "gyro_timestamp"), triads=(("acc_x", "acc_y", "acc_z"), ("gyro_x", "gyro_y", "gyro_z"))
):
    """A table whose gyroscope was read later than its accelerometer."""
    force, _ = readings(TIME)
    _, rate = readings(TIME + late)
    columns = {names[0]: TIME, **dict(zip(triads[0], force.T, strict=True))}
    return columns | {names[1]: TIME + late, **dict(zip(triads[1], rate.T, strict=True))}


def mcap(path, table):
    rows = pd.DataFrame(table).to_dict("records")
    write_messages(path, "json", [(k, json.dumps(row).encode()) for k, row in enumerate(rows)], topic="/imu")


def hdf5(path, table):
    with h5py.File(path, "w") as file:
        for name, values in table.items():
            file.create_dataset(name, data=values)


WRITERS = {
    "log.csv": lambda path, table: pd.DataFrame(table).to_csv(path, index=False),
    "log.parquet": lambda path, table: pd.DataFrame(table).to_parquet(path),
    "log.feather": lambda path, table: pd.DataFrame(table).to_feather(path),
    "log.npz": lambda path, table: np.savez(path, **table),
    "log.h5": hdf5,
    "log.mcap": mcap,
}
SENSORLOG = (
    ("accelerometerTimestamp_sinceReboot(s)", "gyroTimestamp_sinceReboot(s)"),
    tuple(
        tuple(f"{name}{axis}({unit})" for axis in "XYZ")
        for name, unit in (("accelerometerAcceleration", "G"), ("gyroRotation", "rad/s"))
    ),
)
NAMES = {
    "t and gyro_timestamp": ("t", "gyro_timestamp"),
    "acc_time and gyro_time": ("acc_time", "gyro_time"),
    "acc_time and time": ("acc_time", "time"),
}


def written(folder, name, table):
    WRITERS[name](folder / name, table)
    return folder / name


def assert_read_by_own_stamps(found, unit=1.0):
    force, rate = readings(found.time)
    assert found.time[0] == pytest.approx(LATE)
    assert np.abs(found.accelerometer / unit - force).max() < 1e-3
    assert np.abs(found.gyroscope - rate).max() < 1e-9


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("names", NAMES.values(), ids=NAMES)
def test_each_triad_is_read_by_stamps_of_its_own(tmp_path, name, names):
    path = written(tmp_path, name, table_of(LATE, names))
    message = refusal(path, ReadOptions(**STATED))
    assert f"{names[0]} is 0 and {names[1]} 0.02: " in message
    assert message.endswith("with --interpolate")
    assert_read_by_own_stamps(read(path, ReadOptions(interpolate=True, **STATED)))


@pytest.mark.parametrize("name", WRITERS)
def test_equal_stamps_of_both_triads_change_nothing(tmp_path, name):
    found = read(written(tmp_path, name, table_of(0.0)), ReadOptions(interpolate=True, **STATED))
    assert np.array_equal(found.accelerometer, readings(TIME)[0])
    assert np.array_equal(found.time, TIME)


def test_a_gyroscope_of_sensorlog_keeps_its_stamps(tmp_path):
    table = table_of(LATE, *SENSORLOG)
    in_g = {name: values / 9.80665 for name, values in table.items() if name.endswith("(G)")}
    path = written(tmp_path, "log.csv", table | in_g)
    assert "--interpolate" in refusal(path)
    found = read(path, ReadOptions(interpolate=True))
    # iOS reads -g upwards.
    assert_read_by_own_stamps(found, -1.0)


def test_stamps_that_the_user_names_are_those_of_both(tmp_path):
    path = written(tmp_path, "log.csv", table_of(LATE))
    assert np.array_equal(read(path, ReadOptions(columns={"time": "t"}, **STATED)).time, TIME)


def test_repeated_stamps_of_a_slower_triad_are_brought_together(tmp_path):
    table = table_of(LATE)
    table["t"] = np.repeat(TIME[::2], 2)
    recording = open_recording(written(tmp_path, "log.csv", table), ReadOptions(interpolate=True, **STATED))
    for chunk in recording.chunks():
        assert np.isfinite(chunk.accelerometer).all()


def test_an_imu_among_others_is_read_by_stamps_of_its_own(tmp_path):
    force, rate = readings(TIME)
    numbers = np.column_stack([force, rate])
    names = [f"{letter}{axis}" for letter in "ag" for axis in "xyz"]
    table = {"time": TIME}
    for imu, late in (("imu1", None), ("imu2", 0.15)):
        table |= {} if late is None else {f"{imu}_sample_time": TIME + late}
        table |= {f"{imu}_{name}": numbers[:, k] for k, name in enumerate(names)}
    path = written(tmp_path, "log.csv", table)
    assert np.allclose(read(f"{path}:imu1").time, TIME)
    assert np.allclose(read(f"{path}:imu2").time, TIME + 0.15)


def test_stamps_in_two_units_are_refused(tmp_path):
    path = written(tmp_path, "log.csv", table_of(LATE, ("acc_time_ms", "gyro_time_us")))
    assert "acc_time_ms is in ms, gyro_time_us in us" in refusal(path)
