"""A folder with one log a pose or with one log in several files, and the two files of imu_tk."""

from __future__ import annotations

import numpy as np
import pytest

from bag_fixtures import write_ros1
from log_fixtures import join, made_up, read, refusal, same, write, write_text
from tumble.foundation.recording import Chunk
from tumble.logs import ReadOptions, list_imus, open_recording

POSES = ["1_x_up", "2_x_down", "3_y_up"]


@pytest.fixture
def folder(tmp_path):
    for number, name in enumerate(POSES):
        write(tmp_path / f"{name}.csv", made_up(500, seed=number))
    return tmp_path


def test_each_file_of_a_folder_is_a_part_in_the_order_of_names(folder):
    recording = open_recording(folder)
    assert [part.name for part in recording.parts] == POSES
    for number, part in enumerate(recording.parts):
        assert same(join(list(part.chunks())), made_up(500, seed=number))


def test_the_whole_of_a_folder_is_its_parts_one_after_another(folder):
    whole = read(folder)
    assert bool((np.diff(whole.time) > 0.0).all())
    assert np.array_equal(
        whole.accelerometer, np.vstack([made_up(500, seed=number).accelerometer for number in range(3)])
    )


def test_parts_of_one_long_clock_keep_their_times(tmp_path):
    for number, name in enumerate(POSES):
        write(tmp_path / f"{name}.parquet", made_up(100, start=50.0 * number))
    starts = [50.0 * number for number in range(3)]
    assert np.array_equal(read(tmp_path).time[::100], starts)


def test_a_folder_says_what_it_passed_over(folder):
    (folder / "README.md").write_text("poses")
    remarks = open_recording(folder).metadata.remarks
    assert remarks == ("3 files, read one after another", "left out README.md")


def test_one_bad_part_is_named(folder):
    (folder / "2_x_down.csv").write_text("")
    assert str(folder / "2_x_down.csv") in refusal(folder)


def test_an_imu_of_every_part_can_be_named(tmp_path):
    for name in POSES:
        rows = "\n".join(f"{0.01 * i},0,0,9.8,0,0,0,0,9.8,0,0,0,0" for i in range(100))
        names = [f"imu{i}_{c}" for i in (1, 2) for c in ("ax", "ay", "az", "gx", "gy", "gz")]
        (tmp_path / f"{name}.csv").write_text(",".join(["time", *names]) + f"\n{rows}\n")
    assert list_imus(tmp_path) == ("imu1", "imu2")
    assert np.array_equal(read(f"{tmp_path}:imu2").accelerometer[0], [0.0, 9.8, 0.0])


def test_gyroscope_unit_found_in_one_part_holds_for_all(tmp_path):
    slow, fast = made_up(500, temperature=False), made_up(500, temperature=False)
    slow.gyroscope[250:, 2] -= 1.0
    for name, chunk in (("1", slow), ("2", fast)):
        in_degrees = Chunk(chunk.time, chunk.accelerometer, np.rad2deg(chunk.gyroscope))
        write_text(tmp_path / f"{name}.csv", in_degrees)
    assert [part.metadata.gyroscope_unit.name for part in open_recording(tmp_path).parts] == ["deg/s"] * 2


def cut(chunk, edges):
    """Chunks of a log between the numbers of samples."""
    spans = zip([0, *edges], [*edges, len(chunk)], strict=True)
    return [Chunk(chunk.time[a:b], chunk.accelerometer[a:b], chunk.gyroscope[a:b]) for a, b in spans if a < b]


def split_bags(folder, pieces):
    for number, piece in enumerate(pieces):
        write_ros1(folder / f"session_{number}.bag", {"/imu/data": piece})


def split_tables(folder, pieces):
    for number, piece in enumerate(pieces):
        write_text(folder / f"log_{number}.csv", piece)


def split_logs(folder, pieces):
    for number, piece in enumerate(pieces):
        write(folder / f"log_{number}.mcap", piece)


@pytest.mark.parametrize("split", [split_bags, split_tables, split_logs])
@pytest.mark.parametrize("lost", [0, 5])
def test_files_whose_stamps_follow_on_are_one_log(tmp_path, split, lost):
    """Names sort file 10 before file 2, and a recorder may lose samples while it opens a file."""
    whole = made_up(1200, rate=100.0, start=1.7e9, temperature=False)
    pieces = cut(whole, range(100, 1200, 100))
    kept = [Chunk(each.time[lost:], each.accelerometer[lost:], each.gyroscope[lost:]) for each in pieces]
    split(tmp_path, kept)
    recording = open_recording(tmp_path)
    assert not recording.parts
    assert recording.metadata.remarks[0] == (
        "12 files, read as one log: the stamps of each follow on those of the one before"
    )
    assert np.allclose(read(tmp_path).time, np.concatenate([each.time for each in kept]), rtol=0.0, atol=1e-6)
    assert np.allclose(read(tmp_path).gyroscope, np.concatenate([each.gyroscope for each in kept]))


