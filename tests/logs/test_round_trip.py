"""Written samples are read back equal, float by float."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from log_fixtures import join, made_up, read, same, write
from tumble.foundation.errors import OutputError
from tumble.foundation.recording import Chunk
from tumble.logs import Facts, ReadOptions, open_recording, open_writer

FORMATS = ["csv", "parquet", "mcap"]
SI = ReadOptions(accelerometer_unit="m/s^2", gyroscope_unit="rad/s", time_unit="s")


@st.composite
def chunks(draw):
    """Finite floats, accelerations that no resting sensor reads in g or mg, times on whole nanoseconds.

    Temperatures are those that an IMU may have.
    """
    count = draw(st.integers(1, 30))
    finite = st.floats(-1e6, 1e6, allow_subnormal=True)
    step = draw(st.lists(st.integers(1, 10**12), min_size=count, max_size=count))
    time = np.cumsum(step) / 1e9
    rates = draw(st.lists(finite, min_size=3 * count, max_size=3 * count))
    warm = draw(st.lists(st.floats(-80.0, 200.0), min_size=count, max_size=count))
    size = draw(st.lists(st.floats(20.0, 400.0), min_size=3 * count, max_size=3 * count))
    sign = draw(st.sampled_from([-1.0, 1.0]))
    return Chunk(
        time, sign * np.array(size).reshape(count, 3), np.array(rates).reshape(count, 3), np.array(warm)
    )


@pytest.mark.parametrize("name", FORMATS)
@settings(max_examples=40)
@given(chunk=chunks())
def test_every_float_comes_back_as_it_was_written(tmp_path_factory, name, chunk):
    path = write(tmp_path_factory.mktemp("round") / f"log.{name}", chunk)
    assert same(read(path, SI), chunk)


@pytest.mark.parametrize("name", FORMATS)
def test_times_from_1970_keep_all_their_digits(tmp_path, name):
    random = np.random.default_rng(5)
    time = np.sort(1.7e9 + random.uniform(0.0, 1000.0, 5000))
    chunk = made_up(5000)
    chunk = Chunk(
        np.unique(time), *[part[: len(np.unique(time))] for part in (chunk.accelerometer, chunk.gyroscope)]
    )
    assert same(read(write(tmp_path / f"log.{name}", chunk)), chunk)


@pytest.mark.parametrize("name", FORMATS)
def test_many_chunks_read_as_one_recording(tmp_path, name):
    whole = made_up(70_000)
    pieces = np.array_split(np.arange(70_000), 7)
    path = tmp_path / f"log.{name}"
    with open_writer(path) as writer:
        for piece in pieces:
            writer.write(
                Chunk(
                    whole.time[piece],
                    whole.accelerometer[piece],
                    whole.gyroscope[piece],
                    whole.temperature[piece],
                )
            )
    recording = open_recording(path)
    found = list(recording.chunks())
    assert len(found) > 1
    if name == "mcap":  # its stamps are whole nanoseconds
        np.testing.assert_allclose(join(found).time, whole.time, rtol=0.0, atol=0.51e-9)
        whole = replace(whole, time=join(found).time)
    assert same(join(found), whole)
    assert same(join(list(recording.chunks())), join(found))
    assert all(
        chunk.accelerometer.flags.c_contiguous and chunk.gyroscope.flags.c_contiguous for chunk in found
    )


@pytest.mark.parametrize("serial", ["SN 7", "a,b", "=1", "x;y", "a: b", "7", "#3"])
@pytest.mark.parametrize("name", FORMATS)
def test_serial_and_correction_are_known_to_the_next_reader(tmp_path, name, serial):
    chunk = made_up(300)
    plain = open_recording(write(tmp_path / f"plain.{name}", chunk)).metadata
    marked = open_recording(
        write(tmp_path / f"marked.{name}", chunk, serial=serial, corrected="sha256:ab")
    ).metadata
    assert (plain.serial, plain.already_corrected) == ("", None)
    assert (marked.serial, marked.already_corrected) == (serial, True)
    assert marked.reading["correction"] == "sha256:ab"


def test_an_mcap_keeps_the_frame(tmp_path):
    path = write(tmp_path / "log.mcap", made_up(10), frame="imu_link")
    assert open_recording(path).metadata.frame == "imu_link"


def test_an_mcap_refuses_times_its_stamps_cannot_hold(tmp_path):
    with pytest.raises(OutputError, match="write CSV or Parquet instead"):
        write(tmp_path / "log.mcap", made_up(10, start=-5.0))


def test_a_failed_write_leaves_what_was_there(tmp_path):
    path = tmp_path / "log.csv"
    write(path, made_up(5))
    before = path.read_text()

    def write_and_fail():
        with open_writer(path, facts=Facts()) as writer:
            writer.write(made_up(10))
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_and_fail()
    assert path.read_text() == before
    assert list(tmp_path.iterdir()) == [path]


def test_missing_folder_is_reported(tmp_path):
    with pytest.raises(OutputError, match="does not exist"):
        write(tmp_path / "nowhere" / "log.csv", made_up(10))


def test_an_unknown_extension_is_refused_unless_a_format_is_named(tmp_path):
    with pytest.raises(OutputError, match="--format"):
        write(tmp_path / "log.xyz", made_up(10))
    with open_writer(tmp_path / "log.xyz", "csv") as writer:
        writer.write(made_up(10, temperature=False))
    assert same(read(tmp_path / "log.xyz", SI), made_up(10, temperature=False))


def peak_memory(path):
    """Peak memory, in MB, of a process that reads a log from beginning to end."""
    program = (
        "import resource, sys\n"
        "from tumble.logs import open_recording\n"
        "for chunk in open_recording(sys.argv[1]).chunks(): pass\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(path)], capture_output=True, text=True, check=True
    )
    return float(done.stdout)


@pytest.mark.parametrize("name", ["csv", "parquet"])
def test_a_longer_recording_takes_no_more_memory(tmp_path, name):
    piece = made_up(100_000)
    for pieces in (2, 14):
        with open_writer(tmp_path / f"{pieces}.{name}") as writer:
            for number in range(pieces):
                writer.write(replace(piece, time=piece.time + 1000.0 * number))
    short, long = (peak_memory(tmp_path / f"{pieces}.{name}") for pieces in (2, 14))
    assert long < 1.2 * short
