"""A live session reports at once which unit is in trouble, and the remedy."""

from __future__ import annotations

import json

import numpy as np
import pytest

from live_benches import simulated_bench, words_of
from tumble.tools.record import procedure as recording
from tumble.tools.record import silence
from tumble.tools.simulate import Fault
from tumble.tools.simulate.live.fault import LiveFault
from turntable_sessions import columns, simulate, typed, write_table

TWICE = tuple(f"{axis} {way}" for _ in range(2) for axis in "XYZ" for way in ("up", "down"))


def events_of(done):
    return [json.loads(line) for line in done.out.splitlines()]


def warnings_of(done):
    """(unit, text) of each warning."""
    return [(each["subject"], each["text"]) for each in events_of(done) if each["event"] == "warning"]


def by_hand(monkeypatch, output, fault, unit="target_1", **changes):
    """Output of a session on units that a hand turns, with a fault of one of them."""
    monkeypatch.setattr(recording, "SILENT_AFTER", 0.3)
    monkeypatch.setattr(silence, "GONE_AFTER", 3.0)
    options = {"seed": 81, "motion": "six-faces", "rest_seconds": 6.0, "rate_hz": 50.0, **changes}
    with simulated_bench(faults={unit: [fault]}, **options) as bench:
        return session(words_of(bench), output)


def session(words, folder):
    return typed(
        *("turntable", "--live", *words, "--pose-seconds", "3s", "--no-turns", "-o", folder, "--json")
    )


def replayed(folder, session, change=lambda tables: None):
    """Words that replay a simulated session, its tables changed, as fast as they can be read."""
    tables = {unit.name: columns(unit.samples) for unit in session.units}
    change(tables)
    paths = {name: write_table(folder / f"{name}.csv", table) for name, table in tables.items()}
    return [f"{name}=replay:{path}?speed=max" for name, path in paths.items()]


def test_unit_without_datagrams_is_reported_silent_while_others_run(tmp_path, monkeypatch):
    done = by_hand(monkeypatch, tmp_path / "out", LiveFault("unplugged", start=15.0, end=70.0))
    unit, text = next(each for each in warnings_of(done) if "silent" in each[1])
    assert unit == "target_1"
    assert text == "is silent; check its power and cable, and that it sends to this address"
    assert events_of(done)[-1]["event"] == "result"


def test_removed_line_is_reported_lost_and_then_back(tmp_path, monkeypatch):
    fault = LiveFault("unplugged", start=15.0, end=35.0)
    done = by_hand(monkeypatch, tmp_path / "out", fault, transport="tcp", folder=tmp_path)
    texts = [text for unit, text in warnings_of(done) if unit == "target_1"]
    assert any(text.startswith("was lost (target_1: tcp://") for text in texts), texts
    assert events_of(done)[-1]["event"] == "result"


@pytest.mark.parametrize("frozen", ["reference", "target_1"])
def test_a_unit_that_froze_is_named_as_soon_as_another_one_moves(tmp_path, monkeypatch, frozen):
    fault = LiveFault("frozen", start=12.0, end=60.0)
    done = by_hand(monkeypatch, tmp_path / "out", fault, unit=frozen)
    found = [each for each in warnings_of(done) if "is frozen" in each[1]]
    assert {unit for unit, _ in found} == {frozen}


def test_bytes_damaged_on_the_way_cost_samples_and_raise_nothing(tmp_path, monkeypatch):
    fault = LiveFault("garbled", start=5.0, end=70.0, size=0.01)
    done = by_hand(monkeypatch, tmp_path / "out", fault)
    assert done.code in (0, 3), done.err
    events = events_of(done)
    # A pose of which most was lost is asked for again, and this hand does not go there again.
    assert events[-1]["event"] == "result"
    assert events[-2]["event"] == "done" or "target_1 missed" in events[-2]["text"]


def test_too_small_a_range_is_reported_as_saturated(tmp_path):
    saturated = {"target_1": [Fault("saturated", triad="accelerometer", size=0.8)]}
    words = replayed(tmp_path, simulate(82, grades=["tactical"], rate_hz=50.0, faults=saturated))
    done = session(words, tmp_path / "out")
    found = [each for each in warnings_of(done) if "is saturated at" in each[1]]
    assert found
    assert {unit for unit, _ in found} == {"target_1"}
    assert all("choose a larger range" in text for _, text in found)


def test_two_units_swapped_between_rounds_are_both_named(tmp_path):
    made = simulate(83, grades=["tactical", "tactical"], rate_hz=50.0, visits=TWICE, clocks="shared")

    def exchanged(tables):
        one, other = tables["target_1"], tables["target_2"]
        half = len(one) // 2
        one[half:, 1:], other[half:, 1:] = other[half:, 1:].copy(), one[half:, 1:].copy()

    done = session(replayed(tmp_path, made, exchanged), tmp_path / "out")
    swapped = {unit for unit, text in warnings_of(done) if "plugs of the two were exchanged" in text}
    assert swapped == {"target_1", "target_2"}


def test_plugs_exchanged_within_one_round_are_named(tmp_path):
    made = simulate(85, grades=["tactical", "tactical"], rate_hz=50.0, clocks="shared")

    def exchanged(tables):
        one, other = tables["target_1"], tables["target_2"]
        half = len(one) // 2
        one[half:, 1:], other[half:, 1:] = other[half:, 1:].copy(), one[half:, 1:].copy()

    done = session(replayed(tmp_path, made, exchanged), tmp_path / "out")
    named = {unit for unit, text in warnings_of(done) if "were exchanged before" in text}
    assert named == {"target_1", "target_2"}
    assert not any("loose" in text or "other axes" in text for _, text in warnings_of(done))


@pytest.mark.parametrize("angle", [1.0, 5.0])
def test_a_unit_that_moved_in_its_fixture_between_two_rounds_is_named(tmp_path, angle):
    made = simulate(84, grades=["tactical", "tactical"], rate_hz=50.0, visits=TWICE)

    def moved(tables):
        table = tables["target_2"]
        half, tilt = len(table) // 2, np.radians(angle)
        turn = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
        for triad in (slice(1, 4), slice(4, 7)):
            table[half:, triad] = table[half:, triad] @ turn.T

    done = session(replayed(tmp_path, made, moved), tmp_path / "out")
    loose = {unit for unit, text in warnings_of(done) if "is loose" in text}
    assert loose == {"target_2"}
