"""Texts of other programs, after the layouts that their makers and users published."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from log_fixtures import made_up, read, real, refusal, write
from patience import PATIENCE
from tumble.foundation.recording import Chunk
from tumble.logs import ReadOptions, list_imus, open_recording
from turntable_sessions import typed

COUNTS = {
    "accelerometer_unit": "g",
    "accelerometer_scale": 16384,
    "gyroscope_unit": "deg/s",
    "gyroscope_scale": 131,
}


def table(path, names, rows, delimiter="\t", end="", head=()):
    lines = [*head, delimiter.join(names) + end, *(delimiter.join(map(str, row)) + end for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def samples(count=200):
    chunk = made_up(count, rate=100.0, temperature=False)
    return chunk, np.hstack([chunk.accelerometer, chunk.gyroscope]).round(6)


@pytest.mark.parametrize("end", ["", "\t"])
def test_rows_of_mt_manager_end_in_a_tab(tmp_path, end):
    """Layout: scikit-kinematics, tests/data/data_xsens.txt and data_xsens2.txt (MT Manager, MTx)."""
    _, values = samples()
    names = ["Counter", *(f"Acc_{axis}" for axis in "XYZ"), *(f"Gyr_{axis}" for axis in "XYZ")]
    path = table(
        tmp_path / "MT_00.txt",
        names,
        [[65530 + at & 0xFFFF, *row] for at, row in enumerate(values)],
        head=["// Start Time: 0", "// Sample rate: 50.0Hz", "// Scenario: 4.9", "// Firmware Version: 2.5.1"],
    )
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:4], lines[4] + end, *(line + "\t" for line in lines[5:])]) + "\n")
    chunk = read(path)
    assert np.array_equal(chunk.accelerometer, values[:, :3])
    assert chunk.time[-1] - chunk.time[0] == pytest.approx(199 / 50.0)
    assert open_recording(path).metadata.format == "xsens"


@pytest.fixture
def consensys(tmp_path):
    """Layout: devicely, tests/Shimmer_test_data/read_test_data.csv (Shimmer3, Consensys)."""
    _, values = samples()
    channels = [f"{sensor}_{axis}" for sensor in ("Accel_LN", "Accel_WR", "Gyro") for axis in "XYZ"]
    names = ["Timestamp_Unix", *channels]
    rows = [
        [1.595933810034e12 + 10.0 * at, *row[:3], *(row[:3] + 0.25), *np.degrees(row[3:])]
        for at, row in enumerate(values)
    ]
    path = table(
        tmp_path / "s.csv", [f"Shimmer_40AC_{name}_CAL" for name in names], rows, ";", ";", ['"sep=;"']
    )
    lines = path.read_text().splitlines()
    units = ";".join(["ms", *["m/(s^2)"] * 6, *["deg/s"] * 3]) + ";"
    path.write_text("\n".join([*lines[:2], units, *lines[2:]]) + "\n")
    return path, values


def test_units_of_consensys_stand_below_its_names(consensys):
    path, values = consensys
    chunk = read(f"{path}:Shimmer_40AC_WR")
    assert np.allclose(chunk.accelerometer, values[:, :3] + 0.25, atol=1e-9)
    assert np.allclose(chunk.gyroscope, values[:, 3:], atol=1e-9)
    unit = open_recording(f"{path}:Shimmer_40AC_LN").metadata.gyroscope_unit
    assert (unit.name, unit.reason) == ("deg/s", "column name")


def test_two_accelerometers_are_named_with_columns_to_copy(consensys):
    path, values = consensys
    line = refusal(path)
    assert "2 accelerometers and one gyroscope" in line
    assert f"{path.name}:Shimmer_40AC_LN" in line
    option = line[line.index("--columns ") :].split(maxsplit=1)[1].strip('"')
    columns = dict(pair.split("=") for pair in option.split(","))
    # Names without their units would do, and so do those with them.
    assert np.allclose(read(path, ReadOptions(columns=columns)).accelerometer, values[:, :3], atol=1e-9)


def test_an_accelerometer_beside_a_whole_imu_is_named(tmp_path):
    _, values = samples()
    names = ["time", "ax", "ay", "az", "gx", "gy", "gz", "hi_ax", "hi_ay", "hi_az"]
    path = table(
        tmp_path / "log.csv", names, [[0.01 * at, *row, *row[:3]] for at, row in enumerate(values)], ","
    )
    remarks = open_recording(path).metadata.remarks
    assert any("--columns ax=hi_ax,ay=hi_ay,az=hi_az,gx=gx,gy=gy,gz=gz reads it" in each for each in remarks)


@pytest.mark.parametrize("name", ["accel{}_{}", "accel_{}_{}", "acc{}{}"])
def test_numbered_sensors_of_one_table_are_imus(tmp_path, name):
    _, values = samples()
    names = ["time", *(name.format(n, axis) for n in (1, 2) for axis in "xyz")]
    names += [f"gyro{n}_{axis}" for n in (1, 2) for axis in "xyz"]
    rows = [[0.01 * at, *row[:3], *row[:3], *row[3:], *row[3:]] for at, row in enumerate(values)]
    path = table(tmp_path / "log.csv", names, rows, ",")
    assert list_imus(path) == ("1", "2")
    assert np.array_equal(read(f"{path}:2").gyroscope, values[:, 3:])


def test_acceleration_without_gravity_is_refused(tmp_path):
    """Names: phyphox, experiment "Acceleration (without g)"."""
    _, values = samples()
    names = ["Time (s)", *(f"Linear Acceleration {axis} (m/s^2)" for axis in "xyz")]
    path = table(
        tmp_path / "Raw Data.csv", names, [[0.01 * at, *row[:3]] for at, row in enumerate(values)], ","
    )
    assert "no specific force" in refusal(path)


@pytest.mark.parametrize("name", ["monitor_timestamps", "i2cdevlib", "plotter", "adafruit", "raw_counts"])
def test_texts_of_sketches_hold_the_same_motion(name):
    folder = real("cases/arduino_texts")
    counts = {} if name in ("plotter", "adafruit") else COUNTS
    rate = None if name == "monitor_timestamps" else 20.0
    chunk = read(folder / f"{name}.txt", ReadOptions(rate=rate, **counts))
    raw = read(folder / "raw_counts.txt", ReadOptions(rate=20.0, **COUNTS))
    rows = min(len(chunk), len(raw))
    assert rows >= 75
    assert np.allclose(chunk.time[:rows] - chunk.time[0], raw.time[:rows], atol=1e-6)
    assert np.abs(chunk.accelerometer[:rows] - raw.accelerometer[:rows]).max() < 0.01
    assert np.abs(chunk.gyroscope[:rows] - raw.gyroscope[:rows]).max() < 0.01


def test_monitor_times_go_on_after_midnight(tmp_path):
    lines = [f"{(86399 + at // 2) // 3600 % 24:02d}:{(86399 + at // 2) // 60 % 60:02d}:" for at in range(20)]
    lines = [
        f"{line}{(86399 + at // 2) % 60:02d}.{at % 2 * 5}00 -> 1 2 16384 3 4 5"
        for at, line in enumerate(lines)
    ]
    path = tmp_path / "monitor.txt"
    path.write_text("\n".join(lines) + "\n")
    assert np.allclose(np.diff(read(path, ReadOptions(counts=(2.0, 250.0))).time), 0.5)


def test_a_line_unlike_the_others_is_counted(tmp_path):
    rows = [f"AccX:{at / 1000:.3f},AccY:0.1,AccZ:1.0,GyroX:1.0,GyroY:2.0,GyroZ:{at}" for at in range(400)]
    rows[200] = "brownout!"
    path = tmp_path / "plot.txt"
    path.write_text("\n".join(rows) + "\n")
    stream = open_recording(path, ReadOptions(rate=50.0)).chunks()
    assert sum(map(len, stream)) == 399
    assert "line 201 reads 'brownout!'" in stream.counts.bad_lines.first


def test_the_first_line_is_quoted_where_nothing_is_understood(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("Calibration of \x1b]0;owned\x07unit 7\nsecond line\n")
    line = refusal(path)
    assert r"line 1 reads 'Calibration of \x1b]0;owned\x07unit 7'" in line


@pytest.mark.parametrize("span", [2, 4, 8, 16])
def test_raw_counts_name_the_range_that_reads_them(tmp_path, span):
    _, values = samples()
    counts = np.hstack([values[:, :3] / 9.80665 * 32768 / span, np.degrees(values[:, 3:]) * 131]).round()
    names = ["time", "ax", "ay", "az", "gx", "gy", "gz"]
    path = table(tmp_path / "raw.csv", names, [[0.01 * at, *row] for at, row in enumerate(counts)], ",")
    line = refusal(path)
    assert f"--counts {span},250" in line
    assert f"{32768 // span} a g" in line
    done = typed("inspect", path, "--counts", f"{span},250")
    assert done.code == 0, done.err
    chunk = read(path, ReadOptions(counts=(span, 250.0)))
    assert np.allclose(chunk.accelerometer, values[:, :3], atol=9.81 * span / 32768)


def test_warming_by_90_kelvin_in_4_seconds_is_noticed(tmp_path):
    chunk = made_up(400, rate=100.0)
    warm = Chunk(chunk.time, chunk.accelerometer, chunk.gyroscope, np.linspace(-20.0, 70.0, 400))
    stream = open_recording(write(tmp_path / "oven.csv", warm)).chunks()
    assert sum(map(len, stream)) == 400
    assert any("in 3.99 s, faster than sensors do" in notice for notice in stream.counts.notices())
    slow = open_recording(write(tmp_path / "slow.csv", chunk)).chunks()
    assert sum(map(len, slow)) == 400
    assert slow.counts.notices() == ()


def test_inspect_and_convert_state_the_directions_of_axes(tmp_path):
    log = real("px4/sample_log_small.ulg")
    assert "axes FRD: x forward, y right, z down" in typed("inspect", f"{log}:sensor_combined").out
    done = typed("convert", f"{log}:sensor_combined", "-o", tmp_path / "log.csv")
    assert "axes, as in the log: FRD" in done.out
    turned = typed("inspect", f"{log}:sensor_combined", "--axes", "x,-y,-z")
    assert "FRD" not in turned.out


MAIN = "from tumble.cli.main import main; main()"
ESCAPE = "\x1b]0;owned\x07"


def test_escapes_in_names_of_columns_reach_no_terminal(tmp_path):
    _, values = samples()
    names = ["time", *(f"{ESCAPE}_{each}" for each in ("ax", "ay", "az", "gx", "gy", "gz"))]
    path = table(tmp_path / "log.csv", names, [[0.01 * at, *row] for at, row in enumerate(values)], ",")
    for arguments in (
        ["inspect", path],
        ["inspect", path, "--columns", "ax=nothing"],
        ["inspect", f"{path}:none"],
    ):
        done = typed(*arguments)
        assert "\x1b]" not in done.out + done.err
        assert "\x07" not in done.out + done.err


@pytest.mark.parametrize(
    "arguments",
    [
        ["import", "FIFO", "-o", "OUT"],
        ["compare", "FIFO", "FIFO", "-o", "OUT"],
        ["compare", "/dev/zero", "/dev/zero", "-o", "OUT"],
        ["import", "/dev/zero", "-o", "OUT"],
    ],
)
def test_a_pipe_or_a_device_is_refused_at_once(tmp_path, arguments):
    os.mkfifo(tmp_path / "fifo")
    places = {"FIFO": tmp_path / "fifo", "OUT": tmp_path / "out.yaml"}
    done = subprocess.run(
        [sys.executable, "-c", MAIN, *(str(places.get(word, word)) for word in arguments)],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 2
    assert "is a device or a pipe" in done.stderr


@pytest.mark.parametrize(
    ("typed_options", "words"),
    [(["--columns", "ax=ax,ax=ay"], "ax is given twice"), (["--skip-lines", "-5"], "give 0 or more")],
)
def test_options_that_make_no_sense_are_refused(tmp_path, typed_options, words):
    path = write(tmp_path / "log.csv", made_up(100))
    done = typed("inspect", path, *typed_options)
    assert done.code == 2
    assert words in done.err


def metawear(folder, times_of_force, times):
    """Files of MetaBase with times in ms of each; names as in daveebbelaar/tracking-barbell-exercises."""
    for sensor, unit, at, scale in (
        ("Accelerometer_12.500Hz", "g", times_of_force, 1.0),
        ("Gyroscope_25.000Hz", "deg/s", times, 10.0),
    ):
        names = ["epoch (ms)", "time (01:00)", "elapsed (s)", *(f"{axis}-axis ({unit})" for axis in "xyz")]
        rows = [[time, "2019-01-11T16:10:08.431", 0.0, scale * time, 0.5, 1.0] for time in at]
        table(folder / f"x_MetaWear_2019_C42732BE255C_{sensor}_1.4.4.csv", names, rows, ",")
    return sorted(folder.iterdir())


def test_metawear_at_two_rates_follows_the_times_of_the_gyroscope(tmp_path):
    files = metawear(tmp_path, range(0, 8000, 80), range(0, 8000, 40))
    assert "--interpolate" in refusal(files[0])
    for path in (*files, tmp_path):
        chunk = read(path, ReadOptions(interpolate=True))
        assert np.allclose(chunk.accelerometer[:, 0], 9.80665 * 1e3 * chunk.time, atol=1e-9)
        assert np.allclose(chunk.gyroscope[:, 0], np.radians(1e4 * chunk.time), atol=1e-9)


def test_metawear_alone_is_a_triad(tmp_path):
    files = metawear(tmp_path, range(0, 8000, 80), range(0, 8000, 40))
    files[0].unlink()
    recording = open_recording(files[1])
    assert recording.metadata.triads == ("gyroscope",)
    chunk = next(recording.chunks())
    assert np.allclose(chunk.gyroscope[:, 0], np.radians(1e4 * chunk.time), atol=1e-9)


def test_metawear_with_a_column_missing_is_refused_by_name(tmp_path):
    names = ["epoch (ms)", "time (01:00)", "elapsed (s)", "x-axis (g)", "z-axis (g)"]
    path = table(tmp_path / "a.csv", names, [[1e3 * at, 0, 0, 0.0, 1.0] for at in range(9)], ",")
    assert "has no column y-axis (g)" in refusal(path)


def picoquake(path, counts, head="# Config: sample_rate = 200.0 Hz, filter = 488 Hz"):
    names = ["count", "a_x", "a_y", "a_z", "g_x", "g_y", "g_z"]
    table(path, names, [[at, 0.0, 0.01 * at, 1.0, 2.0, 0.0, 1e-3 * at] for at in counts], ",")
    path.write_text(f"# PLab PicoQuake Data\n{head}\n{path.read_text()}")
    return path


def test_samples_that_picoquake_lost_are_a_gap(tmp_path):
    chunk = read(picoquake(tmp_path / "log.csv", [*range(100), *range(160, 300)]))
    assert len(chunk) == 240
    assert np.diff(chunk.time).max() == pytest.approx(61 / 200.0)
    assert chunk.time[-1] == pytest.approx(299 / 200.0)
    assert np.allclose(chunk.gyroscope[:, 0], np.radians(2.0))


def test_picoquake_without_its_rate_needs_one(tmp_path):
    path = picoquake(tmp_path / "log.csv", range(100), head="# Config:")
    assert "give it with --rate" in refusal(path)
    assert read(path, ReadOptions(rate=50.0)).time[-1] == pytest.approx(99 / 50.0)
