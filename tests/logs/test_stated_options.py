"""An option that states something of a log goes before all that its reader knows or guesses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import format_fixtures as formats
from bag_fixtures import write_mcap, write_ros1, write_ros2
from log_fixtures import made_up, read, write, write_text
from tumble.foundation.errors import LogError
from tumble.logs import ReadOptions, open_recording

RATE = 100.0


LOGS = {
    name: lambda folder, chunk, make=make: make(folder, chunk)[:2] for name, make in formats.WRITERS.items()
} | {
    name: lambda folder, chunk, make=make: (make(folder, chunk), ReadOptions())
    for name, make in {
        "csv without units": lambda folder, chunk: write_text(folder / "log.csv", chunk),
        "csv with units": lambda folder, chunk: write_text(
            folder / "log.csv", chunk, header="time_s,ax_mps2,ay_mps2,az_mps2,gx_radps,gy_radps,gz_radps"
        ),
        "csv without names": lambda folder, chunk: write_text(folder / "log.csv", chunk, header=None),
        "csv of ours": lambda folder, chunk: write(folder / "log.csv", chunk),
        "parquet of ours": lambda folder, chunk: write(folder / "log.parquet", chunk),
        "mcap of ours": lambda folder, chunk: write(folder / "log.mcap", chunk),
        "ros1": lambda folder, chunk: write_ros1(folder / "log.bag", {"/imu": chunk}),
        "ros2": lambda folder, chunk: write_ros2(folder / "log", {"/imu": chunk}),
        "mcap": lambda folder, chunk: write_mcap(folder / "log.mcap", {"/imu": chunk}),
    }.items()
}


@pytest.fixture
def chunk():
    return made_up(400, rate=RATE, start=1.7e9, temperature=False)


def opened(log, **options):
    """Returns a recording, or nothing where the reader refuses the option in a line."""
    path, needed = log
    try:
        return open_recording(path, replace(needed, interpolate=True, **options))
    except LogError:
        return None


@pytest.mark.parametrize("log", LOGS)
@pytest.mark.parametrize(
    ("option", "units"),
    [("gyroscope_unit", ("rad/s", "deg/s", "mdeg/s")), ("accelerometer_unit", ("m/s^2", "g", "mg"))],
)
def test_a_stated_unit_is_taken_or_refused(tmp_path, chunk, log, option, units):
    made = LOGS[log](tmp_path, chunk)
    taken = 0
    for unit in units:
        recording = opened(made, **{option: unit})
        if recording is not None:
            found = getattr(recording.metadata, option)
            assert (found.name, found.reason.split(",")[0]) == (unit, "option")
            taken += 1
    assert taken


@pytest.mark.parametrize("log", LOGS)
def test_a_stated_rate_makes_the_times(tmp_path, chunk, log):
    recording = opened(LOGS[log](tmp_path, chunk), rate=50.0)
    time = np.concatenate([each.time for each in recording.chunks()])
    assert np.allclose(np.diff(time), 0.02)


@pytest.mark.parametrize("log", [name for name in LOGS if name.startswith(("csv", "parquet"))])
def test_stated_columns_are_read_and_no_others(tmp_path, chunk, log):
    path, _ = LOGS[log](tmp_path, chunk)
    names = ("gx", "gy", "gz", "ax", "ay", "az")
    swapped = {name: str(number) for number, name in enumerate(names, start=2)}
    options = ReadOptions(columns={"time": "1", **swapped}, as_numbers=True, time_unit="s")
    found = read(path, options)
    assert np.array_equal(found.gyroscope, chunk.accelerometer)
    assert np.array_equal(found.accelerometer, chunk.gyroscope)
