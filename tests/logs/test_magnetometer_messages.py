"""Magnetometers of bags, flight logs and telemetry, as libraries of others read them."""

import json

import numpy as np
import pytest
from mcap.writer import Writer
from pymavlink import DFReader, mavutil
from pymavlink.dialects.v20 import common as mavlink
from pyulog.core import ULog
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Writer1

from bag_fixtures import ROS1, ROS2, header, magnetic_messages, write_ros1, write_ros2
from dataflash_fixtures import DataFlashWriter
from log_fixtures import DATA, made_up
from tumble.foundation.errors import LogError
from tumble.foundation.magnetic import MagneticTrack
from tumble.logs import ReadOptions, open_recording
from ulog_fixtures import ULogWriter, turning

RNG = np.random.default_rng(34)
RAW = np.array([210.0, -95.0, 402.0]) + np.round(RNG.normal(0, 60.0, (200, 3)))
"""mG."""
TIME = 1000.0 + np.arange(200) / 20
TRACK = MagneticTrack(TIME, 0.1 * RAW)
PX4 = sorted((DATA / "px4").glob("*.ulg"))


def magnetic(source, **options):
    found = open_recording(source, ReadOptions(**options), need_imu=False).magnetic
    assert found is not None
    return found


@pytest.mark.parametrize("write", [write_ros1, write_ros2])
def test_magnetic_field_of_a_bag_is_that_of_rosbags(tmp_path, write):
    chunk = made_up(2000, rate=200.0, start=1000.0, temperature=False)
    path = tmp_path / ("log.bag" if write is write_ros1 else "log")
    other = MagneticTrack(TIME, TRACK.field + 1.0)
    write(path, {"/imu/data": chunk}, magnetic={"/gps/mag": other, "/imu/mag": TRACK})
    with AnyReader([path]) as theirs:
        read = [
            theirs.deserialize(data, connection.msgtype).magnetic_field
            for connection, _, data in theirs.messages()
            if connection.topic == "/imu/mag"
        ]
    found = magnetic(path)
    assert found.name == "/imu/mag"
    assert np.array_equal(found.field, 1e6 * np.array([(each.x, each.y, each.z) for each in read]))
    assert np.allclose(found.time, TIME, atol=1e-9, rtol=0.0)
    assert np.allclose(magnetic(path, magnetometer_name="/gps/mag").field, other.field)
    with pytest.raises(LogError, match="no magnetometer '/mag'; found: /gps/mag, /imu/mag"):
        magnetic(path, magnetometer_name="/mag")


def test_bag_of_a_magnetometer_alone_is_read(tmp_path):
    from rosbags.rosbag2 import Writer

    with Writer(tmp_path / "log", version=9) as writer:
        connection = writer.add_connection("/mag", "sensor_msgs/msg/MagneticField", typestore=ROS2)
        for _, _, stamp, data in magnetic_messages(ROS2, "/mag", TRACK):
            writer.write(connection, stamp, data)
    recording = open_recording(tmp_path / "log", need_imu=False)
    assert (recording.metadata.triads, recording.magnetic.name) == ((), "/mag")
    assert np.allclose(recording.magnetic.field, TRACK.field)


@pytest.mark.skipif(not PX4, reason="../shared/data/px4 is not there")
@pytest.mark.parametrize("path", PX4, ids=lambda path: path.stem)
def test_magnetometer_of_a_log_of_px4_is_that_of_pyulog(path):
    found = magnetic(path)
    name = "vehicle_magnetometer" if found.name != "sensor_combined" else "sensor_combined"
    theirs = ULog(str(path)).get_dataset(name).data
    field = np.stack([theirs[f"magnetometer_ga[{axis}]"] for axis in range(3)], axis=-1).astype(float) * 100.0
    time = theirs.get("timestamp_sample", theirs["timestamp"]).astype(float)
    relative = theirs.get("magnetometer_timestamp_relative")
    kept = np.ones(len(time), bool) if relative is None else relative != 2**31 - 1
    time = (time if relative is None else time + relative)[kept] / 1e6
    time, first = np.unique(time, return_index=True)
    assert found.already_corrected
    assert np.array_equal(found.time, time)
    assert np.allclose(found.field, field[kept][first], rtol=1e-12)
    assert 15.0 < found.strength < 130.0


