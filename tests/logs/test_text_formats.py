"""Text and folders of other programs: samples written by their documentation come back."""

from __future__ import annotations

import gzip
import json

import numpy as np
import pytest

import format_fixtures as formats
from log_fixtures import join, made_up, read, refusal
from tumble.logs import ReadOptions, list_imus, open_recording
from turntable_sessions import typed

SAMPLES = 700


@pytest.fixture(scope="module")
def chunk():
    return made_up(SAMPLES, rate=100.0, temperature=False)


@pytest.mark.parametrize("name", formats.WRITERS)
def test_samples_return_to_the_nanosecond_and_last_digit_of_the_unit(tmp_path, chunk, name):
    path, options, expected = formats.WRITERS[name](tmp_path, made_up(SAMPLES, rate=100.0, temperature=False))
    recording = open_recording(path, options)
    found = join(list(recording.chunks()))
    assert recording.metadata.format == formats.FORMATS.get(name, name)
    assert len(found) == SAMPLES
    assert np.abs(found.time - expected.time).max() <= np.spacing(expected.time[-1])
    assert np.allclose(found.accelerometer, expected.accelerometer, rtol=1e-14, atol=1e-14)
    assert np.allclose(found.gyroscope, expected.gyroscope, rtol=1e-14, atol=1e-14)
    assert recording.metadata.gyroscope_unit.reason != "assumed" or name.startswith("rpg")


def test_euroc_sequence_is_found_by_each_of_its_folders_and_its_file(tmp_path, chunk):
    mav0, _, expected = formats.euroc(tmp_path / "MH_01_easy", chunk)
    for path in (mav0.parent, mav0, mav0 / "imu0", mav0 / "imu0" / "data.csv"):
        recording = open_recording(path)
        assert recording.name == "MH_01_easy"
        assert np.array_equal(join(list(recording.chunks())).time, expected.time)


def test_two_imus_of_a_euroc_sequence_are_distinguished(tmp_path, chunk):
    mav0, _, _ = formats.euroc(tmp_path / "MH_01_easy", chunk)
    formats.euroc(tmp_path / "MH_01_easy", chunk, "imu1")
    assert list_imus(mav0) == ("imu0", "imu1")
    assert open_recording(f"{mav0}:imu1").name == "MH_01_easy-imu1"
    assert "mav0:imu0" in refusal(mav0)


SENSOR = """%YAML:1.0
sensor_type: imu
T_BS:
  cols: 4
  rows: 4
  data: [0.0, -1.0, 0.0, 0.3, 1.0, 0.0, 0.0, 0.4, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
rate_hz: 200
"""


def test_rate_and_extrinsics_are_those_of_sensor_yaml(tmp_path, chunk):
    metadata = open_recording(formats.euroc(tmp_path, chunk, sensor=SENSOR)[0]).metadata
    assert metadata.rate == 200.0
    assert metadata.frame == "sensor"
    assert any("turns by 90 deg and shifts by 0.5 m" in remark for remark in metadata.remarks)


@pytest.mark.parametrize("text", ["", "rate_hz: -3\nT_BS: 4\n", ": : [", "T_BS: {data: [1, x]}"])
def test_samples_are_read_whatever_stands_in_sensor_yaml(tmp_path, chunk, text):
    path, _, expected = formats.euroc(tmp_path, chunk, sensor=text)
    assert np.array_equal(read(path).accelerometer, expected.accelerometer)
    assert open_recording(path).metadata.rate is None


def test_times_of_dso_images_are_reported(tmp_path, chunk):
    path, _, _ = formats.tum_vi(tmp_path, chunk)
    assert any("times of images" in remark for remark in open_recording(path).metadata.remarks)


def test_missing_kitti_file_does_not_shift_the_times_after_it(tmp_path, chunk):
    path, _, expected = formats.kitti(tmp_path, chunk)
    (path / "data" / f"{40:010d}.txt").unlink()
    assert np.array_equal(read(path).time, np.delete(expected.time, 40))
    assert open_recording(path.parent).name == "2011_09_26_drive_0001_extract"


def test_error_in_a_kitti_folder_names_its_file(tmp_path, chunk):
    path, _, _ = formats.kitti(tmp_path, chunk)
    file = path / "data" / f"{300:010d}.txt"
    text = file.read_text()
    file.write_text(text[:99])
    assert f"{file}: does not hold 30 numbers" in refusal(path)
    file.write_text(text)
    stamps = path / "timestamps.txt"
    lines = stamps.read_text().splitlines(keepends=True)
    stamps.write_text("".join([*lines[:9], "noon\n", *lines[10:]]))
    assert "line 10 holds 'noon', which is no date and time" in refusal(path)
    stamps.write_text("".join(lines[:-1]))
    assert "has no time for data/0000000699.txt" in refusal(path)
    stamps.unlink()
    assert "--rate" in refusal(path) or "holds no time" in refusal(path)


