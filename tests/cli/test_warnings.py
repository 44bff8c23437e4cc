"""Degenerate logs end in a result or in one line, and never in warnings of numpy or pandas."""

import warnings

import numpy as np
import pytest

from repetitions import by_turns
from turntable_sessions import typed

RATE, COUNT = 100.0, 3000


def triads(name):
    """Specific force and angular rate, (n, 3) each, of a log that no sound sensor writes."""
    random = np.random.default_rng(7)
    force = random.normal([0.0, 0.0, 9.8], 0.02, (COUNT, 3))
    turns = random.normal(0.0, 0.01, (COUNT, 3))
    still = np.zeros((COUNT, 3))
    middle = np.arange(COUNT)[:, np.newaxis] == COUNT // 2
    return {
        "sound": (force, turns),
        "constant": (still + np.array([0.0, 0.0, 9.8]), still),
        "zeros": (still, still),
        "one": (force[:1], turns[:1]),
        "two": (force[:2], turns[:2]),
        "huge": (still + 1e300, still + 1e300),
        "tiny": (still + 1e-300, still + 1e-300),
        "one huge force": (np.where(middle, 1e300, force), turns),
        "one huge rate": (force, np.where(middle, 1e300, turns)),
        "gaps": (np.where(random.random((COUNT, 3)) < 0.3, np.nan, force), turns),
        "saturated": (force, np.clip(1e3 * turns, -1.0, 1.0)),
    }[name]


def log(path, name, scale=1.0):
    force, turns = triads(name)
    time = scale * np.arange(len(force)) / RATE
    rows = np.column_stack([time, force, turns])
    np.savetxt(path, rows, delimiter=",", header="time,ax,ay,az,gx,gy,gz", comments="", fmt="%.17g")
    return path


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Each log, by the name of what is wrong with it."""
    folder = tmp_path_factory.mktemp("logs")
    return {name: log(folder / f"{name}.csv", name) for name in ("sound", *NAMES)}


COMMANDS = {
    "inspect": lambda log, sound, out: ("inspect", log),
    "convert": lambda log, sound, out: ("convert", log, "-o", out / "log.parquet"),
    "noise": lambda log, sound, out: ("noise", log, "-o", out),
    "thermal": lambda log, sound, out: ("thermal", log, "-o", out),
    "multipose": lambda log, sound, out: ("multipose", log, "-o", out),
    "spin": lambda log, sound, out: ("spin", log, "-o", out),
    "turntable": lambda log, sound, out: ("turntable", sound, log, "-o", out),
    "redundancy": lambda log, sound, out: ("redundancy", "--primary", sound, "--secondary", log, "-o", out),
}
NAMES = (
    *("constant", "zeros", "one", "two", "huge", "tiny", "one huge force", "one huge rate", "gaps"),
    "saturated",
)


UNITS = ((), ("--accelerometer-unit", "m/s^2", "--gyroscope-unit", "rad/s"))
CASES = [
    (command, name, units)
    for place, command in enumerate(COMMANDS)
    for number, name in enumerate(NAMES)
    # Each command meets each log once, its units stated or not by turns; both ways in `make soak`.
    for units in by_turns(UNITS, place + number, 2)
]


@pytest.mark.parametrize(("command", "name", "units"), CASES)
def test_a_degenerate_log_brings_no_warning_of_a_library(tmp_path, logs, command, name, units):
    (tmp_path / "out").mkdir()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        done = typed(*COMMANDS[command](logs[name], logs["sound"], tmp_path / "out"), *units)
    assert [f"{each.filename}:{each.lineno}: {each.message}" for each in caught] == []
    assert done.code in (0, 2, 3)
    assert "Warning" not in done.err
    if done.code == 2:
        assert len(done.err.splitlines()) == 1


@pytest.mark.parametrize("scale", [1e290, 1e-290, 0.0])
def test_absurd_times_bring_no_warning_of_a_library(tmp_path, scale):
    path = log(tmp_path / "log.csv", "sound", scale)
    for command in ("inspect", "noise"):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            done = typed(*COMMANDS[command](path, path, tmp_path / "out"))
        assert [f"{each.filename}:{each.lineno}: {each.message}" for each in caught] == []
        assert done.code in (0, 2, 3)
