"""A unit that was away for a pose has no tick there: the pose is asked for again, and the result names it."""

from __future__ import annotations

import json

import pytest
import yaml

from live_benches import simulated_bench, words_of
from tumble.live import open_set
from tumble.procedures.turntable.live import LiveTurntable
from tumble.tools.record import procedure as recording
from tumble.tools.record import silence
from tumble.tools.simulate.live.fault import LiveFault
from turntable_sessions import typed

HAND = {"motion": "six-faces", "rest_seconds": 6.0, "rate_hz": 50.0}


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    # A bench on a busy computer may pause for tenths of a second.
    monkeypatch.setattr(recording, "SILENT_AFTER", 1.0)
    monkeypatch.setattr(silence, "GONE_AFTER", 3.0)


def events_of(done):
    return [json.loads(line) for line in done.out.splitlines()]


def ticks(event):
    """Names of the poses that each unit has its tick at."""
    return {
        unit: [
            pose["name"]
            for pose in event["poses"]
            for each in pose["units"]
            if each["name"] == unit and each["done"]
        ]
        for unit in ("target_1", "target_2")
    }


def by_hand(*options):
    return ("turntable", "--live", *options, "--pose-seconds", "3s", "--no-turns", "--json")


def test_a_table_goes_once_more_where_a_unit_was_away(tmp_path):
    away = LiveFault("unplugged", start=20.0, end=40.0)
    with simulated_bench(seed=91, faults={"target_1": [away]}) as bench:
        done = typed(
            *("turntable", "--live", *words_of(bench), "--table", bench.table_address, "--armed"),
            *("--poses", "six-faces", "--no-turns", "--pose-seconds", "3s", "-o", tmp_path, "--json"),
        )
    events = events_of(done)
    # On a busy computer target_2 may be late for a pose of its own, to which the table goes again as well.
    missed = [
        each
        for each in events
        if each["event"] == "warning" and each["subject"] == "target_1" and "missed" in each["text"]
    ]
    assert missed
    poses = {each["text"].removeprefix("missed ").partition(":")[0] for each in missed}
    first = missed[0]
    assert poses.isdisjoint(ticks(first)["target_1"])
    [last] = [each for each in events if each["event"] == "done"]
    assert all(len(ticked) == 6 for ticked in ticks(last).values())
    visits = [each["subject"] for each in events if each["event"] == "pose done"]
    assert sorted(visits) == sorted(set(visits)), "a pose is ticked when the last unit has shown it"
    found = yaml.safe_load((tmp_path / "target_1.yaml").read_text())
    assert "poses missed by target_1" not in found["method"]["options"]


def test_an_end_before_a_unit_returns_names_the_poses_it_missed(tmp_path):
    away = LiveFault("unplugged", start=25.0, end=1e6)
    with simulated_bench(faults={"target_1": [away]}, seed=92, **HAND) as bench:
        done = typed(*by_hand(*words_of(bench)), "-o", tmp_path)
    assert done.code == 3, done.err
    [early] = [each for each in events_of(done) if each["event"] == "ended early"]
    lacking = [pose["name"] for pose in early["poses"] if not pose["done"]]
    assert lacking
    assert ticks(early)["target_2"] == [pose["name"] for pose in early["poses"]]
    assert "target_1 missed " in early["text"]
    assert all(name in early["text"].partition("target_1 missed ")[2] for name in lacking)
    found = yaml.safe_load((tmp_path / "target_2.yaml").read_text())
    said = found["method"]["options"]["poses missed by target_1"]
    assert all(name in said for name in lacking)


def test_a_session_that_goes_on_knows_what_each_unit_has_shown(tmp_path):
    def led(bench, **options):
        units = open_set(words_of(bench), keep_going=True)
        return LiveTurntable(
            units, tmp_path, sources=bench.addresses, turns=False, pose_seconds=3.0, **options
        )

    away = LiveFault("unplugged", start=15.0, end=30.0)
    with simulated_bench(faults={"target_1": [away]}, seed=93, **HAND) as bench:
        steps = list(led(bench).steps())
        resumed = led(bench, resume=True)
    lacking = {pose.name for pose in steps[-1].poses if not pose.done}
    assert lacking
    assert {pose.name for pose in resumed.guide.poses if "target_1" in pose.lacking} == lacking
    assert all("target_2" not in pose.lacking for pose in resumed.guide.poses)
    assert resumed.guide.wanted.name in lacking
    assert resumed.missed.startswith("target_1 missed ")


@pytest.mark.parametrize("unit", ["target_1", "target_2"])
def test_a_frozen_unit_has_no_tick_for_what_it_repeated(unit, tmp_path):
    frozen = LiveFault("frozen", start=12.0, end=40.0)
    with simulated_bench(faults={unit: [frozen]}, seed=94, **HAND) as bench:
        done = typed(*by_hand(*words_of(bench)), "-o", tmp_path)
    [early] = [each for each in events_of(done) if each["event"] == "ended early"]
    other = {"target_1": "target_2", "target_2": "target_1"}[unit]
    assert len(ticks(early)[other]) == 6
    assert len(ticks(early)[unit]) < 6
