"""Statements of a log hold where they stand: no sample is that of another sensor, layout or scale."""

from __future__ import annotations

import struct

import h5py
import numpy as np
import pytest
import scipy.io

import format_fixtures as formats
from bag_fixtures import write_ros1, write_ros2
from dataflash_fixtures import DataFlashWriter, definition
from log_fixtures import made_up, read, refusal
from tumble.logs import ReadOptions, open_recording
from ulog_fixtures import DEVICES, ULogWriter, message, sensors, turning

BLOCK = 1 << 20
"""Bytes that are taken apart at once."""


def subscription(number, topic, instance):
    return message("A", struct.pack("<BH", instance, number) + topic.encode())


@pytest.mark.parametrize("later", ["other topic", "other instance", "unwanted"])
def test_a_subscription_bound_again_leaves_what_was_read(tmp_path, later):
    time, force, turn = turning(np.random.default_rng(1), 500)
    content = sensors(ULogWriter(), 0, time, force, turn).content()
    others = {
        "other topic": [(0, "sensor_gyro", 0), (1, "sensor_accel", 0)],
        "other instance": [(0, "sensor_accel", 1), (1, "sensor_gyro", 1)],
        "unwanted": [(0, "vehicle_status", 0), (1, "vehicle_status", 0)],
    }[later]
    path = tmp_path / "flight.ulg"
    path.write_bytes(content + b"".join(subscription(*each) for each in others))
    found = read(f"{path}:sensor_0")
    assert np.allclose(found.accelerometer, force, rtol=1e-6)
    assert np.allclose(found.gyroscope, turn, rtol=1e-6)


def test_two_subscriptions_of_one_topic_are_all_read(tmp_path):
    time, force, turn = turning(np.random.default_rng(2), 600)
    halves = [slice(0, 300), slice(300, 600)]
    writer = ULogWriter()
    for half in halves:
        sensors(writer, 0, time[half], force[half], turn[half])
    found = read(writer.write(tmp_path / "flight.ulg"))
    assert np.allclose(found.time, time, atol=1e-6)
    assert np.allclose(found.accelerometer, force, rtol=1e-6)


def test_a_change_of_device_within_a_topic_is_named(tmp_path):
    time, force, turn = turning(np.random.default_rng(3), 400)
    writer = ULogWriter()
    for half, add in ((slice(0, 200), 0), (slice(200, 400), 8)):
        sensors(writer, 0, time[half], force[half], turn[half], added=add)
    remarks = open_recording(writer.write(tmp_path / "flight.ulg")).metadata.remarks
    for triad, device in DEVICES.items():
        assert any(
            f"the {triad} changes" in each and f"{device} and {device + 8}" in each for each in remarks
        )


def test_every_batch_of_a_block_is_read_by_its_own_head(tmp_path):
    generator, writer, counts = np.random.default_rng(4), DataFlashWriter(), []
    for number in range(200):
        counts.append(generator.integers(-2000, 2000, (64, 3)))
        # Numbers are given again, as after a start within one log.
        writer.batch(number % 90, 1, 0, 5.0 + number, 1000.0, 5000 + number, counts[-1])
    path = writer.write(tmp_path / "flight.bin")
    assert path.stat().st_size < BLOCK
    found = read(path)
    expected = np.vstack([each / (5000 + number) for number, each in enumerate(counts)])
    assert np.allclose(found.gyroscope, expected, rtol=1e-6)


def plain(kind, time, first, second):
    return b"".join(
        bytes((0xA3, 0x95, kind)) + struct.pack("<Qffffff", round(1e6 * at), *one, *other)
        for at, one, other in zip(time, first, second, strict=True)
    )


COLUMNS = "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"
OTHERS = "TimeUS,AccX,AccY,AccZ,GyrX,GyrY,GyrZ"


def test_a_name_that_is_laid_out_anew_is_refused(tmp_path):
    time, force, turn = turning(np.random.default_rng(5), 200)
    path = tmp_path / "flight.bin"
    path.write_bytes(
        definition(150, "IMU", "Qffffff", COLUMNS)
        + plain(150, time[:100], turn[:100], force[:100])
        + definition(150, "IMU", "Qffffff", OTHERS)
        + plain(150, time[100:], force[100:], turn[100:])
    )
    assert "defines the message 'IMU' a second time" in refusal(path)


def test_a_type_that_becomes_another_message_ends_the_one_before(tmp_path):
    time, force, turn = turning(np.random.default_rng(6), 200)
    path = tmp_path / "flight.bin"
    path.write_bytes(
        definition(150, "IMU", "Qffffff", COLUMNS)
        + plain(150, time[:100], turn[:100], force[:100])
        + definition(150, "XYZQ", "Qffffff", "TimeUS,a,b,c,d,e,f")
        + plain(150, time[100:], force[100:], turn[100:])
    )
    found = read(path)
    assert np.allclose(found.accelerometer, force[:100], rtol=1e-6)


