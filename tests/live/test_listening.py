"""Every live command reports with `--json` that its lines are open, before anything else."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest

from turntable_sessions import typed

RATE = 50.0


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Ten s at rest."""
    time = np.arange(500) / RATE
    rng = np.random.default_rng(5)
    force = [0.0, 0.0, 9.8] + 0.02 * rng.standard_normal((500, 3))
    rate = 0.001 * rng.standard_normal((500, 3))
    path = tmp_path_factory.mktemp("logs") / "imu.csv"
    np.savetxt(
        path,
        np.column_stack([time, force, rate]),
        delimiter=",",
        header="time [s],ax [m/s^2],ay [m/s^2],az [m/s^2],gx [rad/s],gy [rad/s],gz [rad/s]",
        comments="",
    )
    return path


@pytest.fixture(scope="module")
def calibration(tmp_path_factory):
    folder = tmp_path_factory.mktemp("unit")
    done = typed("simulate", "spin", "--seed", "3", "-o", folder / "robot")
    assert done.code == 0, done.err
    done = typed("spin", folder / "robot/spin.csv", "-o", folder / "out")
    assert done.code == 0, done.err
    return next((folder / "out").glob("*.yaml"))


COMMANDS = {
    "turntable": ["turntable", "--live", "reference={one}", "target={other}"],
    "multipose": ["multipose", "--live", "{one}"],
    "spin": ["spin", "--live", "{one}"],
    "redundancy": ["redundancy", "--live", "primary={one}", "secondary={other}"],
    "record": ["record", "a={one}", "b={other}"],
}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_first_event_says_that_lines_are_open(tmp_path, log, name):
    other = tmp_path / "other.csv"
    shutil.copy(log, other)
    one, other = (f"replay:{path}?speed=max" for path in (log, other))
    words = [word.format(one=one, other=other) for word in COMMANDS[name]]
    done = typed(*words, "-o", tmp_path / "out", "--json")
    assert json.loads(done.out.splitlines()[0])["event"] == "listening", done.err


@pytest.mark.parametrize("to", ["file", "stdout"])
def test_correcting_says_so_where_no_samples_go(tmp_path, log, calibration, to):
    place = tmp_path / "corrected.csv" if to == "file" else "stdout"
    words = ["apply", "--live", calibration, f"replay:{log}?speed=max", "--to", place, "--force", "--json"]
    done = typed(*words)
    assert done.code == 0, done.err
    said = done.out if to == "file" else done.err
    events = [json.loads(line) for line in said.splitlines() if line.startswith('{"event"')]
    assert [event["event"] for event in events] == ["listening"]
    if to == "stdout":
        assert all("ax" in json.loads(line) for line in done.out.splitlines())