@pytest.mark.parametrize("pause", [0.15, 1.0, 60.0])
def test_files_with_pauses_between_them_are_parts(tmp_path, pause):
    pieces = [made_up(100, rate=100.0, start=number * (0.99 + pause)) for number in range(3)]
    for number, piece in enumerate(pieces):
        write(tmp_path / f"{number}.parquet", piece)
    recording = open_recording(tmp_path)
    assert [part.name for part in recording.parts] == ["0", "1", "2"]
    assert recording.metadata.remarks == ("3 files, read one after another",)


def test_files_of_a_log_without_one_of_them_are_two_logs(tmp_path):
    whole = made_up(600, rate=100.0, temperature=False)
    pieces = cut(whole, range(100, 600, 100))
    split_tables(tmp_path, pieces)
    (tmp_path / "log_2.csv").unlink()
    recording = open_recording(tmp_path)
    assert [len(join(list(part.chunks()))) for part in recording.parts] == [200, 300]
    assert recording.metadata.remarks[0] == (
        "5 files, read as 2 logs one after another: stamps follow on from file to file within each"
    )


def test_a_file_that_follows_on_two_is_joined_to_none(tmp_path):
    first, second = cut(made_up(200, rate=100.0, temperature=False), [100])
    other = Chunk(first.time + 0.003, first.accelerometer + 0.01, first.gyroscope)
    for name, chunk in (("a", first), ("b", other), ("c", second)):
        write_text(tmp_path / f"{name}.csv", chunk)
    assert len(open_recording(tmp_path).parts) == 3


def write_pair(folder, chunk, gyroscope_rows=None, shift=0.0):
    for name, triad, offset in (("acc", chunk.accelerometer, 0.0), ("gyro", chunk.gyroscope, shift)):
        rows = np.column_stack([chunk.time + offset, triad])
        text = ["   ".join(f"{value!r}" for value in map(float, row)) for row in rows]
        kept = text if name == "acc" else text[:gyroscope_rows]
        (folder / f"unit_{name}.mat").write_text("   " + "\n   ".join(kept) + "\n")
    return folder


def test_the_two_files_of_imu_tk_are_one_recording(tmp_path):
    chunk = made_up(150_000, temperature=False)
    folder = write_pair(tmp_path, chunk)
    for path in (folder, folder / "unit_acc.mat", folder / "unit_gyro.mat"):
        assert open_recording(path).metadata.format == "imu_tk"
        assert same(read(path), chunk), path


def test_the_two_files_of_imu_tk_need_the_same_rows(tmp_path):
    line = refusal(write_pair(tmp_path, made_up(300, temperature=False), gyroscope_rows=290))
    assert "unit_gyro.mat: ends 10 rows before unit_acc.mat" in line


def test_the_two_files_of_imu_tk_need_the_same_times(tmp_path):
    line = refusal(write_pair(tmp_path, made_up(300, temperature=False), shift=0.001))
    assert "line 1" in line
    assert "both files need the same times" in line


def test_a_rate_can_replace_the_times_of_imu_tk(tmp_path):
    write_pair(tmp_path, made_up(300, temperature=False))
    assert np.array_equal(read(tmp_path, ReadOptions(rate=100.0)).time, np.arange(300) / 100.0)


@pytest.mark.parametrize("shift", [-0.0021, 0.0, 0.0013])
def test_accelerometer_follows_the_times_of_the_gyroscope_if_separate(tmp_path, shift):
    chunk = made_up(70_000, temperature=False)
    straight = 0.01 * chunk.time[:, None] + [0.1, 0.2, 9.7]
    write_pair(tmp_path, Chunk(chunk.time, straight, chunk.gyroscope), shift=shift)
    recording = open_recording(tmp_path, ReadOptions(interpolate=True))
    found = join(list(recording.chunks()))
    inside = (chunk.time + shift >= 0.0) & (chunk.time + shift <= chunk.time[-1])
    assert np.array_equal(found.time, (chunk.time + shift)[inside])
    assert np.array_equal(found.gyroscope, chunk.gyroscope[inside])
    assert np.allclose(found.accelerometer, straight[inside] + 0.01 * shift, rtol=0.0, atol=1e-12)
    assert any("by straight lines" in remark for remark in recording.metadata.remarks)


def test_interpolating_files_without_a_time_in_common_is_refused(tmp_path):
    write_pair(tmp_path, made_up(300, temperature=False), shift=100.0)
    assert "no time in common" in refusal(tmp_path, ReadOptions(interpolate=True))