def test_two_types_of_one_name_are_all_read(tmp_path):
    time, force, turn = turning(np.random.default_rng(7), 200)
    path = tmp_path / "flight.bin"
    definitions = b"".join(definition(kind, "IMU", "Qffffff", COLUMNS) for kind in (150, 151))
    rows = [[each[number : number + 1] for each in (time, turn, force)] for number in range(200)]
    path.write_bytes(definitions + b"".join(plain(150 + number % 2, *row) for number, row in enumerate(rows)))
    found = read(path)
    assert np.allclose(found.accelerometer, force, rtol=1e-6)
    assert np.allclose(found.time, time, atol=1e-6)


@pytest.mark.parametrize("write", [write_ros1, write_ros2])
def test_an_imu_that_joins_a_topic_late_is_refused(tmp_path, write):
    chunk = made_up(2000, rate=200.0)
    path = write(tmp_path / "log.bag", {"/imu/data": chunk}, frames=("left",) * 1990 + ("right",) * 10)
    assert "'left' and 'right'" in refusal(path)


@pytest.mark.parametrize("name", ["log.mat", "log.h5"])
def test_a_rate_is_that_of_the_group_it_stands_in(tmp_path, name):
    chunk = made_up(500, rate=100.0)
    imu = {"acc": chunk.accelerometer, "gyr": chunk.gyroscope}

    def written(rate_of_imu, at_root):
        path = tmp_path / name
        groups = {"gps": {"fs": 10.0, "alt": np.arange(9.0)}, "imu": imu | rate_of_imu}
        if name.endswith(".mat"):
            scipy.io.savemat(path, groups | at_root)
            return path
        with h5py.File(path, "w") as file:
            for group, content in groups.items():
                for key, values in content.items():
                    file[f"{group}/{key}"] = values
            for key, value in at_root.items():
                file[key] = value
        return path

    for rates in (({"fs": 100.0}, {"fs": 50.0}), ({}, {"fs": 100.0})):
        assert np.allclose(np.diff(read(f"{written(*rates)}:imu").time), 0.01)
    assert "--rate" in refusal(f"{written({}, {})}:imu")
    assert "100 Hz" in refusal(f"{written({'fs': 100.0, 'Fs': 200.0}, {})}:imu")


def test_packed_numbers_of_hdf5_are_unpacked(tmp_path):
    chunk = made_up(500, rate=100.0)
    scale, offset, none = 0.001, 2.5, -32768
    packed = np.round((chunk.accelerometer - offset) / scale).astype(np.int16)
    packed[7, 1] = none
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["t"], file["gyr"], file["acc"] = chunk.time, chunk.gyroscope, packed
        file["gyr"].attrs["_FillValue"] = np.nan
        file["acc"].attrs.update({"scale_factor": scale, "add_offset": offset, "_FillValue": np.int16(none)})
    found = read(tmp_path / "log.h5")
    kept = np.delete(np.arange(500), 7)
    assert np.array_equal(found.time, chunk.time[kept])
    assert np.array_equal(found.gyroscope, chunk.gyroscope[kept])
    assert np.allclose(found.accelerometer, chunk.accelerometer[kept], atol=scale)
    with h5py.File(tmp_path / "log.h5", "a") as file:
        file["acc"].attrs["scale_factor"] = "a tenth"
    assert "scale_factor is no number" in refusal(tmp_path / "log.h5")


def test_columns_of_a_table_of_pandas_have_their_names(tmp_path):
    chunk = made_up(500, rate=100.0)
    path = tmp_path / "log.h5"
    names = ["gz", "gx", "gy", "az", "ax", "ay"]
    table = np.column_stack([chunk.gyroscope, chunk.accelerometer])[:, [2, 0, 1, 5, 3, 4]]
    with h5py.File(path, "w") as file:
        group = file.create_group("df")
        group["axis0"] = group["block0_items"] = np.array(names, "S2")
        group["block0_values"] = table
    found = read(path, ReadOptions(rate=100.0))
    assert np.array_equal(found.accelerometer, chunk.accelerometer)
    assert np.array_equal(found.gyroscope, chunk.gyroscope)


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ('"blackbox_high_resolution","1"', "blackbox_high_resolution 1"),
        ('"gyro_scale","0x3d79c190"', "gyro_scale 0.06098"),
        ('"gyro_scale","0x3f800000"', ""),
        ('"blackbox_high_resolution","0"', ""),
    ],
)
def test_rates_that_headers_say_are_scaled_need_their_scale(tmp_path, header, said):
    chunk = made_up(500, rate=100.0)
    path, _, expected = formats.betaflight(tmp_path, chunk, raw=True)
    with (tmp_path / "LOG00007.01.headers.csv").open("a") as file:
        file.write(f"{header}\n")
    if said:
        assert said in refusal(path)
        found = read(path, ReadOptions(gyroscope_scale=10.0))
        assert np.allclose(10.0 * found.gyroscope, expected.gyroscope, rtol=1e-12)
    else:
        assert np.allclose(read(path).gyroscope, expected.gyroscope, rtol=1e-12)
