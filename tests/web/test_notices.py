"""The page names what is wrong with a log, or refuses it, in the sentences of the command."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from repetitions import SOAK, drawn_seed
from tumble.tools.simulate import simulate_multipose
from web_page import DATE, SECONDS, by_command, headless

RATE, HEAD = 100.0, "time,ax,ay,az,gx,gy,gz"
FORCE, GYROSCOPE = slice(1, 4), slice(4, 7)
UNIT = np.array([0.2, -0.1, 0.15, 0.02, -0.01, 0.015])
"""Biases by which another unit of the same log differs, m/s^2 and rad/s."""


@pytest.fixture(autouse=True)
def one_date(monkeypatch):
    """Has the command write the date that the page is given."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", SECONDS)


def table(seed):
    """Returns time, specific force and angular rate, (n, 7), and whether each row is at rest, (n,)."""
    hand = simulate_multipose(
        seed=seed,
        grade="consumer",
        orientations=20,
        bias_instability=False,
        g_sensitivity=False,
        latitude_deg=None,
        rate_hz=RATE,
    )
    samples = hand.unit.samples
    rows = np.column_stack([samples.time - samples.time[0], samples.accelerometer, samples.gyroscope])
    # Noise far above a step of the sensor: a coarse one shows no standstill.
    rng = np.random.default_rng(seed)
    rows[:, 1:] += rng.normal(0.0, [*3 * [0.02], *3 * [0.002]], (len(rows), 6))
    rests = np.zeros(len(rows), dtype=bool)
    for each in hand.session.rests:
        rests |= (samples.time >= each.start + 0.3) & (samples.time <= each.end - 0.3)
    return rows, rests


