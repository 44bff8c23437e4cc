"""Flights of the first steps with redundant sets, whose units warm by 10 K: drift is nobody's fault."""

from __future__ import annotations

import json

import pytest

from turntable_sessions import typed

DIES = 130
"""s at which the primary falls silent."""


@pytest.mark.parametrize("seed", [7, 19, 22, 24, 26, 34])
def test_two_sound_secondaries_that_warm_are_in_no_dispute(seed, tmp_path):
    flight, results = tmp_path / "flight", tmp_path / "results"
    fault = ("--fault", f"primary:dead:start={DIES}")
    made = typed("simulate", "flight", "--flights", 2, *fault, "--seed", seed, "-o", flight)
    assert made.code == 0, made.err
    secondaries = [w for n in (1, 2) for w in ("--secondary", flight / f"secondary_{n}.csv")]
    replay = ("--primary", flight / "primary.csv", *secondaries, "--settings", flight / "units.yaml")
    done = typed("redundancy", *replay, "-o", results)
    events = [json.loads(line) for line in (results / "events.jsonl").read_text("utf-8").splitlines()]
    assert done.code == 0, done.err
    assert [each for each in events if each["event"] == "disagree"] == []
    named = [(each["unit"], each["figures"]["reason"]) for each in events if each["event"] == "unhealthy"]
    assert named == [("primary", "late")]
