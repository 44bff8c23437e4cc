"""Messages of any definition: JSON, protocol buffers, what embeds sensor_msgs/Imu; and compressed bags."""

from __future__ import annotations

import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from mcap.writer import CompressionType
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode
from rosbags.rosbag2 import Writer as Writer2

from bag_fixtures import ROS2, write_bag, write_mcap, write_ros1
from hostile import corrupted, few, for_long, read_or_refuse
from log_fixtures import made_up, read, refusal, same
from message_fixtures import (
    json_messages,
    write_json,
    write_messages,
    write_protobuf,
    write_raw,
    write_state_bag,
)
from tumble.logs import list_imus, open_recording
from tumble.logs.message_form import ObjectForm
from tumble.logs.rosmsg import MalformedMessageError

CHUNK = made_up(3000)
BARE = replace(CHUNK, temperature=None)


@pytest.mark.parametrize("writer", [write_json, write_protobuf])
@pytest.mark.parametrize("compression", CompressionType)
def test_messages_of_json_and_protocol_buffers_come_back_exactly(tmp_path, writer, compression):
    path = writer(tmp_path / "log.mcap", CHUNK, compression=compression)
    assert list_imus(path) == ("/imu",)
    assert same(read(path), CHUNK)
    assert open_recording(path).metadata.frame == "imu_link"


def test_a_file_without_index_is_read_too(tmp_path):
    path = write_json(tmp_path / "log.mcap", CHUNK, use_chunking=False)
    assert same(read(path), CHUNK)


@pytest.mark.parametrize("version", [1, 2])
def test_every_imu_that_a_message_embeds_is_named_by_its_field(tmp_path, version):
    path = write_state_bag(tmp_path / ("log.bag" if version == 1 else "log"), version, BARE)
    assert list_imus(path) == ("/state.front", "/state.rear")
    assert same(read(f"{path}:/state.front"), BARE)
    assert np.array_equal(read(f"{path}:/state.rear").accelerometer[:, 2], -BARE.accelerometer[:, 2])
    assert open_recording(f"{path}:/state.front").metadata.gyroscope_unit.reason == "message definition"


def test_fields_of_a_message_of_ros_are_known_by_their_names(tmp_path):
    path = write_raw(tmp_path / "log.mcap", CHUNK)
    found, metadata = read(path), open_recording(path).metadata
    assert np.array_equal(found.accelerometer, CHUNK.accelerometer)
    assert np.array_equal(found.gyroscope, CHUNK.gyroscope)
    assert np.array_equal(found.temperature, CHUNK.temperature)
    assert metadata.accelerometer_unit.reason == "column name"


def test_a_bag_that_holds_sensor_msgs_imu_is_searched_for_no_other(tmp_path):
    path = write_ros1(tmp_path / "log.bag", {"/imu/data": CHUNK})
    assert list_imus(path) == ("/imu/data",)


def test_a_message_without_a_field_that_the_first_has_is_named(tmp_path):
    messages = list(json_messages(CHUNK))
    messages[2] = (messages[2][0], messages[2][1].replace(b"angular_velocity", b"angular"))
    path = write_messages(tmp_path / "log.mcap", "json", messages)
    assert "message 3 of /imu holds no number angular_velocity.x" in refusal(path)


def test_a_message_that_is_no_json_is_named(tmp_path):
    messages = list(json_messages(CHUNK))
    messages[4] = (messages[4][0], b"{]")
    path = write_messages(tmp_path / "log.mcap", "json", messages)
    assert "message 5 of /imu is no JSON" in refusal(path)


def test_stamps_may_be_dates(tmp_path):
    text = b'{"time": "2024-05-01T12:00:00.%06dZ", "acc": [0.1, 0.0, 9.8], "gyro": [0.0, 0.0, 0.1]}'
    messages = [(index, text % (5000 * index)) for index in range(100)]
    found = read(write_messages(tmp_path / "log.mcap", "json", messages))
    assert np.allclose(np.diff(found.time), 0.005, rtol=0.0, atol=1e-6)
    assert abs(found.time[0] - 1714564800.0) < 1e-6


