"""Topics of ROS 2 over DDS: a publisher in another process, with types of its own."""

import itertools
import json
import os
import subprocess
import sys
import weakref
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

import ros2_publisher
from ros2_publisher import LOOPBACK
from tumble.foundation.errors import LogError
from tumble.live import open_source
from tumble.live.address import parse_address
from tumble.live.ros2_domain import Domain
from tumble.live.ros2_output import _message
from turntable_sessions import typed

pytestmark = pytest.mark.usefixtures("computer_clock")

SAMPLES, RATE = 300, 300.0
ENDLESS = 10**7
"""Samples of a publisher that sends for as long as anybody could listen: the first ones may be lost."""
MOST_SILENT = 200
"""Empty chunks in succession after which nothing comes any more."""


NUMBERS = itertools.count(os.getpid())


@pytest.fixture(autouse=True)
def domain(monkeypatch):
    """A domain of its own on the loopback: a publisher that was killed stays announced for seconds."""
    number = 1 + next(NUMBERS) % 200
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
    return number


@contextmanager
def publisher(topic, *, samples=SAMPLES, reliability="reliable", more=()):
    words = [ros2_publisher.__file__, topic, str(samples), str(RATE), reliability, *more]
    process = subprocess.Popen([sys.executable, *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        # A busy computer takes longer to start it than a source looks for topics.
        assert process.stdout.readline() == b"there\n"
        yield process
    finally:
        process.kill()
        process.communicate()


def heard(source, count, names=("time", "accelerometer", "gyroscope")):
    """Chunks of a source that is entered, until so many samples came, as arrays."""
    chunks, silent = [], 0
    for chunk in source:
        chunks.append(chunk)
        silent = 0 if len(chunk) else silent + 1
        if sum(map(len, chunks)) >= count or silent > MOST_SILENT:
            break
    return [np.concatenate([getattr(each, name) for each in chunks if len(each)]) for name in names]


def expected():
    messages = [ros2_publisher.message(number, RATE, False) for number in range(SAMPLES)]
    force, rate = (
        np.array([[value.x, value.y, value.z] for value in values])
        for values in zip(
            *((each.linear_acceleration, each.angular_velocity) for each in messages), strict=True
        )
    )
    return np.arange(SAMPLES) / RATE, force, rate


@pytest.mark.parametrize("reliability", ["reliable", "best-effort"])
def test_every_sample_of_a_topic_comes_as_it_was_sent(reliability):
    with publisher("/imu/data", reliability=reliability), open_source("ros2:///imu/data") as source:
        found = heard(source, SAMPLES)
        assert any(f"received {reliability}" in remark for remark in source.remarks)
        assert source.name == "imu-data"
    times, force, rate = expected()
    # Seconds since 1970 are known to 0.24 us in double precision.
    assert found[0] - found[0][0] == pytest.approx(times, abs=2.5e-7)
    assert np.array_equal(found[1], force)
    assert np.array_equal(found[2], rate)


def test_magnetometer_of_the_same_folder_comes_beside_its_imu():
    with publisher("/imu/data", more=["--field", "/imu/mag"]), open_source("ros2:///imu/data") as source:
        time_, field = heard(source, SAMPLES, ("time", "field"))
        assert any("topic /imu/mag is its magnetometer" in remark for remark in source.remarks)
    rows = np.isfinite(field[:, 2])
    numbers = np.rint((time_ - time_[0])[rows] * RATE)
    assert rows.sum() == pytest.approx(SAMPLES / 5, abs=2)
    # A sample may come before the reading of the same time.
    assert set(numbers - np.rint(field[rows, 2])) <= {0.0, 1.0}
    assert field[rows, 0] == pytest.approx(20.0)


def test_several_topics_are_recorded_at_once(tmp_path):
    with publisher("/left/imu", samples=ENDLESS), publisher("/right/imu", samples=ENDLESS):
        words = ("left=ros2:///left/imu", "right=ros2:///right/imu", "-o", tmp_path / "session")
        done = typed("record", *words, "--count", SAMPLES)
    assert done.code == 0, done.err
    for unit in ("left", "right"):
        assert f"{unit}: {SAMPLES} samples" in done.out


def test_topics_are_listed_with_what_they_offer_and_their_rates(domain):
    with (
        publisher("/left/imu", samples=ENDLESS),
        publisher("/right/imu", samples=ENDLESS, reliability="best-effort"),
    ):
        done = typed("record", "--list", "ros2://", "--json")
    assert done.code == 0, done.err
    left, right = json.loads(done.out)["topics"]
    assert (left["name"], left["type"], left["quality"]) == (
        *("/left/imu", "sensor_msgs/msg/Imu", "reliable, volatile"),
    )
    assert (right["quality"], right["source"]) == ("best-effort, volatile", "ros2:///right/imu")
    assert min(left["rate"], right["rate"]) > 0.0


def test_a_process_joins_a_domain_once(domain):
    address = parse_address("ros2:///imu/data")
    first = Domain.join(address)
    assert Domain.join(parse_address("ros2:///imu/raw")) is first
    assert Domain.join(parse_address(f"ros2:///imu?domain={(domain + 1) % 200}")) is not first
    before = weakref.ref(first)
    del first
    # A participant that nobody holds has left the domain.
    assert before() is None


def test_a_topic_without_angular_rate_is_refused():
    with (
        publisher("/imu/data", more=["--absent"]),
        open_source("ros2:///imu/data") as source,
        pytest.raises(LogError, match="gyroscope holds no number"),
    ):
        heard(source, SAMPLES)


def test_a_topic_that_nobody_sends_is_named_with_others(domain):
    with publisher("/imu/data"), pytest.raises(LogError) as raised, open_source("ros2:///imu/raw"):
        pass
    assert f"nobody sends /imu/raw in domain {domain}" in str(raised.value)
    assert "/imu/data (reliable)" in str(raised.value)


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("ros2:///imu?domain=300", "give a number from 0 to 232"),
        ("ros2:///imu?domain=x", "give a number from 0 to 232"),
        ("ros2:///imu?qos=loud", "give reliable or best-effort"),
        ("ros2:///imu?speed=1", "no setting 'speed'"),
        ("ros2:///imu?domain=0", "nobody sends a sensor_msgs/Imu in domain 0"),
    ],
)
def test_a_bad_address_is_one_line(address, said):
    with pytest.raises(LogError) as raised, open_source(address):
        pass
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


