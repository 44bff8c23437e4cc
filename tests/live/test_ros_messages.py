"""Messages of ROS as other programs print and send them: `ros2 topic echo`, `rostopic echo`, JSON bridges."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from live_fixtures import Scripted, first_samples, piped
from tumble.live import open_source
from tumble.live.address import parse_address
from tumble.live.ros_echo import EchoedMessages
from tumble.live.text import TextLine
from tumble.logs.options import ReadOptions

SECONDS = 1_700_000_000
COUNT = 60

# Output of `ros2 topic echo /imu` of ROS 2 Humble for sensor_msgs/Imu (rosidl_runtime_py, message_to_yaml).
ROS_2 = """\
header:
  stamp:
    sec: {sec}
    nanosec: {nanosec}
  frame_id: imu_link
orientation:
  x: 0.0
  y: 0.0
  z: 0.0
  w: 1.0
orientation_covariance:
- -1.0
{eight}angular_velocity:
  x: {gx!r}
  y: {gy!r}
  z: {gz!r}
angular_velocity_covariance:
- 0.0
{eight}linear_acceleration:
  x: {ax!r}
  y: {ay!r}
  z: {az!r}
linear_acceleration_covariance:
- 0.0
{eight}---
"""
# Output of `rostopic echo /imu` of ROS 1 Noetic (genpy, strify_message).
ROS_1 = """\
header: 
  seq: {number}
  stamp: 
    secs: {sec}
    nsecs: {nanosec:9d}
  frame_id: "imu_link"
orientation: 
  x: 0.0
  y: 0.0
  z: 0.0
  w: 1.0
orientation_covariance: [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
angular_velocity: 
  x: {gx!r}
  y: {gy!r}
  z: {gz!r}
angular_velocity_covariance: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
linear_acceleration: 
  x: {ax!r}
  y: {ay!r}
  z: {az!r}
linear_acceleration_covariance: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
---
"""  # noqa: W291 - blanks behind names are as printed


def table():
    """Samples (n, 7): s, m/s^2, rad/s."""
    rng = np.random.default_rng(8)
    time = np.arange(COUNT) / 100.0
    force = [0.1, -0.2, 9.8] + 0.02 * rng.standard_normal((COUNT, 3))
    return np.column_stack([time, force, 0.01 * rng.standard_normal((COUNT, 3))])


def printed(form):
    """The table as a terminal shows it."""
    names = ("ax", "ay", "az", "gx", "gy", "gz")
    return "".join(
        form.format(
            number=number,
            sec=SECONDS + round(100.0 * row[0]) // 100,
            nanosec=10_000_000 * (round(100.0 * row[0]) % 100),
            eight="- 0.0\n" * 8,
            **dict(zip(names, row[1:].tolist(), strict=True)),
        )
        for number, row in enumerate(table())
    ).encode()


def message(row):
    """The message as an object; integers of its stamp as ROS 2 has them."""
    xyz = [dict(zip("xyz", part.tolist(), strict=True)) for part in (row[1:4], row[4:7])]
    stamp = {"sec": SECONDS, "nanosec": round(1e9 * row[0])}
    return {
        "header": {"stamp": stamp, "frame_id": "imu_link"},
        "linear_acceleration": xyz[0],
        "angular_velocity": xyz[1],
        "angular_velocity_covariance": [0.0] * 9,
    }


def check(source, samples):
    assert np.allclose(samples[:, 0] - SECONDS, table()[:, 0], atol=1e-6)
    assert np.array_equal(samples[:, 1:], table()[:, 1:])
    # The definition of the message states the units.
    assert not source.gyroscope_unit_is_assumed
    assert source.stamped


@pytest.mark.parametrize("form", [ROS_2, ROS_1])
def test_echoed_messages_come_over_standard_input(monkeypatch, form):
    with piped(monkeypatch, printed(form)), open_source("stdin:") as source:
        check(source, first_samples(source, COUNT))


@pytest.mark.parametrize("wrapped", [False, True])
def test_json_with_a_header_stamp_is_read(wrapped):
    rows = [message(row) for row in table()]
    # Form in which rosbridge_suite publishes.
    objects = [{"op": "publish", "topic": "/imu", "msg": row} if wrapped else row for row in rows]
    address = parse_address("udp://:9000")
    pieces = [json.dumps(each).encode() for each in objects]
    source = TextLine(address, ReadOptions(), Scripted(pieces, whole=True), "udp").unit(
        address, ReadOptions()
    )
    source.line.units.append(source)
    check(source, first_samples(source, COUNT))


def test_a_message_joined_midway_or_torn_costs_itself_only(monkeypatch):
    lines = printed(ROS_2).splitlines(keepends=True)
    per_message = len(lines) // COUNT
    # Five lines of the first are gone, and ten of the eleventh.
    torn = (
        lines[5 : 10 * per_message]
        + lines[10 * per_message : 11 * per_message - 10]
        + lines[11 * per_message :]
    )
    with piped(monkeypatch, b"".join(torn)), open_source("stdin:") as source:
        samples = first_samples(source, COUNT - 2)
    kept = np.delete(table(), [0, 10], axis=0)
    assert np.allclose(samples[:, 0] - SECONDS, kept[:, 0], atol=1e-6)


@given(
    st.lists(st.sampled_from([b"header:", b"---", b"  stamp:", b"1,2,3", b"&a [*a, *a]", b"\xff", b"x: {"]))
)
def test_any_lines_go_through_without_an_error_and_end(lines):
    gathered = EchoedMessages()
    assert len(list(gathered.gather(lines))) <= len(lines)


def test_lines_that_are_no_messages_pass_unchanged():
    lines = [b"time,ax,ay", b"---", b"  1,2,3", b"end:"]
    assert list(EchoedMessages().gather(lines)) == lines
