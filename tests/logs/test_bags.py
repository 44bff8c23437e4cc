"""Bags of ROS 1 and ROS 2, and MCAP as others write it."""

from __future__ import annotations

import numpy as np
import pytest
from mcap.writer import CompressionType, IndexType
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2

from bag_fixtures import IMU, ROS1, ROS2, TEXT, imu_message, write_mcap, write_ros1, write_ros2
from log_fixtures import assert_said_to_be_cut_short, made_up, read, refusal, same
from tumble.foundation.names import LONGEST_NAME
from tumble.logs import list_imus, open_recording
from tumble.logs.rosmsg import CDR, decode
from tumble.logs.rosmsg import ROS1 as ROS1_ENCODING


@pytest.fixture
def chunk():
    return made_up(700, rate=125.0, start=1000.0, temperature=False)


WAYS = {
    "ros1": lambda folder, topics, **kw: write_ros1(folder / "log.bag", topics, **kw),
    "ros1 bz2": lambda folder, topics, **kw: write_ros1(
        folder / "log.bag", topics, Writer1.CompressionFormat.BZ2, **kw
    ),
    "ros1 lz4": lambda folder, topics, **kw: write_ros1(
        folder / "log.bag", topics, Writer1.CompressionFormat.LZ4, **kw
    ),
    "ros2 folder": lambda folder, topics, **kw: write_ros2(folder / "log", topics, **kw),
    "ros2 folder of mcap": lambda folder, topics, **kw: write_ros2(
        folder / "log", topics, StoragePlugin.MCAP, **kw
    ),
    "bare db3": lambda folder, topics, **kw: next(write_ros2(folder / "log", topics, **kw).glob("*.db3")),
    "bare mcap": lambda folder, topics, **kw: next(
        write_ros2(folder / "log", topics, StoragePlugin.MCAP, **kw).glob("*.mcap")
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_a_bag_reads_as_it_was_recorded(tmp_path, chunk, way):
    path = WAYS[way](tmp_path, {"/imu/data": chunk})
    recording = open_recording(path)
    assert same(read(path), chunk)
    assert recording.metadata.frame == "imu_link"
    assert recording.metadata.accelerometer_unit.reason == "message definition"


@pytest.mark.parametrize("way", WAYS)
def test_a_topic_whose_name_is_longer_than_any_is_refused(tmp_path, chunk, way):
    path = WAYS[way](tmp_path, {"/imu/" + LONGEST_NAME * "x": chunk})
    assert f"a name of {LONGEST_NAME + 5} letters; {LONGEST_NAME} at most" in refusal(path)


@pytest.mark.parametrize("way", WAYS)
def test_a_topic_picks_one_of_several_imus_of_a_bag(tmp_path, chunk, way):
    other = made_up(500, rate=100.0, seed=9, start=1000.0, temperature=False)
    path = WAYS[way](tmp_path, {"/imu/reference": chunk, "/imu/target_1": other})
    assert list_imus(path) == ("/imu/reference", "/imu/target_1")
    assert same(read(f"{path}:/imu/reference"), chunk)
    assert same(read(f"{path}:imu/target_1"), other)
    assert "/imu/reference, /imu/target_1" in refusal(path)
    assert "no topic '/imu/target_2'" in refusal(f"{path}:/imu/target_2")


@pytest.mark.parametrize("way", WAYS)
def test_messages_without_a_stamp_take_the_time_of_recording(tmp_path, chunk, way):
    path = WAYS[way](tmp_path, {"/imu/data": chunk}, stamped=False)
    recording = open_recording(path)
    assert same(read(path), chunk)
    assert recording.metadata.clock.endswith("log time")
    assert "headers carry no stamp: time is that of recording" in recording.metadata.remarks


@pytest.mark.parametrize("way", ["ros1", "ros2 folder", "bare mcap"])
def test_two_frames_on_one_topic_are_two_imus_and_refused(tmp_path, chunk, way):
    path = WAYS[way](tmp_path, {"/imu/data": chunk}, frames=("left", "right"))
    line = refusal(path)
    assert "2 IMUs publish to /imu/data" in line
    assert "'left' and 'right'" in line


@pytest.mark.parametrize("encoding", [ROS1_ENCODING, CDR])
def test_a_frame_whose_name_changes_length_does_not_matter(chunk, encoding):
    store = ROS1 if encoding is ROS1_ENCODING else ROS2
    frames = ("", "a", "imu", "imu_link", "body/imu_link_3")
    messages = []
    for index in range(len(chunk.time)):
        message = imu_message(store, chunk, index, frames[index % len(frames)])
        serialize = store.serialize_ros1 if encoding is ROS1_ENCODING else store.serialize_cdr
        messages.append(bytes(serialize(message, IMU)))
    found = decode(messages, "imu", encoding)
    assert np.array_equal(found.specific_force, chunk.accelerometer)
    assert np.array_equal(found.angular_rate, chunk.gyroscope)


@pytest.mark.parametrize("way", WAYS)
def test_a_temperature_topic_beside_the_imu_is_held_at_its_samples(tmp_path, way):
    chunk = made_up(300, rate=100.0, start=5.0)
    found = read(WAYS[way](tmp_path, {"/imu/data": chunk}))
    assert np.array_equal(found.temperature[1:], chunk.temperature[:-1])


@pytest.mark.parametrize("store", [ROS1, ROS2])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"compression": CompressionType.NONE},
        {"compression": CompressionType.LZ4},
        {"chunk_size": 2000},
        {"use_chunking": False},
        {"index_types": IndexType.NONE},
        {"repeat_channels": False, "repeat_schemas": False},
        {"use_statistics": False, "use_summary_offsets": False},
    ],
)
def test_an_mcap_reads_the_same_however_it_was_written(tmp_path, chunk, store, options):
    assert same(read(write_mcap(tmp_path / "log.mcap", {"/imu/data": chunk}, store, **options)), chunk)


