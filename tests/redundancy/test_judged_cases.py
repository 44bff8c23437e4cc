"""Three missions of a simulator that is not ours, in which one unit is wrong and the others could know."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from redundancy_sets import of
from turntable_sessions import typed

FOLDER = Path(__file__).parents[3] / "shared" / "data" / "redundancy_cases"
SECONDARIES = {"flip": 1, "p5019": 3, "p5037": 2}
DIES = 53.4
"""s at which the primary of `flip` sends its last sample."""
DRIFT = (43.0, 163.0)
"""s in which the primary of `p5019` drifts by 0.3 m/s^2."""
JUMP = 46.5
"""s at which the primary of `p5037` jumps by 1 m/s^2."""

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the missions in ../shared/data are not here")


def arguments(case):
    secondaries = range(1, SECONDARIES[case] + 1)
    logs = [word for n in secondaries for word in ("--secondary", FOLDER / f"{case}_secondary_{n}.parquet")]
    return ("--primary", FOLDER / f"{case}_primary.parquet", *logs, "--settings", FOLDER / f"{case}.yaml")


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Each case as typed: exit code and summary, and the folder of its results."""
    folders = {case: tmp_path_factory.mktemp(case) for case in SECONDARIES}
    return {
        case: (typed("redundancy", *arguments(case), "-o", folder), folder)
        for case, folder in folders.items()
    }


@pytest.fixture(scope="module")
def events(done):
    """Events of each case."""
    return {
        case: [json.loads(line) for line in (folder / "events.jsonl").read_text("utf-8").splitlines()]
        for case, (_, folder) in done.items()
    }


def named(events, unit):
    """Times at which a unit is reported faulty."""
    return [each["time"] for each in of(events, unit, "unhealthy")]


def sources(events):
    """Times of the changes of the source; no unit where none is usable."""
    return [
        (each["time"], None if each["figures"]["reason"] == "none fit" else each["unit"])
        for each in events
        if each["event"] == "selected"
    ]


def test_refuted_secondary_is_no_source_while_a_valid_primary_lives(events):
    assert [unit for time, unit in sources(events["flip"]) if time < DIES] == ["flip_primary"]


def test_refuted_secondary_is_the_source_after_the_primary_dies(events):
    time, unit = sources(events["flip"])[-1]
    assert unit == "flip_secondary_1"
    assert DIES < time < DIES + 0.5


def test_a_primary_that_says_no_more_is_named_at_once(events):
    assert DIES < named(events["flip"], "flip_primary")[0] < DIES + 0.2


def test_a_set_whose_source_is_refuted_at_the_end_ends_with_code_3(done):
    assert done["flip"][0].code == 3


def test_drifting_primary_is_isolated_before_its_drift_ends(events):
    began, ended = DRIFT
    first = named(events["p5019"], "p5019_primary")[:1]
    assert first
    assert began < first[0] < ended
    time, unit = sources(events["p5019"])[-1]
    assert unit != "p5019_primary"
    assert time < ended


def test_agreeing_secondaries_are_cleared_against_a_drifting_primary(events):
    assert not [n for n in (1, 2, 3) if named(events["p5019"], f"p5019_secondary_{n}")]


def test_no_secondary_follows_a_primary_that_its_siblings_contradict(events):
    followed = [
        (each["unit"], each["time"])
        for each in events["p5019"]
        if each["event"] == "adopted"
        and each["figures"]["sensor"] == "accelerometer"
        and each["time"] > DRIFT[0]
    ]
    assert followed == []


def test_a_primary_that_jumps_loses_the_source_within_a_second(events):
    assert JUMP < named(events["p5037"], "p5037_primary")[0] < JUMP + 1.0
    time, unit = sources(events["p5037"])[1]
    assert unit in ("p5037_secondary_1", "p5037_secondary_2")
    assert time < JUMP + 1.0


def test_agreeing_secondaries_are_cleared_against_a_jumping_primary(events):
    assert not [n for n in (1, 2) if named(events["p5037"], f"p5037_secondary_{n}")]


def test_summary_names_a_jumping_primary_its_successor_and_time(done):
    code, summary = done["p5037"][0].code, " ".join(done["p5037"][0].out.split())
    assert code == 0
    assert summary.startswith("p5037_primary: accelerometer, out of family (")
    assert "agreeing: p5037_secondary_1 and p5037_secondary_2, since 46." in summary
    assert "took over at 46." in summary


def test_unhealthy_source_is_reported_first(done):
    assert done["flip"][0].out.startswith("flip_secondary_1 deviated at rest and stayed the source since 53.")


def test_two_units_with_one_upside_down_lead_with_their_disagreement(done):
    """An accelerometer with all signs wrong reads as a sound one that is upside down."""
    head = " ".join(done["flip"][0].out.partition("s replayed")[0].split())
    assert "flip_primary and flip_secondary_1 disagree since 0." in head
    assert "19.4 m/s² apart against 3.98 m/s²" in head


def test_fit_of_an_upside_down_unit_is_reported(done):
    said = " ".join(done["flip"][0].out.split())
    assert "flip_secondary_1 accelerometer: implausible misalignment, 2.00 rad against 0.100 rad" in said