def test_raw_magnetometer_of_px4_comes_before_the_corrected_one(tmp_path):
    time, force, turn = turning(np.random.default_rng(1), 2000)
    writer = ULogWriter({"CAL_MAG_PRIME": 20, "CAL_MAG1_ID": 20, "CAL_MAG1_ROT": 6})
    writer.add("sensor_combined", 0, time, gyro_rad=turn, accelerometer_m_s2=force)
    at = 2.0 + np.arange(80) / 10
    for instance in range(2):
        axes = dict(zip("xyz", (RAW[:80] / 1000.0 + instance).T, strict=True))
        writer.add("sensor_mag", instance, at, device_id=10 + 10 * instance, **axes)
    writer.add("vehicle_magnetometer", 0, at, device_id=20, magnetometer_ga=RAW[:80] / 1000.0 - 0.1)
    writer.add("battery_status", 0, at[::5], current_a=np.arange(16.0))
    path = writer.write(tmp_path / "flight.ulg")
    found = magnetic(path)
    assert (found.name, found.already_corrected) == ("sensor_mag_1", False)
    assert np.allclose(found.field, 0.1 * RAW[:80] + 100.0, rtol=1e-6)
    assert np.allclose(found.current[:76], np.arange(76) / 5)
    assert any("CAL_MAG1_ROT = 6 turns" in remark for remark in found.remarks)
    assert magnetic(path, magnetometer_name="vehicle_magnetometer_0").already_corrected


@pytest.mark.parametrize("ending", [".bin", ".log"])
@pytest.mark.parametrize("scale", [1.2, None])
def test_correction_of_ardupilot_is_undone(tmp_path, ending, scale):
    """The inverse is held against `correct_field` of ArduPilot, written out for each reading."""
    offsets, motors = np.array([40, -25, 10]), np.array([3, -2, 5])
    matrix = np.array([[1.05, 0.02, -0.03], [0.02, 0.97, 0.01], [-0.03, 0.01, 1.01]])
    axes = [f"COMPASS_{name}2_{axis}" for name in ("DIA", "ODI") for axis in "XYZ"]
    values = [1.05, 0.97, 1.01, 0.02, -0.03, 0.01]
    parameters = dict(zip(axes, values, strict=True)) | {"COMPASS_OFS2_X": 40.0}
    parameters |= {"COMPASS_DEV_ID2": 7.0, "COMPASS_PRIO1_ID": 7.0}
    if scale is not None:
        parameters["COMPASS_SCALE2"] = scale
        corrected = (RAW + offsets) * scale @ matrix.T + motors
    else:
        corrected = (RAW + offsets + motors) @ matrix.T
    time, force, turn = turning(np.random.default_rng(1), 2000)
    writer = DataFlashWriter(parameters).triads("IMU", time, force, turn)
    for at, field in zip(
        np.round(1e6 * (2.0 + np.arange(200) / 20)).astype(int).tolist(), corrected, strict=True
    ):
        whole = np.round(field).astype(int).tolist()
        writer.add("MAG", at, 0, *whole, *offsets.tolist(), *motors.tolist(), 1, at % 2**32)
        writer.add("BAT", at, 0, 12.0, 1e-6 * at)
    path = writer.write(tmp_path / f"flight{ending}")
    found = magnetic(path)
    assert (found.name, found.already_corrected, found.unit) == ("mag_0", False, "mG")
    # Whole milligauss are logged: half of one, through the inverse of a matrix near one.
    assert np.abs(10.0 * found.field - RAW).max() < 0.6
    assert np.allclose(found.current, found.time)
    reader = DFReader.DFReader_binary(str(path)) if ending == ".bin" else DFReader.DFReader_text(str(path))
    stamps = []
    while (message := reader.recv_match(type="MAG")) is not None:
        stamps.append(message.TimeUS)
    reader.close() if hasattr(reader, "close") else None
    assert np.array_equal(found.time, np.array(stamps) / 1e6)


