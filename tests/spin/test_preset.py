"""Duration, speed and angle of the turn, preset for a log as for a live robot."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_sessions import record, still, turn
from tumble.foundation.errors import ProcedureError
from tumble.procedures.spin.preset import LARGEST_DEPARTURE, TurnPreset
from turntable_sessions import typed

FULL = 2.0 * math.pi


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Six seconds of rest, then two turns at 1 rad/s."""
    path = tmp_path_factory.mktemp("preset") / "robot.csv"
    record([still(6.0), turn(2.0), still(2.0)], seed=41).write(path)
    return path


def test_a_turn_as_it_was_preset_is_no_remark(log, tmp_path):
    ran = typed(
        "spin", log, "-o", tmp_path, "--turns", 2, "--turn-rate", 1, "--spin-duration", "13s", "--json"
    )
    assert ran.code == 0, ran.err
    spoken = json.loads(ran.out)
    assert not [line for line in spoken["spins"][0]["warnings"] if "preset" in line]
    assert spoken["options"]["spin-duration"] == 13.0
    assert (spoken["options"]["turn-rate"], spoken["options"]["turns"]) == (1.0, 2.0)


def test_departures_from_the_preset_are_on_screen_page_and_in_json(log, tmp_path):
    preset = ("--turn-rate", 0.5, "--spin-duration", "30s")
    ran = typed("spin", log, "-o", tmp_path, *preset)
    assert ran.code == 0, ran.err
    page = (tmp_path / "robot.spin.html").read_text(encoding="utf-8")
    warnings = json.loads(typed("spin", log, "-o", tmp_path, *preset, "--json").out)["spins"][0]["warnings"]
    for words in ("where 0.5 rad/s were preset", "where 30 s were preset"):
        assert words in " ".join(ran.out.split())
        assert words in page
        assert any(words in line for line in warnings)


def test_a_live_spin_takes_its_angle_from_duration_and_rate(log, tmp_path):
    preset = ("--spin-duration", "9.5s", "--turn-rate", 1)
    ran = typed("spin", "--live", f"replay:{log}?speed=max", "-o", tmp_path, *preset, "--json")
    assert ran.code == 0, ran.err
    last = json.loads(ran.out.splitlines()[-1])
    assert last["options"]["turns"] == pytest.approx(9.5 / FULL)
    assert last["options"]["spin-duration"] == 9.5


def test_three_presets_that_contradict_each_other_are_refused():
    with pytest.raises(
        ProcedureError, match=r"--turns 2 at --turn-rate 1 take 12.6 s, not the --spin-duration"
    ):
        TurnPreset(30.0, 1.0, 2.0)


@given(duration=st.floats(1.0, 600.0), rate=st.floats(0.05, 10.0))
def test_two_presets_give_the_third(duration, rate):
    turns = TurnPreset(duration, rate).completed(1.0, 2.0).turns
    assert turns == pytest.approx(duration * rate / FULL)
    assert TurnPreset(duration, None, turns).completed(1.0, 2.0).rate == pytest.approx(rate)
    assert TurnPreset(None, rate).completed(1.0, 2.0) == TurnPreset(None, rate, 2.0)


@given(share=st.floats(-0.5, 0.5), rate=st.floats(0.05, 10.0))
def test_a_departure_is_said_beyond_the_tolerance_and_not_within_it(share, rate):
    said = list(TurnPreset(None, rate, None).departures(10.0, rate * (1.0 + share), 2.0))
    if abs(abs(share) - LARGEST_DEPARTURE) > 1e-9:
        assert bool(said) == (abs(share) > LARGEST_DEPARTURE)


@pytest.mark.parametrize("option", [("--still", "70s"), ("--still", "61s")])
def test_a_long_rest_that_is_asked_for_has_time_to_be_made(tmp_path, option):
    path = tmp_path / "robot.csv"
    record([still(80.0), turn(2.2), still(1.0)], seed=42).write(path)
    ran = typed("spin", "--live", f"replay:{path}?speed=max", "-o", tmp_path, *option)
    assert ran.code == 0, ran.err


def test_a_slow_turn_that_is_asked_for_has_time_to_be_made(tmp_path):
    path = tmp_path / "robot.csv"
    record([still(6.0), turn(2.2, rate=0.1), still(1.0)], seed=43).write(path)
    ran = typed("spin", "--live", f"replay:{path}?speed=max", "-o", tmp_path, "--turn-rate", 0.1)
    assert ran.code == 0, ran.err