def test_topics_are_listed_where_none_holds_an_imu(tmp_path):
    path = write_messages(tmp_path / "log.mcap", "json", [(1, b'{"speed": 3.0}')], topic="/odometry")
    assert "topics found: /odometry" in refusal(path)


def test_missing_protocol_buffer_library_is_reported_with_a_remedy(tmp_path, monkeypatch):
    path = write_protobuf(tmp_path / "log.mcap", CHUNK)
    for name in [name for name in sys.modules if name.startswith("google")]:
        monkeypatch.setitem(sys.modules, name, None)
    message = refusal(path)
    assert "needs the Python package protobuf" in message
    assert "pip install 'tumble-imu[formats]'" in message


@pytest.mark.parametrize("compression", Writer1.CompressionFormat)
def test_chunks_of_a_ros_1_bag_may_be_compressed(tmp_path, compression):
    path = write_ros1(tmp_path / "log.bag", {"/imu/data": BARE}, compression)
    assert same(read(path), BARE)


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_files_and_messages_of_a_ros_2_bag_may_be_compressed(tmp_path, mode):
    writer = Writer2(tmp_path / "log", version=9)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    path = write_bag(tmp_path / "log", writer, ROS2, {"/imu/data": BARE})
    assert same(read(path), BARE)


def test_times_that_no_clock_shows_are_refused_or_left_out(tmp_path):
    messages = list(json_messages(made_up(200)))
    late = [(stamp + (1 << 63) * (index == 7), data) for index, (stamp, data) in enumerate(messages)]
    assert "recorded after the year 2262" in refusal(write_messages(tmp_path / "late.mcap", "json", late))
    messages[9] = (messages[9][0], messages[9][1].replace(b'"sec": 0', b'"sec": 1e18'))
    path = write_messages(tmp_path / "odd.mcap", "json", messages)
    assert len(read(path)) == 199


def test_a_definition_that_lacks_a_field_of_what_it_names_is_refused(tmp_path):
    path = write_state_bag(tmp_path / "log.bag", 1, BARE)
    corrupted = path.read_bytes().replace(b"angular_velocity_covariance", b"angular velocity_covariance")
    path.write_bytes(corrupted)
    assert "message 1 of /state lacks a field" in refusal(f"{path}:/state.front")


@pytest.mark.parametrize("value", [1.0, [1.0, 2.0], "text"])
def test_field_without_a_number_is_refused(value):
    form = ObjectForm(["gyro.2"], lambda _: SimpleNamespace(gyro=value))
    with pytest.raises(MalformedMessageError, match=r"holds no number gyro\.2"):
        form.read([b""], ["gyro.2"])


SMALL = made_up(30)
CORRUPTED = {
    "json.mcap": lambda path: write_json(path, SMALL, compression=CompressionType.NONE, enable_crcs=False),
    "protobuf.mcap": lambda path: write_protobuf(
        path, SMALL, compression=CompressionType.NONE, enable_crcs=False
    ),
    "raw.mcap": lambda path: write_raw(path, SMALL),
    "imu.mcap": lambda path: write_mcap(path, {"/imu": SMALL}, compression=CompressionType.LZ4),
    "imu.bag": lambda path: write_ros1(path, {"/imu": SMALL}, Writer1.CompressionFormat.BZ2),
    "state.bag": lambda path: write_state_bag(path, 1, SMALL),
}


@pytest.mark.parametrize("name", CORRUPTED)
def test_a_corrupted_file_of_messages_is_read_or_refused_in_one_line(tmp_path, name):
    whole = CORRUPTED[name](tmp_path / name).read_bytes()

    @few
    @given(data=corrupted(whole))
    def check(data):
        path = tmp_path / f"corrupted_{name}"
        path.write_bytes(data)
        read_or_refuse(path)

    for_long(check)
