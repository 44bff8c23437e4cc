"""`tumble convert`: the same samples in another format."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter

import tumble
from bag_fixtures import ROS2, messages, write_ros1
from log_fixtures import made_up, read, same, write, write_text
from tumble.foundation.errors import LogError, OutputError
from tumble.foundation.magnetic import MagneticTrack
from tumble.logs import list_imus
from turntable_sessions import one_line, typed

CHUNK = made_up(40_000)
"""More than a chunk."""
BARE = made_up(1500, temperature=False)
TIMED = made_up(4000, temperature=False)


def euroc(folder):
    """Time s, angular rate and specific force as they stand in a EuRoC table."""
    rows = np.loadtxt(folder / "data.csv", delimiter=",")
    return rows[:, 0] / 1e9, rows[:, 1:4], rows[:, 4:7]


def late_mcap(path, delays, chunk, topics=("/imu",)):
    """An MCAP file whose messages were recorded `delays` (n,) s after the time in their header."""
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        channels = {}
        for topic, kind, stamp, data in messages(ROS2, dict.fromkeys(topics, chunk)):
            if topic == "/chatter":
                continue
            if topic not in channels:
                text, _ = ROS2.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", text.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            index = round(stamp / 1e9 * 200.0)
            writer.add_message(channels[topic], stamp + round(1e9 * delays[index]), data, stamp)
        writer.finish()
    return path


@pytest.mark.parametrize("ending", ["csv", "parquet", "mcap"])
def test_converted_log_reads_back_exactly(tmp_path, ending):
    log = write(tmp_path / "log.parquet", CHUNK, serial="A7")
    done = typed("convert", log, "-o", tmp_path / f"new.{ending}")
    assert done.code == 0
    assert "40000 samples, 200 Hz" in done.out
    assert same(read(tmp_path / f"new.{ending}"), CHUNK)
    assert tumble.open_recording(tmp_path / f"new.{ending}").metadata.serial == "A7"


def test_euroc_has_its_columns_and_reports_losses(tmp_path):
    log = write(tmp_path / "log.parquet", CHUNK, serial="A7")
    done = typed("convert", log, "-o", tmp_path / "drive", "--format", "euroc")
    assert done.code == 0
    time, rate, force = euroc(tmp_path / "drive/mav0/imu0")
    assert np.array_equal(time, CHUNK.time)
    assert np.array_equal(rate, CHUNK.gyroscope)
    assert np.array_equal(force, CHUNK.accelerometer)
    assert "no place for its temperature and serial number" in done.err
    assert "rate_hz: 200\n" in (tmp_path / "drive/mav0/imu0/sensor.yaml").read_text()


def two_imus(path):
    write_ros1(path, {"/front/imu": BARE, "/rear/imu": replace(BARE, gyroscope=-BARE.gyroscope)})
    return path


def test_all_imus_of_a_log_go_into_one_mcap_file(tmp_path):
    log = two_imus(tmp_path / "log.bag")
    assert typed("convert", log, "-o", tmp_path / "new.mcap").code == 0
    assert list_imus(tmp_path / "new.mcap") == ("/front/imu", "/rear/imu")
    assert same(read(f"{tmp_path}/new.mcap:/front/imu"), BARE)
    assert np.array_equal(read(f"{tmp_path}/new.mcap:/rear/imu").gyroscope, -BARE.gyroscope)
    assert tumble.open_recording(f"{tmp_path}/new.mcap:/rear/imu").metadata.frame == "imu_link"


def test_table_output_has_a_file_an_imu_and_euroc_a_folder(tmp_path):
    log = two_imus(tmp_path / "log.bag")
    done = typed("convert", log, "-o", tmp_path / "new.csv", "--json")
    found = json.loads(done.out)
    assert [each["path"] for each in found["imus"]] == [
        str(tmp_path / f"new-{name}_imu.csv") for name in ("front", "rear")
    ]
    assert same(read(tmp_path / "new-front_imu.csv"), BARE)
    assert typed("convert", log, "-o", tmp_path / "new", "--format", "euroc").code == 0
    assert np.array_equal(euroc(tmp_path / "new/mav0/imu1")[1], -BARE.gyroscope)


def test_one_imu_of_several_can_be_named(tmp_path):
    log = two_imus(tmp_path / "log.bag")
    for number, words in enumerate([(f"{log}:/rear/imu",), (log, "--imu", "/rear/imu")]):
        output = tmp_path / f"{number}.csv"
        assert typed("convert", *words, "-o", output).code == 0
        assert np.array_equal(read(output).gyroscope, -BARE.gyroscope)
    with pytest.raises(LogError, match="no topic '/left'"):
        tumble.convert(log, tmp_path / "x.csv", imus=["/left"])


def test_skew_and_jitter_between_the_clocks_are_the_simulated_ones(tmp_path):
    seed = 4
    print(f"seed {seed}")
    random = np.random.default_rng(seed)
    delays = 0.003 + 80e-6 * TIMED.time + random.exponential(0.0005, len(TIMED))
    log = late_mcap(tmp_path / "log.mcap", delays, TIMED)
    arrival = tumble.convert(log, tmp_path / "new.parquet").imus[0].arrival
    assert abs(arrival.skew - 80e-6) < 1e-6
    assert abs(arrival.delay - 0.003) < 1e-4
    assert abs(arrival.jitter / 0.0005 - 1.0) < 0.1
    assert same(read(tmp_path / "new.parquet"), TIMED)


def test_the_time_of_recording_stays_that_of_each_message(tmp_path):
    delays = 0.002 + np.zeros(len(BARE))
    log = late_mcap(tmp_path / "log.mcap", delays, BARE, topics=("/front", "/rear"))
    tumble.convert(log, tmp_path / "new.mcap")
    with (tmp_path / "new.mcap").open("rb") as file:
        for _, _, message in make_reader(file).iter_messages():
            assert message.log_time - message.publish_time == 2_000_000


def test_a_log_with_one_time_has_no_skew(tmp_path):
    log = write(tmp_path / "log.csv", CHUNK)
    assert tumble.convert(log, tmp_path / "new.parquet").imus[0].arrival is None


def test_no_log_is_converted_onto_itself(tmp_path):
    log = write(tmp_path / "log.csv", CHUNK)
    before = log.read_bytes()
    (tmp_path / "link.csv").symlink_to(log)
    for name in ("log.csv", "link.csv"):
        done = typed("convert", log, "-o", tmp_path / name)
        assert done.code == 2
        assert "is what is read" in one_line(done.err)
    assert log.read_bytes() == before


def test_a_log_that_breaks_off_leaves_nothing_behind(tmp_path):
    log = write(tmp_path / "log.csv", CHUNK)
    log.write_text(log.read_text()[:-40] + "\n1.0,oops\n")
    for words in (("new.csv",), ("drive", "--format", "euroc"), ("new.mcap",)):
        done = typed("convert", log, "-o", tmp_path / words[0], *words[1:])
        assert done.code == 2
        one_line(done.err)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["log.csv"]


def test_a_format_that_nobody_writes_is_refused_with_those_that_are(tmp_path):
    log = write(tmp_path / "log.csv", CHUNK)
    with pytest.raises(OutputError, match="give --format with one of csv, parquet, mcap, euroc"):
        tumble.convert(log, tmp_path / "new.bag")
    assert typed("convert", log, "-o", tmp_path / "new").code == 2


def test_one_triad_alone_goes_where_messages_need_no_other(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("time,ax,ay,az\n" + "".join(f"{index / 100},0.1,0.2,9.8\n" for index in range(300)))
    assert typed("convert", log, "-o", tmp_path / "new.parquet").code == 0
    assert "holds accelerometer readings only" in typed("convert", log, "-o", tmp_path / "new.mcap").err


def test_assumed_unit_is_reported(tmp_path):
    log = write_text(tmp_path / "log.csv", made_up(10, temperature=False))
    assert "assumed to be in rad/s" in typed("convert", log, "-o", tmp_path / "new.mcap").err


@pytest.mark.parametrize("ending", ["csv", "parquet", "mcap"])
def test_magnetometer_keeps_its_readings_and_times(tmp_path, ending):
    time = BARE.time[0] + 0.003 + np.arange(250) / 37.0
    track = MagneticTrack(time, np.random.default_rng(5).normal(0.0, 30.0, (250, 3)))
    topics = {"/imu/data": BARE, "/second": BARE}
    path = write_ros1(tmp_path / "log.bag", topics, magnetic={"/imu/mag": track, "/second/mag": track})
    output = tmp_path / f"out.{ending}"
    done = tumble.convert(f"{path}:/imu/data", output)
    assert not any("magnetometer" in remark for each in done.imus for remark in each.remarks)
    found = tumble.open_recording(output).magnetic
    assert np.allclose(found.field, track.field, atol=1e-9)
    assert np.allclose(found.time, time, atol=2e-9, rtol=0.0)
    theirs = tumble.convert(path, tmp_path / "both.mcap")
    for imu in theirs.imus:
        both = tumble.open_recording(f"{tmp_path / 'both.mcap'}:{imu.name}").magnetic
        assert both.name == f"/{imu.name}/mag"
        assert np.allclose(both.field, track.field, atol=1e-9)
