"""Cases of a simulator that is not ours: findings in motion are wrong, and rest, or time, shows it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from redundancy_sets import of
from turntable_sessions import typed

FOLDER = Path(__file__).parents[3] / "shared" / "data" / "cases"

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the cases in ../shared/data are not here")


def flown(case, folder, *more, units=3):
    """Exits code and events of a case, as typed."""
    logs = [FOLDER / case / f"u{number}.parquet" for number in range(units)]
    secondaries = [word for log in logs[1:] for word in ("--secondary", log)]
    done = typed("redundancy", "--primary", logs[0], *secondaries, *more, "-o", folder / "out")
    text = (folder / "out" / "events.jsonl").read_text("utf-8")
    return done, [json.loads(line) for line in text.splitlines()]


def with_settings(case):
    return ("--settings", FOLDER / case / "units.yaml")


def adopted(events, unit, sensor):
    return [each for each in of(events, unit, "adopted") if each["figures"]["sensor"] == sensor]


def named(events, unit):
    return [(each["time"], each["figures"]["reason"]) for each in of(events, unit, "unhealthy")]


def sources(events):
    return [
        (each["time"], each["unit"], each["figures"]["reason"])
        for each in events
        if each["event"] == "selected"
    ]


def test_secondaries_that_aged_between_flights_are_calibrated_again(tmp_path):
    for flight in ("first", "second"):
        (tmp_path / flight).mkdir()
        case = f"aged_n3/{flight}"
        done, events = flown(case, tmp_path / flight, *with_settings(case), "--store", tmp_path / "store")
    assert done.code == 0
    for unit in ("u1", "u2"):
        assert len(adopted(events, unit, "accelerometer")) == 1
    assert [named(events, unit) for unit in ("u0", "u1", "u2")] == [[], [], []]
    assert [each for each in events if each["event"] == "disagree"] == []


def test_secondary_replaces_a_frozen_primary_within_half_a_second(tmp_path):
    _, events = flown("frozen_n2_50hz", tmp_path, *with_settings("frozen_n2_50hz"), units=2)
    assert named(events, "u1") == []
    time, unit, _ = sources(events)[-1]
    assert unit == "u1"
    assert 94.5 < time < 95.0


def test_a_jump_in_strong_vibration_is_named_within_half_a_second(tmp_path):
    _, events = flown("vibration_n3", tmp_path, *with_settings("vibration_n3"))
    ((time, reason),) = named(events, "u0")
    assert reason == "out of family"
    assert 80.0 < time < 80.5
    assert [named(events, unit) for unit in ("u1", "u2")] == [[], []]


def test_vote_of_two_with_a_common_shift_is_reversed_at_the_next_rest(tmp_path):
    _, events = flown("alike_n3", tmp_path, *with_settings("alike_n3"))
    time, unit, _ = sources(events)[-1]
    assert unit == "u0"
    assert 174.0 < time < 180.0
    for unit in ("u1", "u2"):
        assert 174.0 < named(events, unit)[-1][0] < 180.0


def test_secondary_at_fault_by_its_gyroscope_learns_no_primary_error(tmp_path):
    _, events = flown("own_gyroscope_n2", tmp_path, *with_settings("own_gyroscope_n2"), units=2)
    assert [each["time"] for each in adopted(events, "u1", "accelerometer") if each["time"] > 46.5] == []


def test_begun_in_motion_a_gyroscope_that_jumps_is_named(tmp_path):
    _, events = flown("in_motion_n3", tmp_path, "--gyroscope-unit", "rad/s")
    ((time, reason),) = named(events, "u0")
    assert reason == "out of family"
    assert 75.0 < time < 76.0


def with_temperature(case, folder, kelvins, constant):
    """Logs of a case with the temperature that its truth states, as its units would have measured it."""
    logs = []
    for number in range(3):
        table = pq.read_table(FOLDER / case / f"u{number}.parquet")
        warmth = -kelvins * np.expm1(-1e-6 * table["time_us"].to_numpy() / constant)
        logs.append(folder / f"u{number}.parquet")
        pq.write_table(
            table.append_column("temperature", pa.array((20.0 + warmth).astype(np.float32))), logs[-1]
        )
    return logs


def test_units_that_tell_that_they_warm_up_by_25_k_are_sound(tmp_path):
    logs = with_temperature("warmup_n3", tmp_path, 25.0, 120.0)
    secondaries = [word for log in logs[1:] for word in ("--secondary", log)]
    given = ("--primary", logs[0], *secondaries, *with_settings("warmup_n3"))
    done = typed("redundancy", *given, "-o", tmp_path / "out")
    text = (tmp_path / "out" / "events.jsonl").read_text("utf-8")
    events = [json.loads(line) for line in text.splitlines()]
    assert done.code == 0
    assert [named(events, unit) for unit in ("u0", "u1", "u2")] == [[], [], []]
    assert [unit for _, unit, _ in sources(events)] == ["u0"]
    assert [each for each in events if each["event"] == "disagree"] == []


def test_units_that_warm_up_are_not_named_where_none_tells_how_warm(tmp_path):
    done, events = flown("warmup_n3", tmp_path, *with_settings("warmup_n3"))
    assert done.code == 0, done.err
    assert [each for each in events if each["event"] in ("unhealthy", "disagree")] == []
    assert [each["unit"] for each in events if each["event"] == "selected"] == ["u0"]