@pytest.mark.parametrize("header", ["VNYMR", "VNQMR", "VNMAR", "VNRRG,54", "VNRRG,27"])
@pytest.mark.parametrize("seal", [formats.sentence, formats.sixteen_bits])
@pytest.mark.parametrize("extra", ["", ",S0000,T1162704"])
def test_each_sentence_of_vectornav_comes_back(tmp_path, chunk, header, seal, extra):
    path, options, expected = formats.vectornav(tmp_path, chunk, header, seal, extra=extra)
    found = read(path, options)
    assert np.array_equal(found.accelerometer, expected.accelerometer)
    assert np.array_equal(found.gyroscope, expected.gyroscope)
    corrected = open_recording(path, options).metadata.already_corrected
    assert corrected is (header not in ("VNIMU", "VNRRG,54"))


def test_time_written_by_the_host_is_that_of_the_sentence(tmp_path, chunk):
    path, _, _ = formats.vectornav(tmp_path, chunk, prefix=lambda number: f"{1.7e9 + number / 200:.3f} ")
    assert np.allclose(read(path).time, 1.7e9 + np.arange(SAMPLES) / 200, rtol=0, atol=1e-6)


def test_sentences_of_vectornav_need_a_rate_where_they_have_no_time(tmp_path, chunk):
    assert "--rate" in refusal(formats.vectornav(tmp_path, chunk)[0])


def test_bad_sentences_are_left_out_counted_and_reported(tmp_path, chunk):
    path, options, expected = formats.vectornav(tmp_path, chunk)
    lines = path.read_bytes().splitlines(keepends=True)
    lines[200] = lines[200].replace(b"+00.1", b"+00.7", 1)
    lines[400] = lines[400][:30] + b"\r\n"
    lines[100:100] = [formats.sentence("VNGPS,1,2").encode(), b"$VNERR,03*72\r\n"]
    path.write_bytes(lines[0][9:] + b"".join(lines))
    stream = open_recording(path, options).chunks()
    found = join(list(stream))
    assert np.array_equal(found.accelerometer, np.delete(expected.accelerometer, [200, 400], axis=0))
    [said] = stream.counts.notices()
    assert said.startswith("left out 3 bad lines: line 1 is no whole sentence")


def test_valid_checksum_without_a_number_is_left_out_and_reported(tmp_path, chunk):
    path, options, expected = formats.vectornav(tmp_path, chunk)
    lines = path.read_bytes().splitlines(keepends=True)
    text = lines[50][1 : lines[50].index(b"*")].decode().rpartition(",+24.5")[0]
    lines[50] = formats.sentence(f"{text[:-9]}+0.00x001,+24.5,+101.3").encode()
    path.write_bytes(b"\x00\r" + b"".join(lines))
    stream = open_recording(path, options).chunks()
    assert np.array_equal(join(list(stream)).gyroscope, np.delete(expected.gyroscope, [0, 50], axis=0))
    assert "left out 2 bad lines: line 1 is torn" in " ".join(stream.counts.notices())


def test_betaflight_log_without_one_axis_is_refused_with_its_columns(tmp_path, chunk):
    path, _, _ = formats.betaflight(tmp_path, chunk)
    path.write_text(path.read_text().replace(" accSmooth[2] (g)", " other (g)"))
    assert "lacks an axis of accSmooth[0]" in refusal(path)


def test_a_checksum_that_does_not_fit_is_said_with_both(tmp_path, chunk):
    path, options, _ = formats.vectornav(tmp_path, chunk)
    data = path.read_bytes().replace(b"+00.1", b"+00.7")
    path.write_bytes(data)
    line = refusal(path, options)
    assert "has checksum" in line
    assert "was computed" in line


@pytest.mark.parametrize("ticks", [None, 100])
def test_counters_of_xsens_that_wrap_count_on_and_gaps_stay_gaps(tmp_path, chunk, ticks):
    kept = np.delete(np.arange(SAMPLES), slice(300, 340))
    start = 2**32 - 5000
    path, _, _ = formats.xsens(
        tmp_path,
        made_up(len(kept), rate=100.0, temperature=False),
        counter=lambda number: (65_000 + int(kept[number])) % 65_536,
        fine=None if ticks is None else lambda number: (start + ticks * int(kept[number])) % 2**32,
    )
    time = read(path).time
    assert np.allclose(time - time[0], kept / 100.0, rtol=0.0, atol=1e-9)


def test_an_xsens_export_without_counter_has_the_rate_of_its_head(tmp_path, chunk):
    path, _, _ = formats.xsens(tmp_path, chunk, counter=lambda number: "")
    assert np.array_equal(read(path).time, np.arange(SAMPLES) / 100.0)


def test_an_xsens_export_without_gravity_is_refused(tmp_path, chunk):
    path, _, _ = formats.xsens(tmp_path, chunk)
    path.write_text(path.read_text().replace("\tAcc_", "\tOther_"))
    assert "FreeAcc, from which gravity was removed" in refusal(path)


def test_the_stamp_of_a_header_goes_before_the_time_of_its_arrival(tmp_path, chunk):
    path, _, expected = formats.rostopic(tmp_path, chunk)
    metadata = open_recording(path).metadata
    assert metadata.frame == "imu_link"
    path.write_text(path.read_text().replace(",imu_link", ",").replace(f",{formats.EPOCH_NS}", ",0"))
    assert np.array_equal(read(path).gyroscope, expected.gyroscope[1:])


