"""Topics of Foxglove's protocol and of Zenoh, sent by another process, and lists of what is sent."""

import json
import math
import os
import subprocess
import sys
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest

import foxglove_publisher
import ros2_publisher
import zenoh_publisher
from ports import free_port
from tumble.foundation.errors import LogError
from tumble.live import foxglove, open_source
from tumble.live.address import Address
from tumble.live.rate_watch import RateWatch
from tumble.live.ros2_zenoh import ZenohSender, sender_of
from tumble.logs.options import ReadOptions
from turntable_sessions import one_line, typed

pytestmark = pytest.mark.usefixtures("computer_clock")

RATE = 200.0
DOMAIN = "7"


@contextmanager
def running(program, *words):
    """Another process, once it has printed a line."""
    environment = {**os.environ, "ROS_DOMAIN_ID": DOMAIN}
    process = subprocess.Popen(
        [sys.executable, program.__file__, *map(str, words)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=environment,
    )
    try:
        assert process.stdout.readline()
        yield
    finally:
        process.kill()
        process.communicate()


@pytest.fixture(scope="module")
def server():
    port = free_port()
    with running(foxglove_publisher, port, RATE):
        yield f"foxglove://127.0.0.1:{port}"


@pytest.fixture(scope="module")
def routing():
    end_point = f"tcp/127.0.0.1:{free_port()}"
    with running(zenoh_publisher, end_point, "--router"):
        yield end_point


@pytest.fixture
def router(routing, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", DOMAIN)
    return routing


def heard(source, count=100):
    chunks = []
    for chunk in source:
        chunks.append(chunk)
        if sum(map(len, chunks)) >= count:
            break
    return [
        np.concatenate([getattr(each, name) for each in chunks if len(each)])
        for name in ("time", "accelerometer", "gyroscope")
    ]


def check(time, force, rate):
    """Samples are those of the publisher, none left out: the number of each is in two of its channels."""
    numbers = np.rint(1e3 * force[:, 1]).astype(int)
    assert np.array_equal(np.diff(numbers), np.ones(len(numbers) - 1))
    messages = [ros2_publisher.message(number, RATE, False) for number in numbers.tolist()]
    for found, name in ((force, "linear_acceleration"), (rate, "angular_velocity")):
        sent = [getattr(each, name) for each in messages]
        assert found == pytest.approx(np.array([[each.x, each.y, each.z] for each in sent]), abs=1e-12)
    assert time - time[0] == pytest.approx((numbers - numbers[0]) / RATE, abs=2e-6)


@pytest.mark.parametrize("topic", ["imu/data", "ros1", "json", "packed"])
def test_a_topic_of_foxglove_comes_as_it_was_sent(server, topic):
    options = ReadOptions(accelerometer_unit="m/s^2", gyroscope_unit="rad/s")
    with open_source(f"{server}/{topic}", options) as source:
        check(*heard(source))
        assert not any("lost" in remark for remark in source.remarks)


def test_a_server_that_ends_is_one_line():
    port = free_port()
    serving = running(foxglove_publisher, port, RATE)
    serving.__enter__()
    with open_source(f"foxglove://127.0.0.1:{port}/imu/data") as source:
        heard(source, 10)
        serving.__exit__(None, None, None)
        with pytest.raises(LogError) as raised:
            heard(source, 1_000_000)
    assert "the server has closed the connection; is it running?" in str(raised.value)


def test_topics_of_foxglove_are_listed_with_their_rates(server):
    done = typed("record", "--list", server, "--json")
    assert done.code == 0, done.err
    found = {each["name"]: each for each in json.loads(done.out)["topics"]}
    # A busy computer sends fewer, or some of them late.
    assert found["/imu/data"]["rate"] > 0.0
    assert found["/imu/data"]["source"] == f"{server}/imu/data"
    assert found["/scene"]["source"] == ""
    assert found["/packed"]["type"] == "board.Imu (protobuf)"


def test_rate_is_that_of_arrivals_after_the_first():
    watch = RateWatch()
    assert watch.rate(5.0) == 0.0
    # Those that waited come with the first.
    for count, now in [(0, 9.0), (30, 10.0), *((2, 10.0 + 0.01 * k) for k in range(1, 101))]:
        watch.push(count, now)
    assert watch.rate(11.0) == pytest.approx(200.0)
    assert watch.rate(12.0) == pytest.approx(100.0)


def test_a_topic_of_zenoh_comes_as_it_was_sent(router):
    with (
        running(zenoh_publisher, router, "/imu/data", RATE),
        open_source(f"ros2+zenoh:///imu/data?router={router}") as source,
    ):
        check(*heard(source))


def test_magnetometer_of_zenoh_comes_beside_its_imu(router):
    with (
        running(zenoh_publisher, router, "/imu/data", RATE, "--field", "/imu/mag"),
        open_source(f"ros2+zenoh:///imu/data?router={router}&magnetometer=/imu/mag") as source,
    ):
        chunks = []
        for chunk in source:
            chunks += [chunk] if len(chunk) else []
            if sum(map(len, chunks)) >= 50:
                break
    field = np.concatenate([chunk.field for chunk in chunks])
    rows = np.isfinite(field[:, 2])
    assert rows.mean() == pytest.approx(0.2, abs=0.05)
    # A reading is its number along z, in microtesla; every fifth sample has one.
    assert set(np.diff(np.rint(field[rows, 2]))) == {5.0}
    assert field[rows, 0] == pytest.approx(20.0)


def test_messages_without_a_token_are_received(router):
    with (
        running(zenoh_publisher, router, "/imu/data", RATE, "--silent"),
        open_source(f"ros2+zenoh:///imu/data?router={router}") as source,
    ):
        check(*heard(source, 10))


def test_topics_of_zenoh_are_listed_and_others_refused(router):
    with running(zenoh_publisher, router, "/imu/data", RATE):
        done = typed("record", "--list", f"ros2+zenoh://?router={router}", "--json")
        (found,) = json.loads(done.out)["topics"]
        assert (found["name"], found["type"]) == ("/imu/data", "sensor_msgs/msg/Imu")
        assert found["quality"] == "best-effort, volatile"
        assert found["rate"] > 0.0
        with pytest.raises(LogError) as raised, open_source(f"ros2+zenoh:///imu/raw?router={router}"):
            pass
    assert "nobody sends /imu/raw in domain 7 over Zenoh" in str(raised.value)
    assert "/imu/data (best-effort, volatile)" in str(raised.value)


def test_tokens_of_senders_are_read_and_others_passed_over():
    place = "@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/10/MP/%/%/talker"
    topic = "%chatter/std_msgs::msg::dds_::String_/RIHS01_df668c"
    assert sender_of(f"{place}/{topic}/::,7:,:,:,,") == ZenohSender(
        "/chatter", "std_msgs::msg::dds_::String_", "reliable, volatile"
    )
    assert sender_of(place) is None
    assert sender_of(f"{place}/{topic}/::,7:,:,:,,".replace("/MP/", "/MS/")) is None
    assert sender_of(f"{place}/{topic}/x:1") == ZenohSender(
        "/chatter", "std_msgs::msg::dds_::String_", "?, transient local"
    )


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("foxglove://127.0.0.1:1/imu", "no server of Foxglove's protocol answers"),
        ("foxglove://127.0.0.1/imu", "expected HOST:PORT"),
        ("foxglove://127.0.0.1:8765", "names no topic"),
        ("{server}/imu/raw", "nobody sends /imu/raw there; topics: /imu/data (sensor_msgs/msg/Imu)"),
        ("{server}/scene", "foxglove.SceneUpdate is read where it holds one IMU"),
        ("ros2+zenoh:///imu?domain=300", "give a number from 0 to 232"),
        ("ros2+zenoh:///imu?speed=1", "no setting 'speed'"),
    ],
)
def test_a_bad_address_of_a_topic_is_one_line(server, address, said):
    with pytest.raises(LogError) as raised, open_source(address.format(server=server)) as source:
        heard(source)
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