def test_messages_are_those_that_rosbags_reads():
    store = get_typestore(Stores.ROS2_HUMBLE)
    sent = _message(1.25, [0.1, -0.2, 9.8], [0.01, 0.02, -0.03])
    found = store.deserialize_cdr(sent.serialize(), "sensor_msgs/msg/Imu")
    assert (found.header.stamp.sec, found.header.stamp.nanosec) == (1, 250_000_000)
    assert (found.linear_acceleration.x, found.linear_acceleration.y, found.linear_acceleration.z) == (
        0.1,
        -0.2,
        9.8,
    )
    assert (found.angular_velocity.x, found.angular_velocity.z) == (0.01, -0.03)
    assert found.orientation_covariance[0] == -1.0


def test_corrected_samples_are_sent_on_another_topic(tmp_path):
    (tmp_path / "imu.yaml").write_text(
        "schema: tumble-calibration/3\nname: imu\naccelerometer:\n  unit: m/s^2\n"
        "  M: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n  b: [0.5, 0, 0]\n"
        "gyroscope:\n  unit: rad/s\n  M: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n  b: [0, 0, 0.25]\n"
        "magnetometer:\n  unit: uT\n  M: [[2, 0, 0], [0, 1, 0], [0, 0, 1]]\n  b: [4, 0, 0]\n"
    )
    words = ["apply", "--live", tmp_path / "imu.yaml", "ros2:///imu/data", "--to", "ros2:///imu/calibrated"]
    with publisher("/imu/data", samples=ENDLESS, more=["--field", "/imu/mag"]):
        program = Path(sys.executable).with_name("tumble")
        applied = subprocess.Popen(
            [program, *map(str, words)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        try:
            while True:
                try:
                    with open_source("ros2:///imu/calibrated") as source:
                        force, rate, field = heard(source, 100, ("accelerometer", "gyroscope", "field"))
                    break
                except LogError:
                    assert applied.poll() is None, applied.stderr.read()
        finally:
            applied.kill()
            applied.wait()
    assert force[:, 2] == pytest.approx(9.81)
    assert rate[:, 2] == pytest.approx(-0.55)
    assert field[np.isfinite(field[:, 0]), 0] == pytest.approx(8.0)
