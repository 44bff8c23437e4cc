"""Readings that are the same to the bit count once: a log and its copy, a pose given twice."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import turntable_sessions
from calibrated_commands import SEVERAL, write_log
from log_fixtures import made_up, write
from made_up_calibrations import made_up as made_up_calibration
from tumble.foundation.recording import Chunk
from tumble.logs import open_recording
from tumble.logs.beginning import Beginning
from tumble.tools.simulate import simulate_thermal, write_thermal
from turntable_sessions import one_line, typed


@pytest.fixture(scope="module")
def given_twice(tmp_path_factory):
    """A file of each command that takes several of one unit, by what it takes."""
    folder = tmp_path_factory.mktemp("once")
    made_up_calibration("SN-1").save(folder / "unit.yaml")
    log = write_thermal(simulate_thermal(duration=1800.0), folder)["log"]
    return {"calibrations": folder / "unit.yaml", "logs": log}


@pytest.mark.parametrize("command", SEVERAL)
@pytest.mark.parametrize("is_copied", [False, True])
def test_a_file_and_its_copy_do_not_count_twice(command, is_copied, given_twice, tmp_path):
    path = given_twice[SEVERAL[command]]
    second = shutil.copy(path, tmp_path / f"copy{path.suffix}") if is_copied else path
    done = typed(command, path, second, "-o", tmp_path / "out")
    assert done.code == 2, done.out
    assert "the same to the bit, and would count twice; leave one out" in one_line(done.err)


@pytest.mark.parametrize("command", ["multipose", "turntable"])
def test_a_pose_and_its_copy_do_not_count_twice(command, tmp_path):
    session = turntable_sessions.simulate(5)
    folders = [
        turntable_sessions.write_poses(session, unit, tmp_path / unit) for unit in ("reference", "target_1")
    ]
    shutil.copy(folders[0] / "x_up.csv", folders[0] / "x_down.csv")
    done = typed(command, *(folders if command == "turntable" else folders[:1]), "-o", tmp_path / "out")
    assert done.code == 2, done.out
    assert "x_down and x_up read the same to the bit" in one_line(done.err)


def appended(chunk):
    """The samples, and then the same again with later stamps."""
    later = chunk.time[-1] - chunk.time[0] + 0.005
    return Chunk(
        np.concatenate([chunk.time, chunk.time + later]),
        *(np.concatenate([triad, triad]) for triad in (chunk.accelerometer, chunk.gyroscope)),
    )


@pytest.mark.parametrize("ending", ["csv", "parquet", "mcap"])
@pytest.mark.parametrize("command", ["noise", "inspect", "convert", "apply"])
def test_a_log_that_was_appended_to_itself_is_named(command, ending, tmp_path):
    log = write(tmp_path / f"log.{ending}", appended(made_up(1500, temperature=False)))
    made_up_calibration("").save(tmp_path / "unit.yaml")
    words = {
        "noise": (log, "-o", tmp_path / "out"),
        "inspect": (log,),
        "convert": (log, "-o", tmp_path / "again.csv"),
        "apply": (tmp_path / "unit.yaml", log, "-o", tmp_path / "true.csv"),
    }
    done = typed(command, *words[command])
    assert done.code in (0, 3), done.err
    assert "first readings come again to the bit at 7.5 s" in " ".join((done.out + done.err).split())


@given(st.lists(st.integers(1, 700), min_size=1, max_size=12), st.integers(101, 800))
@settings(max_examples=50, deadline=None)
def test_a_repetition_is_found_however_samples_are_cut(sizes, count):
    whole = appended(made_up(count, temperature=False))
    beginning, start = Beginning(), 0
    ends = np.append(np.minimum(np.cumsum(sizes), len(whole)), len(whole))
    for end in np.unique(ends):
        part = slice(start, int(end))
        beginning.add(Chunk(whole.time[part], whole.accelerometer[part], whole.gyroscope[part]))
        start = int(end)
    assert beginning.again is not None
    # A repetition that begins in the chunk before is stamped with the first sample of its own.
    assert whole.time[count] <= beginning.again < whole.time[count] + 0.5


def test_a_log_without_a_repetition_is_not_named(tmp_path):
    sound = made_up(3000)
    coarse = replace(sound, accelerometer=np.round(sound.accelerometer), gyroscope=np.round(sound.gyroscope))
    for name, chunk in (("sound", sound), ("coarse", coarse)):
        stream = open_recording(write(tmp_path / f"{name}.csv", chunk)).chunks()
        list(stream)
        assert stream.counts.beginning.again is None


def test_two_logs_of_one_unit_are_both_used(tmp_path):
    logs = [write_log(tmp_path / f"{name}.csv", "SN-1") for name in "ab"]
    rows = np.loadtxt(logs[1], delimiter=",", skiprows=2)
    rows[:, 1:7] += np.random.default_rng(7).normal(0.0, 1e-6, (len(rows), 6))
    head = "time,ax,ay,az,gx,gy,gz,mx,my,mz,temperature"
    np.savetxt(logs[1], rows, delimiter=",", header=head, comments="", fmt="%.12g")
    assert typed("noise", *logs, "-o", tmp_path / "out").code in (0, 3)
