"""Layouts of recordings of others: read, or refused with the first thing that failed."""

from __future__ import annotations

import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1

from bag_fixtures import IMU, ROS1, imu_message, write_ros2
from log_fixtures import made_up, read, refusal, same, write_text
from sqlite_journals import journal_that_names
from tumble.foundation.errors import OutputError
from tumble.logs import ReadOptions, bag_journal, open_recording

DEGREE = np.pi / 180.0


@pytest.fixture
def chunk():
    return made_up(400, rate=100.0, temperature=False)


def triad_file(path, time, values, time_last):
    columns = [values, time[:, None]] if time_last else [time[:, None], values]
    np.savetxt(path, np.hstack(columns), "%.17g", ",")
    return path


@pytest.mark.parametrize("time_last", [True, False])
@pytest.mark.parametrize("stated", [True, False])
def test_time_of_a_pair_is_the_column_that_increases_or_is_stated(tmp_path, chunk, time_last, stated):
    ticks = chunk.time * 1e9 + 8.9e15
    triad_file(tmp_path / "VID_accel.csv", ticks, chunk.accelerometer, time_last)
    path = triad_file(tmp_path / "VID_gyro.csv", ticks, chunk.gyroscope, time_last)
    axes = ("1", "2", "3") if time_last else ("2", "3", "4")
    columns = dict(zip(("gx", "gy", "gz"), axes, strict=True)) | {"time": "4" if time_last else "1"}
    found = read(path, ReadOptions(columns=columns if stated else {}, time_unit="ns"))
    assert np.array_equal(found.gyroscope, chunk.gyroscope)
    assert np.array_equal(found.accelerometer, chunk.accelerometer)
    assert np.allclose(np.diff(found.time), 0.01, atol=1e-6)


def test_a_pair_whose_stated_time_is_none_of_its_columns_is_refused(tmp_path, chunk):
    triad_file(tmp_path / "a_acc.csv", chunk.time, chunk.accelerometer, False)
    path = triad_file(tmp_path / "a_gyro.csv", chunk.time, chunk.gyroscope, False)
    assert "no column 'stamp' for time" in refusal(path, ReadOptions(columns={"time": "stamp"}))


@pytest.mark.parametrize(
    ("head", "remedy"),
    [
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345\n", "git lfs pull"),
        (
            b"H Product:Blackbox flight data recorder\nH Field I name:loopIteration,time,accSmooth[0]\n",
            "decode",
        ),
    ],
)
def test_what_stands_for_a_log_is_named_with_the_way_to_it(tmp_path, head, remedy):
    path = tmp_path / "imu.csv"
    path.write_bytes(head)
    assert remedy in refusal(path)


def test_rows_without_names_may_end_in_a_delimiter(tmp_path, chunk):
    path = write_text(tmp_path / "log.txt", chunk, header=None, delimiter="\t")
    path.write_text("".join(f"{row}\t\n" for row in path.read_text().splitlines()))
    assert same(read(path), chunk)


NAMES = {
    "WitMotion": "time,AccX(g),AccY(g),AccZ(g),AsX(°/s),AsY(°/s),AsZ(°/s)",
    "WitMotion, Chinese": "时间,加速度X(g),加速度Y(g),加速度Z(g),角速度X(°/s),角速度Y(°/s),角速度Z(°/s)",
    "phyphox, German": (
        "Zeit (s),Beschleunigung x (g),Beschleunigung y (g),Beschleunigung z (g),"
        "Winkelgeschwindigkeit x (°/s),Winkelgeschwindigkeit y (°/s),Winkelgeschwindigkeit z (°/s)"
    ),
    "phyphox, Spanish": (
        "Tiempo (s),Aceleración x (g),Aceleración y (g),Aceleración z (g),"
        "Giroscopio x (°/s),Giroscopio y (°/s),Giroscopio z (°/s)"
    ),
    "Japanese": "時間,加速度X(g),加速度Y(g),加速度Z(g),角速度X(°/s),角速度Y(°/s),角速度Z(°/s)",
}


