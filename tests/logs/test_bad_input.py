"""Logs that are broken, or no logs: one line each, with the fault, its place and the remedy."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pyarrow import feather

from log_fixtures import assert_said_to_be_cut_short, made_up, read, refusal, same, write, write_text
from tumble.foundation.recording import Chunk
from tumble.foundation.schemas import SCHEMAS
from tumble.logs import ReadOptions, open_recording


def lines_of(path):
    return path.read_text().splitlines(keepends=True)


def test_a_file_that_does_not_exist_is_said(tmp_path):
    assert "no such file" in refusal(tmp_path / "nothing.csv")
    assert "no such file" in refusal(f"{tmp_path / 'nothing.csv'}:imu1")


@pytest.mark.parametrize("name", ["log.csv", "log.parquet", "log.mcap", "log.bag", "log.db3", "log"])
def test_empty_file_is_reported(tmp_path, name):
    (tmp_path / name).touch()
    assert "is empty" in refusal(tmp_path / name)


def test_a_picture_is_no_log(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256)))
    assert "PNG" in refusal(path)


def test_bytes_of_any_other_kind_are_no_log(tmp_path):
    path = tmp_path / "log.dat"
    path.write_bytes(np.random.default_rng(0).bytes(4096))
    assert "not a log" in refusal(path)


def test_prose_is_no_log(tmp_path):
    path = tmp_path / "log.txt"
    path.write_text(
        "We drove north, then turned.\nThe columns ax ay az were fine, and so were gx gy gz.\n" * 9
    )
    assert "not a log" in refusal(path)


def test_json_is_no_log(tmp_path):
    path = tmp_path / "log.json"
    path.write_text('{\n"a": [\n1.0, 2.0\n]}\n')
    assert "JSON" in refusal(path)


@pytest.mark.parametrize("suffix", [".parquet", ".mcap", ".bag", ".db3"])
def test_text_under_a_wrong_extension_is_reported(tmp_path, suffix):
    path = write_text(tmp_path / f"log{suffix}", made_up(10))
    assert f"does not start like a {suffix} file" in refusal(path)


def test_folder_without_logs_is_reported(tmp_path):
    (tmp_path / "notes.doc").write_text("nothing")
    assert "without logs" in refusal(tmp_path)


def test_a_file_that_may_not_be_read_is_said(tmp_path, monkeypatch):
    path = write_text(tmp_path / "log.csv", made_up(10))

    opened = os.open

    def refuse(name, *options):
        if str(name) == str(path):
            raise PermissionError(13, "Permission denied", str(name))
        return opened(name, *options)

    monkeypatch.setattr(os, "open", refuse)  # root may read any file, so its mode would not do
    assert "cannot be opened: Permission denied" in refusal(path)


def test_names_without_samples_are_reported(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,ax,ay,az,gx,gy,gz\n")
    assert "no samples follow" in refusal(path)
    empty = pa.table(
        {name: pa.array([], pa.float64()) for name in ["time", "ax", "ay", "az", "gx", "gy", "gz"]}
    )
    pq.write_table(empty, tmp_path / "log.parquet")
    feather.write_feather(empty, tmp_path / "log.feather")
    for name in ("log.parquet", "log.feather"):
        assert "holds no samples" in refusal(tmp_path / name)


def test_missing_columns_are_named_and_those_found_listed(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,ax,ay,az,gx,gz,pressure\n1,2,3,4,5,6,7\n")
    line = refusal(path)
    assert "no column for gy;" in line
    assert "time, ax, ay, az, gx, gz, pressure" in line
    assert "--columns" in line


def test_missing_time_and_rate_are_reported(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("ax,ay,az,gx,gy,gz\n" + "0,0,9.8,0,0,0\n" * 100)
    assert "--rate" in refusal(path)


def test_unknown_imu_is_reported_and_the_known_ones_listed(tmp_path):
    names = [f"imu{i}_{channel}" for i in (1, 2) for channel in ("ax", "ay", "az", "gx", "gy", "gz")]
    path = tmp_path / "log.csv"
    path.write_text(",".join(["time", *names]) + "\n" + ",".join(["1"] * 13) + "\n")
    assert "found: imu1, imu2" in refusal(f"{path}:imu3")
    assert "log.csv:imu1" in refusal(path)


def test_row_cut_short_at_the_end_is_reported_with_its_line(tmp_path):
    path = write_text(tmp_path / "log.csv", made_up(500, temperature=False))
    path.write_text("".join(lines_of(path)[:400]) + "1.995,0.1,0.2")
    line = refusal(path)
    assert "line 401 breaks off after 3 of 7 fields" in line


def test_row_with_fields_missing_is_reported_with_its_line(tmp_path):
    path = write_text(tmp_path / "log.csv", made_up(160_000, temperature=False))
    lines = lines_of(path)
    for at in (150_000, 70_000, 2):
        lines[at - 1] = "1.0,2.0\n"
        path.write_text("".join(lines))
        assert f"line {at} has 2 fields where 7 columns are named" in refusal(path)


def test_text_in_place_of_a_number_is_reported_with_its_place(tmp_path):
    path = write_text(tmp_path / "log.csv", made_up(500, temperature=False))
    lines = lines_of(path)
    fields = lines[300].split(",")
    lines[300] = ",".join([*fields[:3], "broken", *fields[4:]])
    path.write_text("".join(lines))
    assert "line 301 holds 'broken' in column az" in refusal(path)


@pytest.mark.parametrize("share", [0.2, 0.6, 0.98])
@pytest.mark.parametrize("name", ["log.parquet", "log.mcap"])
def test_a_binary_file_cut_short_is_said(tmp_path, name, share):
    path = write(tmp_path / name, made_up(5000))
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    assert_said_to_be_cut_short(path, made_up(5000))


@pytest.mark.parametrize("name", ["log.parquet", "log.mcap"])
def test_a_damaged_binary_file_is_said_or_never_misread(tmp_path, name):
    chunk = made_up(5000)
    path = write(tmp_path / name, chunk)
    whole = path.read_bytes()
    wrong = bytearray(whole)
    for index in range(len(whole) // 3, len(whole) // 3 + 64):
        wrong[index] ^= 0x5A
    path.write_bytes(bytes(wrong))
    assert str(path) in refusal(path)


def test_backward_time_is_reported_with_line_and_step(tmp_path):
    chunk = made_up(500, temperature=False)
    chunk.time[300] -= 1.0
    line = refusal(write_text(tmp_path / "log.csv", chunk))
    assert "line 302" in line
    assert "backwards by 0.995 s" in line


@pytest.mark.parametrize(
    ("name", "place"), [("log.parquet", "row 301"), ("log.mcap", "message 301 of /imu/data")]
)
def test_backward_time_in_binary_files_is_reported_with_its_place(tmp_path, name, place):
    chunk = made_up(500, start=10.0)
    chunk.time[300] -= 1.0
    assert place in refusal(write(tmp_path / name, chunk))


def test_place_of_a_backward_step_counts_samples_left_out_before_it(tmp_path):
    chunk = made_up(500, temperature=False)
    chunk.gyroscope[100, 1] = np.nan
    chunk.time[300] -= 0.5
    assert "line 302" in refusal(write_text(tmp_path / "log.csv", chunk))


def test_a_backward_step_between_chunks_is_found(tmp_path):
    chunk = made_up(140_000, temperature=False)
    chunk.time[65536:] -= 1.0
    assert "row 65537" in refusal(write(tmp_path / "log.parquet", chunk))


def test_samples_logged_twice_are_left_out_once_and_counted(tmp_path):
    chunk = made_up(300)
    twice = Chunk(*[np.repeat(part, 2, axis=0) for part in parts(chunk)])
    path = write(tmp_path / "log.parquet", twice)
    stream = open_recording(path).chunks()
    assert same(next(stream), chunk)
    assert next(stream, None) is None
    assert stream.counts.duplicates == 300
    assert stream.counts.notices() == ("left out 300 samples with the time stamp of the one before",)


def test_a_clock_too_coarse_for_its_samples_is_said(tmp_path):
    chunk = made_up(3000, rate=200.0)
    coarse = replace(chunk, time=np.floor(chunk.time / 0.02) * 0.02)
    assert "too coarse" in refusal(write(tmp_path / "log.parquet", coarse))


def test_single_samples_that_are_no_number_are_left_out_and_counted(tmp_path):
    chunk = made_up(1000)
    chunk.accelerometer[10, 2] = np.nan
    chunk.gyroscope[20, 0] = np.inf
    path = write(tmp_path / "log.csv", chunk)
    stream = open_recording(path).chunks()
    kept = next(stream)
    assert next(stream, None) is None
    assert np.array_equal(kept.time, np.delete(chunk.time, [10, 20]))
    assert (stream.counts.without_number, stream.counts.channels) == (2, {"az": 1, "gx": 1})


def test_a_channel_that_is_often_no_number_is_refused_by_name(tmp_path):
    chunk = made_up(1000)
    chunk.gyroscope[::50, 1] = np.nan
    line = refusal(write(tmp_path / "log.csv", chunk))
    assert "gy is no number in 20 of 1000 samples" in line


@pytest.mark.parametrize("triad", ["accelerometer", "gyroscope"])
@pytest.mark.parametrize(("reading", "seen"), [(np.nan, "holds no number"), (0.0, "is 0 in all samples")])
@pytest.mark.parametrize("name", ["log.csv", "log.parquet", "log.mcap"])
def test_a_triad_without_a_reading_is_left_out_and_named(tmp_path, name, triad, reading, seen):
    chunk = made_up(100)
    getattr(chunk, triad)[:] = reading
    metadata = open_recording(write(tmp_path / name, chunk)).metadata
    assert triad not in metadata.triads
    assert len(metadata.triads) == 1
    assert f"{triad} {seen}, and is left out as not recorded" in metadata.remarks


def test_a_gyroscope_that_rests_at_zero_before_it_turns_is_read(tmp_path):
    chunk = made_up(100_000)
    chunk.gyroscope[:-1] = 0.0
    assert same(read(write(tmp_path / "log.csv", chunk)), chunk)


def test_gaps_stay(tmp_path):
    chunk = made_up(1000)
    chunk.time[500:] += 30.0
    assert same(read(write(tmp_path / "log.csv", chunk)), chunk)


def test_gaps_in_temperature_hold_the_value_before(tmp_path):
    chunk = made_up(1000)
    sparse = chunk.temperature.copy()
    sparse[np.arange(1000) % 100 != 0] = np.nan
    path = write(tmp_path / "log.csv", replace(chunk, temperature=sparse))
    assert np.array_equal(read(path).temperature, np.repeat(chunk.temperature[::100], 100))


def test_a_column_of_text_in_parquet_is_refused_by_name(tmp_path):
    table = pa.table(
        {
            name: ["a", "b"] if name == "gy" else [1.0, 2.0]
            for name in ["time", "ax", "ay", "az", "gx", "gy", "gz"]
        }
    )
    pq.write_table(table, tmp_path / "log.parquet")
    assert "column gy" in refusal(tmp_path / "log.parquet")


def test_an_imu_named_twice_in_two_ways_is_refused(tmp_path):
    path = write(tmp_path / "log.mcap", made_up(100))
    assert "--topic" in refusal(f"{path}:/imu/data", ReadOptions(topic="/other"))


def parts(chunk):
    return chunk.time, chunk.accelerometer, chunk.gyroscope, chunk.temperature


@pytest.mark.parametrize("schema", SCHEMAS.values(), ids=SCHEMAS)
@pytest.mark.parametrize("name", ["unit.yaml", "unit.csv"])
def test_a_document_given_for_a_log_is_told_what_it_is(tmp_path, schema, name):
    path = tmp_path / name
    path.write_text(f"# of a unit\nschema: tumble-{schema.name}/1\nb: [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]\n")
    assert f"{name}: is a {schema.what}, not a log" in refusal(path)