def test_big_endian_cdr_reads_the_same(tmp_path, chunk):
    path = tmp_path / "log"
    with Writer2(path, version=9) as writer:
        connection = writer.add_connection("/imu/data", IMU, typestore=ROS2)
        for index, time in enumerate(chunk.time):
            data = ROS2.serialize_cdr(imu_message(ROS2, chunk, index), IMU, little_endian=False)
            writer.write(connection, round(time * 1e9), data)
    assert same(read(path), chunk)


def test_a_bag_without_an_imu_lists_its_topics(tmp_path):
    path = tmp_path / "log.bag"
    with Writer1(path) as writer:
        connection = writer.add_connection("/chatter", TEXT, typestore=ROS1)
        writer.write(connection, 1, ROS1.serialize_ros1(ROS1.types[TEXT]("hello"), TEXT))
    assert "/chatter (std_msgs/msg/String)" in refusal(path)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.99])
@pytest.mark.parametrize("way", ["ros1", "bare db3", "bare mcap"])
def test_a_bag_cut_short_is_said(tmp_path, chunk, way, share):
    path = WAYS[way](tmp_path, {"/imu/data": chunk})
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    assert_said_to_be_cut_short(path, chunk)


def test_message_without_imu_is_reported_with_its_number(tmp_path, chunk):
    path = tmp_path / "log.bag"
    with Writer1(path) as writer:
        connection = writer.add_connection("/imu", IMU, typestore=ROS1)
        for index, time in enumerate(chunk.time):
            data = ROS1.serialize_ros1(imu_message(ROS1, chunk, index), IMU)
            writer.write(connection, round(time * 1e9), data[:-8] if index == 40 else data)
    assert "message 41 of /imu" in refusal(path)


def test_a_triad_that_its_publisher_marks_as_absent_is_left_out(tmp_path, chunk):
    path = tmp_path / "log.bag"
    with Writer1(path) as writer:
        connection = writer.add_connection("/imu", IMU, typestore=ROS1)
        for index, time in enumerate(chunk.time):
            message = imu_message(ROS1, chunk, index)
            message.linear_acceleration_covariance[0] = -1.0
            message.orientation_covariance = np.zeros(9)
            message.angular_velocity_covariance = np.zeros(9)
            writer.write(connection, round(time * 1e9), ROS1.serialize_ros1(message, IMU))
    metadata = open_recording(path).metadata
    assert metadata.triads == ("gyroscope",)
    assert "accelerometer holds no number, and is left out as not recorded" in metadata.remarks


def test_a_bag_whose_publisher_sends_g_is_refused_with_the_remedy(tmp_path, chunk):
    chunk.accelerometer[:] /= 9.80665
    line = refusal(write_ros1(tmp_path / "log.bag", {"/imu": chunk}))
    assert "stated in m/s^2 (message definition)" in line
    assert "--accelerometer-unit g" in line