@pytest.mark.parametrize("language", NAMES)
@pytest.mark.parametrize("stated", [True, False])
def test_names_of_other_languages_keep_their_units(tmp_path, chunk, language, stated):
    names = NAMES[language].split(",")
    path = write_text(
        tmp_path / "log.csv", chunk, header=NAMES[language], scale=(1.0, 1.0 / 9.80665, 1.0 / DEGREE)
    )
    columns = dict(zip(("time", "ax", "ay", "az", "gx", "gy", "gz"), names, strict=True)) if stated else {}
    recording = open_recording(path, ReadOptions(columns=columns))
    assert recording.metadata.gyroscope_unit.name == "deg/s"
    assert recording.metadata.accelerometer_unit.reason == "column name"
    assert np.allclose(read(path, ReadOptions(columns=columns)).gyroscope, chunk.gyroscope)


@pytest.mark.parametrize("name", ["Lineare Beschleunigung", "Aceleración lineal", "线性加速度"])
def test_acceleration_without_gravity_is_known_in_other_languages(tmp_path, chunk, name):
    header = f"time,{name} x,{name} y,{name} z,q,r,s"
    assert "acceleration without gravity" in refusal(write_text(tmp_path / "log.csv", chunk, header=header))


def test_columns_that_no_name_explains_are_listed_with_the_option(tmp_path, chunk):
    path = write_text(tmp_path / "log.csv", chunk, header="time_s,ax,ay,az,drift_x,drift_y,drift_z")
    metadata = open_recording(path).metadata
    assert metadata.triads == ("accelerometer",)
    assert metadata.unread == ("drift_x", "drift_y", "drift_z")


@pytest.mark.parametrize("names", ["Timestamp,X,Y,Z", "1,2,3"])
def test_three_columns_of_an_unknown_quantity_are_offered_as_a_triad(tmp_path, names):
    rows = "\n".join("0.1,0.2,9.8" if names == "1,2,3" else f"{k / 50},0.1,0.2,9.8" for k in range(100))
    path = tmp_path / "log.csv"
    path.write_text(rows if names == "1,2,3" else f"{names}\n{rows}\n")
    first, second, third = names.split(",")[-3:]
    assert f"--columns ax={first},ay={second},az={third}" in refusal(path, ReadOptions(rate=50.0))


def left_in_journal(tmp_path, chunk):
    """A database of a bag whose samples stand in the journal beside it."""
    database = next(write_ros2(tmp_path / "bag", {"/imu": chunk}).glob("*.db3"))
    left = tmp_path / "left" / database.name
    left.parent.mkdir()
    connection = sqlite3.connect(database)
    connection.execute("PRAGMA journal_mode=WAL")
    connection.execute("CREATE TABLE kept AS SELECT * FROM messages")
    connection.execute("DELETE FROM messages")
    connection.commit()
    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.execute("PRAGMA wal_autocheckpoint=0")
    connection.execute("INSERT INTO messages SELECT * FROM kept")
    connection.execute("DROP TABLE kept")
    connection.commit()
    for ending in ("", "-wal"):
        shutil.copyfile(f"{database}{ending}", f"{left}{ending}")
    connection.close()
    return left


def test_a_bag_left_in_its_journal_is_read_with_it(tmp_path, chunk):
    left = left_in_journal(tmp_path, chunk)
    before = left.read_bytes()
    recording = open_recording(left)
    assert same(read(left), chunk)
    assert any("was not closed" in remark for remark in recording.metadata.remarks)
    assert left.read_bytes() == before