def repeated(rows, within, columns, seconds):
    """Repeats a reading from the middle of a stretch in which `within` holds for so long."""
    length = round(seconds * RATE)
    runs = np.convolve(within, np.ones(length), "valid") == length
    places = np.flatnonzero(runs)
    first = places[len(places) // 2]
    rows[first : first + length, columns] = rows[first, columns]


def frozen_gyroscope_at_rest(rows, rests):
    repeated(rows, rests, GYROSCOPE, 1.2)


def frozen_gyroscope_in_a_turn(rows, rests):
    repeated(rows, ~rests, GYROSCOPE, 0.6)


def frozen_accelerometer_at_rest(rows, rests):
    repeated(rows, rests, FORCE, 1.2)


def one_frozen_axis(rows, rests):
    repeated(rows, rests, [3], 1.5)


def all_frozen_in_a_turn(rows, rests):
    repeated(rows, ~rests, slice(1, 7), 0.6)


def all_frozen_at_rest(rows, rests):
    repeated(rows, rests, slice(1, 7), 1.0)


def end_of_the_range_in_turns(rows, rests):
    rows[:, GYROSCOPE] = np.clip(rows[:, GYROSCOPE], -1.5, 1.5)


def end_of_the_range_at_rest(rows, rests):
    rows[:, FORCE] = np.clip(rows[:, FORCE], -9.0, 9.0)


def coarse_accelerometer(rows, rests):
    rows[:, FORCE] = 0.1 * np.round(rows[:, FORCE] / 0.1)


def coarse_gyroscope(rows, rests):
    rows[:, GYROSCOPE] = 0.01 * np.round(rows[:, GYROSCOPE] / 0.01)


def gap_in_turns(rows, rests):
    turns = np.flatnonzero(~rests[1:] & rests[:-1])
    lost = np.concatenate([np.arange(turn + 20, turn + 90) for turn in turns[2:4]])
    return np.delete(rows, lost, axis=0)


def jump_of_time(rows, rests):
    rows[np.flatnonzero(~rests)[len(rows) // 8] :, 0] += 3.0


def readings_without_number(rows, rests):
    rows[np.arange(200, len(rows), 400), 5] = np.nan
    rows[np.arange(300, len(rows), 400), 2] = np.nan


def alternating_units(rows, rests):
    rows[1::2, 1:] += UNIT


def three_alternating_units(rows, rests):
    rows[1::3, 1:] += UNIT
    rows[2::3, 1:] -= UNIT


CHANGES = {
    frozen_gyroscope_at_rest: "gyroscope x is stuck at",
    frozen_gyroscope_in_a_turn: "gyroscope x is stuck at",
    frozen_accelerometer_at_rest: "accelerometer x is stuck at",
    one_frozen_axis: "accelerometer z is stuck at",
    all_frozen_in_a_turn: "what the gyroscope read then is not used",
    all_frozen_at_rest: "all readings stood still from",
    end_of_the_range_in_turns: "is at the end of its range in",
    end_of_the_range_at_rest: "is saturated at",
    coarse_accelerometer: "accelerometer x, y, z: a resolution of 0.1 m/s^2",
    coarse_gyroscope: "gyroscope x, y, z: a resolution of 0.01 rad/s",
    gap_in_turns: "what the gyroscope read then is not used",
    jump_of_time: "samples missing",
    readings_without_number: "without a number (ay ",
    alternating_units: "samples of 2 units take turns: the median of every second sample",
    three_alternating_units: "samples of 3 units take turns",
}
"""A part of what the command states by what is wrong with a log."""
HEADS = {
    "fs: 100\n": "rate of 100 Hz from the line 'fs' before the columns",
    "serial: 77\nfs: 50 Hz\n": "rate of 50 Hz from the line 'fs' before the columns",
    "corrected: by the logger\n": "the log was already corrected: this calibration holds",
}


def changed(seed, *changes):
    """Returns the table of a seed after changes, one after the other."""
    rows, rests = table(seed)
    for change in changes:
        others = change(rows, rests)
        rows = rows if others is None else others
        rests = np.resize(rests, len(rows))
    return rows


def written(path, rows, before="", columns=slice(0, 7)):
    head = ",".join(HEAD.split(",")[columns])
    np.savetxt(path, rows[:, columns], "%.6f", ",", header=before + head, comments="")
    return path


def compared(paths):
    """Yields what page and command make of each log."""
    jobs = [{"files": [str(path)], "read": {}, "date": DATE} for path in paths]
    for path, by_page in zip(paths, headless(jobs), strict=True):
        by_page.pop("exports", None)
        yield by_page, by_command(path, {})


def sentences(found):
    return [found["failure"]] if "failure" in found else found["warnings"]


def test_each_fault_of_a_log_is_named_as_by_the_command(tmp_path):
    seed = drawn_seed()
    paths = [written(tmp_path / f"{change.__name__}.csv", changed(seed, change)) for change in CHANGES]
    for (change, part), (by_page, expected) in zip(CHANGES.items(), compared(paths), strict=True):
        assert by_page == expected, change.__name__
        assert any(part in line for line in sentences(expected)), (change.__name__, expected)


def test_two_faults_of_a_log_are_named_as_by_the_command(tmp_path):
    seed = drawn_seed()
    pairs = list(itertools.permutations(CHANGES, 2))
    drawn = np.random.default_rng(seed).permutation(len(pairs))[: 60 if SOAK else 10]
    paths = [written(tmp_path / f"{k}.csv", changed(seed, *pairs[k])) for k in drawn]
    for k, (by_page, expected) in zip(drawn, compared(paths), strict=True):
        assert by_page == expected, [change.__name__ for change in pairs[k]]


def test_lines_before_the_columns_are_named_as_by_the_command(tmp_path):
    rows = changed(drawn_seed())
    paths = []
    for number, before in enumerate(HEADS):
        columns = slice(1, 7) if "fs" in before else slice(0, 7)
        paths.append(written(tmp_path / f"{number}.csv", rows, before, columns))
    for part, (by_page, expected) in zip(HEADS.values(), compared(paths), strict=True):
        assert by_page == expected, part
        assert any(part in line for line in sentences(expected)), (part, expected)


def test_a_log_without_gyroscope_is_named_as_by_the_command(tmp_path):
    path = written(tmp_path / "force.csv", changed(drawn_seed()), columns=slice(0, 4))
    ((by_page, expected),) = compared([path])
    assert by_page == expected
    assert any("nothing is said of the gyroscope" in line for line in expected["warnings"])


def test_counts_that_stood_still_are_named_as_by_the_command(tmp_path):
    rows = changed(drawn_seed(), all_frozen_at_rest)
    rows[:, FORCE] *= 1670.0
    rows[:, GYROSCOPE] *= 7500.0
    path = written(tmp_path / "counts.csv", rows)
    (by_page,) = headless([{"files": [str(path)], "read": {"raw": True}, "date": DATE}])
    by_page.pop("exports")
    expected = by_command(path, {"raw": True})
    assert by_page == expected
    assert any("all readings stood still from" in line for line in expected["warnings"])


SCALED = {
    "raw": ({"raw": True}, "[raw]", "raw: true"),
    "raw, stated otherwise": (
        {"raw": True, "accelerometerScale": 16384.0},
        "[g]",
        "accelerometer_unit: m/s^2",
    ),
    "no unit": ({"accelerometerScale": 1670.0, "gyroscopeScale": 7500.0}, "", "gyroscope_unit: rad/s"),
    "unit of the log": (
        {"accelerometerScale": 16377.0, "gyroscopeScale": 7500.0},
        "[g]",
        "accelerometer_unit: g",
    ),
}
"""Options of the page, a unit in the head of the log, and a part of what the calibration states."""


def test_scales_of_counts_are_stated_as_by_the_command(tmp_path):
    rows = changed(drawn_seed())
    rows[:, FORCE] *= 1670.0
    rows[:, GYROSCOPE] *= 7500.0
    jobs = []
    for number, (read, unit, _) in enumerate(SCALED.values()):
        path = written(tmp_path / f"{number}.csv", np.round(rows, 4))
        head, rest = path.read_text(encoding="utf-8").split("\n", 1)
        columns = [f"{name} {unit}" if unit and name.startswith("a") else name for name in head.split(",")]
        path.write_text(",".join(columns) + "\n" + rest, encoding="utf-8")
        jobs.append({"files": [str(path)], "read": read, "date": DATE})
    for name, job, by_page in zip(SCALED, jobs, headless(jobs), strict=True):
        by_page.pop("exports", None)
        expected = by_command(Path(job["files"][0]), job["read"])
        assert by_page == expected, name
        assert SCALED[name][2] in expected["text"], name