def test_an_address_without_topics_is_one_line():
    done = typed("record", "--list", "udp://:9000")
    assert done.code == 2
    assert "has no topics; give one of ros2://, ros2+zenoh://, foxglove://" in one_line(done.err)


def test_what_is_no_advertisement_or_message_is_passed_over():
    stated = {"id": 3, "topic": "/imu", "encoding": "cdr", "schemaName": "sensor_msgs/msg/Imu", "schema": ""}
    assert foxglove._channel(stated).topic == "/imu"
    packed = {**stated, "encoding": "protobuf", "schemaEncoding": "protobuf"}
    numbers = [{**stated, "id": number} for number in ("x", math.inf, math.nan)]
    wrong = [None, 7, "imu", {}, *numbers, {**stated, "schema": 3}, {**packed, "schema": "###"}]
    assert [foxglove._channel(each) for each in wrong] == [None] * len(wrong)
    assert [foxglove._json(text) for text in ("", "[1]", "{", "[" * 100_000)] == [{}] * 4
    assert [foxglove._payload(message) for message in (b"", b"\1" * 12, b"\2" * 20)] == [None] * 3
    assert foxglove._payload(b"\1\5\0\0\0" + bytes(8) + b"data") == (5, b"data")


def test_a_server_that_advertises_without_end_is_one_line():
    stated = {"id": 3, "topic": "/imu", "encoding": "cdr", "schemaName": "sensor_msgs/msg/Imu", "schema": ""}
    text = json.dumps({"op": "advertise", "channels": [stated] * 1000})
    with pytest.raises(LogError, match="more than 4096 topics"):
        list(foxglove._advertised(SimpleNamespace(recv=lambda _: text), Address("x", "foxglove", "x:1")))