def test_headers_without_stamp_give_arrival_times_and_a_notice(tmp_path, chunk):
    path, _, expected = formats.rostopic(tmp_path, chunk)
    lines = [line.split(",") for line in path.read_text().splitlines()]
    path.write_text("\n".join(",".join([*fields[:2], "0", *fields[3:]]) for fields in lines[1:]) + "\n")
    path.write_text(",".join(lines[0]) + "\n" + path.read_text())
    recording = open_recording(path)
    assert any("time is that of recording" in remark for remark in recording.metadata.remarks)
    assert np.abs(join(list(recording.chunks())).time - expected.time - 7e-3).max() < 1e-6


def test_phone_files_with_own_times_are_joined_only_on_request(tmp_path, chunk):
    path, _, expected = formats.sensor_logger(tmp_path, chunk, shift=2_000_000)
    assert "--interpolate" in refusal(path)
    found = read(path / "Gyroscope.csv", ReadOptions(interpolate=True))
    assert np.array_equal(found.gyroscope, expected.gyroscope[:-1])
    share = 0.2
    between = (1.0 - share) * expected.accelerometer[:-1] + share * expected.accelerometer[1:]
    assert np.allclose(found.accelerometer, between, atol=2e-6)


def test_acceleration_without_gravity_of_a_phone_is_refused(tmp_path, chunk):
    path, _, _ = formats.sensor_logger(tmp_path, chunk)
    (path / "TotalAcceleration.csv").rename(path / "Accelerometer.csv")
    assert "gravity was removed" in refusal(path)


def test_counts_of_betaflight_need_what_one_g_is(tmp_path, chunk):
    path, _, expected = formats.betaflight(tmp_path, chunk, raw=True)
    (tmp_path / "LOG00007.01.headers.csv").unlink()
    assert "acc_1G" in refusal(path)
    found = read(path, ReadOptions(accelerometer_scale=2048))
    assert np.allclose(found.accelerometer, expected.accelerometer, rtol=1e-12)


@pytest.mark.parametrize("name", ["euroc", "xsens", "vectornav", "rostopic", "ros2_topic"])
def test_text_of_a_program_is_read_packed_too(tmp_path, chunk, name):
    path, options, expected = formats.WRITERS[name](tmp_path, chunk)
    file = path if path.is_file() else next(path.rglob("data.csv"))
    packed = file.with_name(file.name + ".gz")
    packed.write_bytes(gzip.compress(file.read_bytes()))
    file.unlink()
    found = read(packed, options)
    assert np.array_equal(found.gyroscope, expected.gyroscope)


def test_inspect_shows_a_euroc_folder_as_a_user_types_it(tmp_path, chunk):
    path, _, _ = formats.euroc(tmp_path, chunk)
    done = typed("inspect", str(path), "--json")
    assert done.code == 0
    assert json.loads(done.out)["logs"][0]["timing"]["samples"] == SAMPLES


def test_euroc_output_of_convert_reads_back(tmp_path, chunk):
    log, _, expected = formats.rpg(tmp_path, chunk)
    assert typed("convert", str(log), "-o", str(tmp_path / "drive"), "--format", "euroc").code == 0
    found = read(tmp_path / "drive")
    assert np.array_equal(found.gyroscope, expected.gyroscope)
    assert np.array_equal(found.accelerometer, expected.accelerometer)
    assert np.abs(found.time - expected.time).max() < 1e-9


def test_a_printed_topic_that_breaks_off_in_its_first_row_is_refused(tmp_path, chunk):
    path, _, _ = formats.rostopic(tmp_path, chunk)
    names = path.read_text().splitlines()[0]
    path.write_text(f"{names}\n1,2")
    assert "breaks off" in refusal(path)


@pytest.mark.parametrize("whole", [(), ("time_ms",), ("gz",), ("time_ms", "gx", "gy", "gz")])
def test_decimal_commas_are_read_beside_any_number_of_semicolons(tmp_path, chunk, whole):
    """Where one column held whole numbers, a row had as many commas as semicolons, and was split by these."""
    time = "time_ms" if "time_ms" in whole else "time"
    names = [time, "ax", "ay", "az", "gx", "gy", "gz"]
    stamps = np.arange(len(chunk)) * (10.0 if time in whole else 0.01)
    table = np.column_stack([stamps, chunk.accelerometer, chunk.gyroscope])
    table[:, [name in whole for name in names]] = np.round(table[:, [name in whole for name in names]])

    def cell(name, value):
        return f"{value:.0f}" if name in whole else f"{value:.9f}".replace(".", ",")

    rows = [";".join(map(cell, names, row)) for row in table]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([";".join(names), *rows]) + "\n")
    found = read(path, ReadOptions(gyroscope_unit="rad/s", accelerometer_unit="m/s^2"))
    assert found.accelerometer == pytest.approx(table[:, 1:4], abs=1e-8)
    assert found.gyroscope == pytest.approx(table[:, 4:], abs=1e-8)