@pytest.mark.parametrize("kind", ["HIGHRES_IMU", "SCALED_IMU2", "RAW_IMU"])
def test_magnetometer_of_telemetry_is_that_of_pymavlink(tmp_path, kind):
    sender, content = mavlink.MAVLink(None, srcSystem=1, srcComponent=1), b""
    heartbeat = sender.heartbeat_encode(2, 3, 0, 0, 4)
    for index, field in enumerate(RAW.astype(int).tolist()):
        triads = (0, 0, 1000, 5, 6, 7)
        if kind == "HIGHRES_IMU":
            force = (0.0, 0.0, 9.8, 0.01, 0.02, 0.03)
            gauss = [axis / 1000.0 for axis in field]
            message = sender.highres_imu_encode(10**7 + 10000 * index, *force, *gauss, 0, 0, 0, 20.0, 0xFFF)
        elif kind == "RAW_IMU":
            message = sender.raw_imu_encode(10**7 + 10000 * index, *triads, *field)
        else:
            message = sender.scaled_imu2_encode(10**4 + 10 * index, *triads, *field)
        for each in (heartbeat, message) if index == 0 else (message,):
            content += (1_700_000_000_000_000 + 10000 * index).to_bytes(8, "big") + each.pack(sender)
    path = tmp_path / "flight.tlog"
    path.write_bytes(content)
    link, theirs = mavutil.mavlink_connection(str(path)), []
    while (message := link.recv_match(type=kind)) is not None:
        theirs.append((message.xmag, message.ymag, message.zmag))
    link.close()
    found = magnetic(path)
    assert np.allclose(found.field, np.array(theirs) * (100.0 if kind == "HIGHRES_IMU" else 0.1))
    assert np.allclose(found.time, 10.0 + 0.01 * np.arange(200))
    assert found.already_corrected


def test_fields_of_a_message_are_its_magnetometer(tmp_path):
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("Sample", "jsonschema", b"{}")
        channel = writer.register_channel("/board", "json", schema)
        for index, field in enumerate((0.1 * RAW).tolist()):
            axes = dict(zip("xyz", field, strict=True))
            message = {
                "timestamp": 0.02 * index,
                "linear_acceleration": {"x": 0.1, "y": 0.2, "z": 9.8},
                "angular_velocity": {"x": 0.01, "y": 0.02, "z": 0.03},
                "magnetic_field": axes,
            }
            stamp = round(2e7 * index)
            writer.add_message(channel, stamp, json.dumps(message).encode(), stamp)
        writer.finish()
    found = magnetic(path)
    assert np.allclose(found.field, 0.1 * RAW)
    assert np.allclose(found.time, 0.02 * np.arange(200))


def test_vectors_on_a_topic_named_for_a_magnetometer_are_read(tmp_path):
    kind = "geometry_msgs/msg/Vector3Stamped"
    with Writer1(tmp_path / "log.bag") as writer:
        topics = [writer.add_connection(name, kind, typestore=ROS1) for name in ("/imu/mag", "/imu/rpy")]
        for time, field in zip(TIME, 1e-3 * RAW, strict=True):
            vector = ROS1.types["geometry_msgs/msg/Vector3"](*field)
            message = ROS1.types[kind](header(ROS1, time, "mag"), vector)
            for topic in topics:
                writer.write(topic, round(time * 1e9), bytes(ROS1.serialize_ros1(message, kind)))
    found = magnetic(tmp_path / "log.bag", magnetometer_unit="G")
    assert found.name == "/imu/mag"
    assert np.allclose(found.field, 0.1 * RAW)
    assert any("would be in G" in remark for remark in magnetic(tmp_path / "log.bag").remarks)
