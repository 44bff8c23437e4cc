"""Where no unit is left to trust, none is named, nothing is adopted, and it is reported first."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from redundancy_sets import PRIMARY, QUICK, SOUND, motion, record, typed, units

BEGINS, ENDS = 18.0, 21.0
"""s between which units go wrong, in motion."""
LIKE = replace(SOUND, name="imu2", accelerometer_bias=(-0.01, 0.02, 0.0), gyroscope_bias=(-0.001, 0.0, 0.001))
RANGE = 20.0
"""m/s^2."""


@pytest.fixture
def said():
    """Three units that agree, in motion from 6 to 27 s."""
    return record([PRIMARY, LIKE, SOUND], 51, motion(rest=6.0, moving=21.0, after=6.0))


def replayed(said, folder, *more):
    """Exit code, output, and events, of the command as typed."""
    paths = [unit.write(folder / f"{name}.csv") for name, unit in said.items()]
    done = typed("redundancy", *units(paths), *QUICK, *more, "-o", folder / "out")
    events = (folder / "out" / "events.jsonl").read_text("utf-8").splitlines()
    return done.code, " ".join(done.out.split()), [json.loads(line) for line in events]


def of_kind(events, kind):
    return [event for event in events if event["event"] == kind]


@pytest.mark.parametrize("seconds", [0.01, 3.0], ids=["jumps", "ramps"])
def test_three_units_with_three_faults_disagree_and_none_is_isolated(said, tmp_path, seconds):
    """Across gravity, and as far from each other as from the truth."""
    for number, unit in enumerate(said.values()):
        share = np.clip((unit.time - BEGINS) / seconds, 0.0, 1.0)
        angle = 2.0 * np.pi * number / 3.0
        unit.readings[:, :2] += np.outer(share, 0.8 * np.array([np.cos(angle), np.sin(angle)]))
    code, told, events = replayed(said, tmp_path)
    assert of_kind(events, "unhealthy") == []
    assert of_kind(events, "adopted") == []
    assert BEGINS < of_kind(events, "disagree")[0]["time"] < ENDS + 1.0
    assert {event["figures"]["reason"] for event in of_kind(events, "withheld")} == {"disputed"}
    assert code == 3
    assert "disagree since" in told.partition(" s replayed")[0]
    assert "% are degraded" in told.partition(" s replayed")[0]


@pytest.mark.parametrize("silence", [0.5, 4.0])
def test_silence_of_all_units_is_reported_as_no_fault_of_one(said, tmp_path, silence):
    ends = BEGINS + silence
    heard = {
        name: replace(unit, time=unit.time[kept], readings=unit.readings[kept])
        for name, unit in said.items()
        for kept in [~unit.between(BEGINS, ends)]
    }
    code, told, events = replayed(heard, tmp_path)
    assert code == 3
    since = re.match(r"No unit [a-z ]+ from (\d+\.\d\d) to", told)
    assert since is not None
    assert BEGINS - 0.02 < float(since[1]) < ends + 0.05
    assert {event["figures"]["reason"] for event in of_kind(events, "unhealthy")} <= {"late"}
    assert len({event["unit"] for event in of_kind(events, "unhealthy")}) in (0, 3)


def test_all_units_saturated_are_one_event_of_the_platform(said, tmp_path):
    for unit in said.values():
        unit.readings[unit.between(BEGINS, ENDS), 0] = RANGE
    ranges = [word for name in said for word in ("--set", f"units.{name}.specific_force_range={RANGE}")]
    _, told, events = replayed(said, tmp_path, *ranges)
    assert "are degraded: its source was wrong, contradicted, or lacks an axis" in told
    assert [event["figures"]["reason"] for event in of_kind(events, "selected")] == ["start"]
    assert [event["figures"] for event in of_kind(events, "all saturated")] == [{"sensor": "accelerometer"}]
    assert of_kind(events, "unhealthy") == of_kind(events, "disagree") == []


@pytest.mark.parametrize("others", [1, 2])
def test_silent_secondary_is_reported_with_evaluation_on_command(said, tmp_path, others):
    paths = [said[name].write(tmp_path / f"{name}.csv") for name in list(said)[:others]]
    silent = tmp_path / "imu9.csv"
    never = ("--allow-missing", "--set", "evaluate_every=none")
    done = typed("redundancy", *units([*paths, silent]), *never, "-o", tmp_path / "out")
    assert done.code == 3
    told = " ".join(done.out.split())
    assert told.startswith(f"{silent} was not calibrated (unhealthy: late (0.3")