def test_a_journal_by_which_files_are_removed_is_left(tmp_path, chunk, monkeypatch):
    copied = []
    joined = bag_journal.copied_aside
    monkeypatch.setattr(
        bag_journal, "copied_aside", lambda parts, name: copied.extend(parts) or joined(parts, name)
    )
    left = left_in_journal(tmp_path, chunk)
    shutil.copyfile(tmp_path / "bag" / "metadata.yaml", left.with_name("metadata.yaml"))
    left.with_name(f"{left.name}-journal").write_bytes(journal_that_names(tmp_path / "thesis.txt", left))
    left.with_name("others.bin").write_bytes(b"x")
    left.with_name("others.db3-wal").write_bytes(b"x")
    assert same(read(left.parent), chunk)
    assert {part.name for part in copied} == {left.name, f"{left.name}-wal", "metadata.yaml"}


def test_a_copy_takes_half_of_what_is_free_at_most(tmp_path, chunk, monkeypatch):
    left = left_in_journal(tmp_path, chunk)
    copies = set(Path(tempfile.gettempdir()).glob("tumble-*"))
    size = left.stat().st_size + left.with_name(f"{left.name}-wal").stat().st_size
    usage = type(shutil.disk_usage(tmp_path))
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(4 * size, 0, 2 * size - 1))
    with pytest.raises(OutputError, match=r"are free for copies; name a folder with room by TMPDIR$"):
        open_recording(left)
    assert set(Path(tempfile.gettempdir()).glob("tumble-*")) <= copies
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(4 * size, 0, 2 * size))
    assert same(read(left), chunk)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_removes_copies_before_the_end(tmp_path, number):
    (tmp_path / "part").write_text("x")
    program = (
        "import os, sys\nfrom pathlib import Path\n"
        "from tumble.foundation.temporary_folders import copied_aside\n"
        "kept = copied_aside([Path(sys.argv[1])], 'bag')\n"
        "print(os.listdir(os.path.join(kept.name, 'bag')), flush=True)\n"
        "os.kill(os.getpid(), int(sys.argv[2]))\n"
    )
    folder = tmp_path / "copies"
    folder.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", program, tmp_path / "part", str(int(number))],
        env={**os.environ, "TMPDIR": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (-number, "['part']\n"), done.stderr
    assert list(folder.iterdir()) == []


def test_samples_that_no_driver_stamped_are_left_out_and_counted(tmp_path):
    chunk = made_up(400, rate=100.0, start=1.7e9, temperature=False)
    path = tmp_path / "log.bag"
    with Writer1(path) as writer:
        connection = writer.add_connection("/imu", IMU, typestore=ROS1)
        for index, time in enumerate(chunk.time):
            message = imu_message(ROS1, chunk, index, stamped=index >= 30)
            writer.write(connection, round(time * 1e9), ROS1.serialize_ros1(message, IMU))
    recording = open_recording(path)
    stream = recording.chunks()
    assert np.concatenate([each.time for each in stream]).min() > 1e9
    assert "left out 30 samples with the stamp 0, which no driver had set" in stream.counts.notices()


def test_counts_of_all_poses_together_show_a_large_bias(tmp_path):
    random = np.random.default_rng(4)
    bias = np.array([-0.05, -0.9, -0.83])
    folder = tmp_path / "poses"
    folder.mkdir()
    for axis, name in enumerate("xyz"):
        for sign, way in ((1.0, "up"), (-1.0, "down")):
            force = (sign * np.eye(3)[axis] + bias) * 16384.0 + random.normal(0.0, 30.0, (300, 3))
            rows = np.column_stack([np.arange(300) / 100.0, force, random.normal(0.0, 5.0, (300, 3))])
            header = "time_s,ax,ay,az,gx,gy,gz"
            np.savetxt(folder / f"{name}_{way}.csv", rows, "%.6f", ",", header=header, comments="")
    units = {"accelerometer_unit": "g", "gyroscope_unit": "deg/s", "gyroscope_scale": 131.0}
    recording = open_recording(folder, ReadOptions(accelerometer_scale=16384.0, **units))
    assert len(recording.parts) == 6
    assert "with the scale given" in refusal(folder, ReadOptions(accelerometer_scale=8192.0, **units))
