"""Text of other programs that is cut, garbled or made up: read, or refused in one line."""

from __future__ import annotations

import gzip
import re
import tracemalloc

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import format_fixtures as formats
from hostile import for_long
from log_fixtures import made_up, refusal, write_text
from tumble.foundation.errors import LogError, TumbleError
from tumble.logs import ReadOptions, list_imus, open_recording
from tumble.tools.inspect.procedure import inspect


def csv_gz(folder, chunk):
    path = folder / "log.csv.gz"
    path.write_bytes(gzip.compress(write_text(folder / "plain.csv", chunk).read_bytes()))
    (folder / "plain.csv").unlink()
    return path, ReadOptions(), chunk


WRITERS = {
    name: formats.WRITERS[name]
    for name in (
        *("euroc", "tum_vi", "kitti", "vectornav", "xsens", "rostopic", "ros2_topic"),
        *("sensorlog", "betaflight_raw", "sensor_logger", "phyphox", "metawear", "picoquake"),
    )
} | {"csv_gz": csv_gz}

CHANGES = st.lists(
    st.tuples(
        st.sampled_from(["cut", "replace", "insert", "remove", "repeat"]),
        st.floats(0.0, 1.0),
        st.one_of(
            st.binary(min_size=1, max_size=40),
            st.sampled_from(
                [b"\n", b"\x00", b"$", b"*", b",", b"nan", b"1e999", b"-", b"\xff\xfe", b"9" * 400]
            ),
        ),
    ),
    min_size=1,
    max_size=4,
)


def changed(data, changes):
    for kind, place, extra in changes:
        at = round(place * len(data))
        after = at + len(extra)
        data = {
            "cut": data[:at],
            "replace": data[:at] + extra + data[after:],
            "insert": data[:at] + extra + data[at:],
            "remove": data[:at] + data[after:],
            "repeat": data[:after] + data[at:],
        }[kind]
    return data


def read_or_refused(path, options):
    """Returns whether it was read; asserts that a refusal is one line."""
    try:
        for imu in list_imus(path, options):
            inspect(open_recording(f"{path}:{imu}" if imu else path, options))
    except TumbleError as error:
        said = str(error)
    else:
        return True
    assert "\n" not in said
    return False


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("skip", [False, True])
def test_a_log_that_was_cut_or_garbled_is_read_or_refused_in_one_line(tmp_path, name, skip):
    path, options, _ = WRITERS[name](tmp_path, made_up(60, rate=100.0, temperature=False))
    options = ReadOptions(rate=options.rate, skip_bad_lines=skip, interpolate=skip)
    files = sorted(file for file in tmp_path.rglob("*") if file.is_file())[:80]
    whole = {file: file.read_bytes() for file in files}
    assert read_or_refused(path, options)

    @settings(max_examples=8, database=None, suppress_health_check=list(HealthCheck))
    @given(st.sampled_from(files), CHANGES)
    def attempt(file, changes):
        file.write_bytes(changed(whole[file], changes))
        read_or_refused(path, options)
        file.write_bytes(whole[file])

    for_long(attempt, share=0.5)


MARKS = {
    "vectornav": ("$VNIMU,", "$VNRRG,54,", "*", "\r\n", ",", "+1.0", "5A"),
    "xsens": (
        "// Update Rate: 100Hz\n",
        "PacketCounter\t",
        "SampleTimeFine\t",
        "Acc_X\tAcc_Y\tAcc_Z\t",
        "\n",
        "\t",
        "1",
    ),
    "euroc": ("#timestamp [ns],", "w_RS_S_x [rad s^-1],", "a_RS_S_x", "\n", ",", "140", "1.0"),
    "ros_echo": ("%time,", "field.linear_acceleration.x,", "field.header.stamp", "\n", "1," * 40, "0", ","),
    "programs": (
        "time (us), ",
        "accSmooth[0], ",
        "gyroADC[0], ",
        "acc_1G,2048\n",
        "gFx,gFy,gFz",
        "\n",
        "1, ",
    ),
}


@pytest.mark.parametrize("name", MARKS)
def test_text_made_of_the_words_of_a_format_is_read_or_refused(tmp_path, name):
    path = tmp_path / "log.txt"

    @settings(max_examples=25, database=None)
    @given(st.lists(st.one_of(st.sampled_from(MARKS[name]), st.text(max_size=5)), min_size=1, max_size=60))
    def attempt(words):
        path.write_text(MARKS[name][0] + "".join(words), encoding="utf-8", errors="replace")
        read_or_refused(path, ReadOptions(rate=100.0))

    for_long(attempt)


def test_files_as_large_as_a_disk_beside_samples_take_no_memory(tmp_path):
    chunk = made_up(60, rate=100.0, temperature=False)
    oxts, _, _ = formats.kitti(tmp_path, chunk)
    mav0, _, _ = formats.euroc(tmp_path, chunk, sensor="rate_hz: 200\n")
    for file in (oxts / "data" / f"{0:010d}.txt", oxts / "timestamps.txt", mav0 / "imu0" / "sensor.yaml"):
        with file.open("r+b") as stream:
            stream.truncate(1 << 36)
    tracemalloc.start()
    refusal(oxts)
    open_recording(mav0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 64 << 20


@pytest.mark.parametrize("name", WRITERS)
def test_an_empty_file_of_a_format_is_refused(tmp_path, name):
    path, options, _ = WRITERS[name](tmp_path, made_up(60, rate=100.0, temperature=False))
    for file in [file for file in tmp_path.rglob("*") if file.is_file()]:
        file.write_bytes(b"")
    assert not read_or_refused(path, options)


@pytest.mark.parametrize("name", ["x-axis (g)", "z-axis (g)"])
def test_an_axis_of_metawear_that_is_named_twice_is_refused(tmp_path, name):
    names = ["epoch (ms)", "x-axis (g)", "y-axis (g)", "z-axis (g)", name]
    rows = [[10.0 * k, 0.1, 0.2, 1.0, 0.5] for k in range(50)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(",".join(map(str, each)) for each in [names, *rows]))
    with pytest.raises(LogError, match=re.escape(f"line 1 names column '{name}' twice")):
        open_recording(path)


@pytest.mark.parametrize("wide", ["names", "rows", "one row of digits"])
def test_line_beyond_all_bounds_is_reported_as_one(tmp_path, wide):
    names, row = "time,ax,ay,az,gx,gy,gz", "0.01,0,0,9.8,0,0,0"
    lines = {
        "names": [names + "".join(f",c{k}" for k in range(100_000)), row + ",1" * 100_000],
        "rows": [names, row + ",1" * 200_000],
        "one row of digits": [names, "1" * 1_000_000],
    }[wide]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*lines, row]))
    with pytest.raises(LogError, match="no line of samples ends within its first 256 kB"):
        open_recording(path)
