"""A mistake of a user of Python is a `TumbleError` in one line, as that of a command is."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from log_fixtures import made_up, write
from tumble.foundation.errors import TumbleError
from tumble.foundation.recording import Recording

PROCEDURES = ("inspect", "noise", "thermal", "spin", "multipose", "magnetometer")
TIME, FORCE, RATE = np.arange(3.0), np.zeros((3, 3)), np.zeros((3, 3))
EMPTY = np.empty((0, 3))


def wrapped(name="x", time=TIME, **more):
    return Recording.from_arrays(name, time, *((FORCE, RATE) if len(time) else (EMPTY, EMPTY)), **more)


MISTAKES = {
    "no sample at rest": lambda log: tumble.noise(wrapped(time=[])),
    "no sample of a spin": lambda log: tumble.spin(wrapped(time=[])),
    "an infinite time": lambda log: wrapped(time=[0.0, 1.0, np.inf]),
    "a name that is none": lambda log: wrapped(name=None),
    "a serial number that is none": lambda log: wrapped(serial=None),
    "a serial number that is a number": lambda log: wrapped(serial=5),
    "a seed below zero": lambda log: tumble.simulate_multipose(seed=-1),
    "a seed that is text": lambda log: tumble.simulate_spin(seed="x"),
    "times that are text": lambda log: tumble.spin(log, at="x"),
    "times that are a number": lambda log: tumble.spin(log, at=5),
    "times without an end": lambda log: tumble.spin(log, at=[1]),
    "times of text": lambda log: tumble.spin(log, at=[("a", "b")]),
    "an output that is no name": lambda log: tumble.convert(log, "\0.csv"),
    "an output that is a number": lambda log: tumble.convert(log, 5),
    "a log that is a number": lambda log: tumble.convert(5, "x.csv"),
    "a file that is a number": lambda log: tumble.import_calibrations(5),
    "a calibration that is a number": lambda log: tumble.export(5, "px4"),
    "a correction that is a number": lambda log: tumble.apply(5, log, "x.csv"),
    "a start that is a number": lambda log: tumble.noise(log, calibration=5),
    "poses that are a number": lambda log: tumble.turntable(log, log, poses=5),
    "a pose without a direction": lambda log: tumble.Pose("x", [0, 0, 0]),
    "a pose of two numbers": lambda log: tumble.Pose("x", [1, 0]),
    "a pose of text": lambda log: tumble.Pose("x", "up"),
    "a pose without a name": lambda log: tumble.Pose(None, [0, 0, 1]),
    **{
        f"a log of {word} that is a number": lambda log, word=word: getattr(tumble, word)(5)
        for word in PROCEDURES
    },
    **{
        f"a log of {word} that is none": lambda log, word=word: getattr(tumble, word)(None)
        for word in PROCEDURES
    },
}


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return write(tmp_path_factory.mktemp("log") / "log.csv", made_up(3000))


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_python_is_one_line(mistake, log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(TumbleError) as caught:
        MISTAKES[mistake](log)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []
