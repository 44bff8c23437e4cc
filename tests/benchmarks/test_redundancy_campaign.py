"""The campaign compares reports with the truth, on sets whose motion obeys physics."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from benchmarks import redundancy_campaign, redundancy_recorded
from benchmarks.redundancy_draw import CYCLE, draw, kinds
from benchmarks.redundancy_fault import Kind, draw_fault
from benchmarks.redundancy_figures import of_kind
from benchmarks.redundancy_judgement import judge, source_spans
from benchmarks.redundancy_replay import error_of, gathered
from benchmarks.redundancy_set import SENSORS, STEP, WARMING, simulate_set
from scipy.spatial.transform import Rotation

from tumble.foundation.constants import STANDARD_GRAVITY

SPANS = np.array([[6.0, 30.0], [36.0, 50.0]])


def unhealthy(time, unit, reason="out of family"):
    return (time, unit, "unhealthy", {"reason": reason})


def disagree(time):
    return (time, 0, "disagree", {"sensor": "accelerometer"})


def selected(time, unit, reason="primary failed"):
    return (time, unit, "selected", {"reason": reason})


START = selected(0.1, 0, "start")
FAULTY, ONSET, END = 1, 50.0, 100.0


@pytest.mark.parametrize(
    ("told", "outcome", "isolated", "seen"),
    [
        ([], "missed", None, None),
        ([unhealthy(50.5, 1)], "right", 0.5, 0.5),
        ([disagree(50.2), unhealthy(53.0, 1)], "right", 3.0, 0.2),
        ([disagree(50.2)], "unknown", None, 0.2),
        ([unhealthy(51.0, 2), unhealthy(52.0, 1)], "wrong", None, 1.0),
        ([unhealthy(51.0, 1), unhealthy(51.0, 0)], "wrong", None, 1.0),
        ([unhealthy(51.0, 1), unhealthy(52.0, 0)], "right", 1.0, 1.0),
        ([unhealthy(49.0, 1), unhealthy(51.0, 1)], "too early", None, 1.0),
        ([unhealthy(20.0, 0), unhealthy(51.0, 1)], "too early", None, 1.0),
        ([unhealthy(51.0, 0, "saturated"), unhealthy(52.0, 1)], "right", 2.0, 2.0),
        ([disagree(20.0)], "missed", None, None),
        ([unhealthy(99.9, 1, "late")], "missed", None, None),
    ],
)
def test_first_unit_named_after_the_fault_decides_the_outcome(told, outcome, isolated, seen):
    judgement = judge([START, *told], FAULTY, ONSET, END)
    assert judgement.outcome == outcome
    assert (judgement.isolated, judgement.seen) == pytest.approx((isolated, seen))


def test_reports_in_health_are_counted_and_have_no_outcome():
    told = [START, unhealthy(20.0, 0), selected(20.1, 1), disagree(30.0)]
    judgement = judge(told, None, ONSET, END)
    assert judgement.outcome is None
    assert (judgement.faulty_in_health, judgement.disagree_in_health) == (1, 1)
    assert (judgement.changes_in_health, judgement.changes, judgement.health) == (1, 0, END)


def test_only_the_time_before_a_fault_is_health():
    told = [START, disagree(30.0), unhealthy(51.0, 1), unhealthy(60.0, 2), selected(70.0, 0, "none fit")]
    judgement = judge([*told, selected(75.0, 0)], FAULTY, ONSET, END)
    assert (judgement.health, judgement.disagree_in_health, judgement.faulty_in_health) == (ONSET, 1, 0)
    assert (judgement.also, judgement.changes, judgement.changes_in_health) == (1, 2, 0)
    assert (judgement.without_source, judgement.without_source_in_health) == (5.0, 0.0)


def test_source_lasts_until_the_next_one_or_until_none_is_usable():
    told = [START, selected(40.0, 2), selected(60.0, 2, "none fit"), selected(61.0, 0, "primary proven")]
    assert source_spans(told, END) == [(0.1, 40.0, 0), (40.0, 60.0, 2), (60.0, 61.0, None), (61.0, END, 0)]


def test_missions_have_one_outcome_and_percentiles_skip_missing_ones():
    told = {"right": [unhealthy(52.0, 1)], "missed": [], "unknown": [disagree(51.0)]}
    known = {"faulty": 0, "sensor": "accelerometer", "velocity": 2.0, "angle": None, "misled": 0}
    missions = [
        known | {name: getattr(judge([START, *events], FAULTY, ONSET, END), name) for name in JUDGED}
        for events in told.values()
    ]
    figures = of_kind(missions)
    assert figures["missions"] == sum(figures["outcomes"].values()) == 3
    assert (figures["isolated"]["number"], figures["seen"]["number"], figures["right_within"]) == (1, 2, 1)
    assert figures["velocity"]["median"] == 2.0
    assert figures["angle"] == {"number": 0}


JUDGED = ("outcome", "isolated", "seen", "also", "changes", "without_source")


@pytest.fixture(scope="module")
def ridden():
    """Three units that ride along for a minute, hardly shaken."""
    print("seed 5")
    return simulate_set(np.random.default_rng(5), 3, SPANS, 60.0, "weak")


def test_gravity_rotated_by_the_gyroscope_is_felt_at_the_next_rest(ridden):
    body = ridden.body
    moved = (body.time > 5.0) & (body.time < 33.0)
    steps = Rotation.from_rotvec(0.5 * STEP * (body.angular_rate[moved][1:] + body.angular_rate[moved][:-1]))
    turned = Rotation.identity()
    for step in steps:
        turned = turned * step
    force = body.specific_force[moved]
    np.testing.assert_allclose(np.linalg.norm(force[[0, -1]], axis=1), STANDARD_GRAVITY, rtol=1e-9)
    np.testing.assert_allclose(turned.inv().apply(force[0]), force[-1], atol=0.002)


@pytest.mark.parametrize("number", [0, 1, 2])
def test_true_errors_removed_leave_the_motion_of_the_body(ridden, number):
    unit, said = ridden.units[number], ridden.samples[number]
    for name, noise, drift in zip(SENSORS, (0.3, 0.03), WARMING, strict=True):
        true = np.linalg.solve(unit.matrix[name], (said.of(name) - unit.bias[name]).T).T
        felt = ridden.body.angular_rate
        if name == "accelerometer":
            felt = ridden.body.specific_force + ridden.body.carried(unit.arm)
        felt = np.column_stack([np.interp(said.arrival, ridden.body.time, column) for column in felt.T])
        assert np.abs((true - felt).mean(axis=0)).max() < 3.0 * drift
        assert (true - felt).std() < noise
        record = {"matrix": unit.matrix[name], "bias": unit.bias[name], "lever_arm": unit.arm}
        assert np.abs(said.time - said.arrival).max() < 0.0015
        stated = replace(unit, stated_arm=None)
        truth = replace(
            ridden.units[0],
            matrix=dict.fromkeys(SENSORS, np.eye(3)),
            bias=dict.fromkeys(SENSORS, np.zeros(3)),
        )
        assert error_of(record, stated, truth, name, ridden.body, 0.0) < 1e-9
        worse = record | {"bias": unit.bias[name] + 0.5}
        assert error_of(worse, stated, truth, name, ridden.body, 0.0) == pytest.approx(0.75**0.5, rel=0.05)


@pytest.mark.parametrize("kind", get_args(Kind))
def test_fault_changes_only_the_samples_after_its_onset(ridden, kind):
    clean = ridden.samples[1]
    fault = draw_fault(np.random.default_rng(7), kind, 20.0)
    faulty = fault.inject(clean)
    count = int(np.searchsorted(clean.arrival, 20.0))
    for name in ("time", "arrival", "specific_force", "angular_rate"):
        np.testing.assert_array_equal(getattr(faulty, name)[:count], getattr(clean, name)[:count])
    assert any(
        not np.array_equal(getattr(faulty, name), getattr(clean, name))
        for name in ("arrival", "specific_force", "angular_rate")
    )


def test_jump_of_1_m_per_s2_for_2_s_accumulates_2_m_per_s(ridden):
    fault = replace(draw_fault(np.random.default_rng(7), "jump", 2.0), sensor="accelerometer", size=1.0)
    clean, unit = ridden.samples[1], ridden.units[1]
    found = gathered(clean, fault.inject(clean), unit, ridden.body, [(1.0, 4.0)])
    assert found == {"accelerometer": pytest.approx(2.0, rel=0.01), "gyroscope": 0.0}


def test_every_kind_is_drawn_and_a_seed_fixes_its_mission():
    assert set(CYCLE) == set(kinds())
    seeds = redundancy_campaign.chosen(4, 100, ["ramp"], [2])
    assert all((draw(seed).kind, draw(seed).units) == ("ramp", 2) for seed in seeds)
    assert seeds == redundancy_campaign.chosen(2, 100, ["ramp"], [2]) + redundancy_campaign.chosen(
        2, seeds[1] + 1, ["ramp"], [2]
    )
    first, again = draw(seeds[0]).fly(), draw(seeds[0]).fly()
    np.testing.assert_array_equal(first.samples[1].specific_force, again.samples[1].specific_force)


@pytest.mark.parametrize("kind", ["dead", "late", "not a number"])
def test_silent_late_or_invalid_unit_is_isolated_at_once(kind):
    (seed,) = redundancy_campaign.chosen(1, 0, [kind], [2, 3, 4])
    print(f"seed {seed}")
    mission = redundancy_campaign.judged(seed)
    assert mission["outcome"] == "right"
    assert mission["isolated"] < 0.15


def test_tables_show_flown_kinds_and_partial_campaigns_are_not_saved(monkeypatch, capsys):
    monkeypatch.setattr(redundancy_campaign, "save", lambda *_: pytest.fail("kept"))
    assert redundancy_campaign.main(["--missions", "2", "--kinds", "dead", "--jobs", "1", "--list"]) == 0
    assert "dead" in capsys.readouterr().out


@pytest.mark.parametrize("asked", [("--kinds", "jumps"), ("--units", "5")])
def test_a_kind_or_a_number_of_units_that_is_never_drawn_is_refused(asked, capsys):
    with pytest.raises(SystemExit):
        redundancy_campaign.main(asked)
    assert f"{asked[1]!r} is none of" in capsys.readouterr().err


def test_single_mission_shows_all_events(capsys):
    (seed,) = redundancy_campaign.chosen(1, 0, ["dead"], [2])
    assert redundancy_campaign.main(["--only", str(seed)]) == 0
    assert "adopted" in capsys.readouterr().out


def test_benchmark_without_the_recording_reports_it_and_saves_nothing(monkeypatch, capsys):
    monkeypatch.setattr(redundancy_recorded.board, "is_here", lambda: False)
    monkeypatch.setattr(redundancy_recorded, "save", lambda *_: pytest.fail("kept"))
    assert redundancy_recorded.main([]) == 0
    assert "not here" in capsys.readouterr().out


@pytest.mark.skipif(not redundancy_recorded.board.is_here(), reason=redundancy_recorded.board.ABSENT)
def test_stuck_axis_is_isolated_despite_a_stored_calibration():
    mission = redundancy_recorded.faulted("stuck", 3, 0)
    assert (mission["outcome"], mission["units"]) == ("right", 2)
    assert mission["faulty_in_health"] == 0
    figures = redundancy_recorded.summary(HEALTHY, [mission])
    assert figures["N = 2"]["groups"]["all"]["outcomes"]["right"] == 1
    assert figures["N >= 3"]["health"]["shaken"] == {"changes": 3}


HEALTHY = [
    {"units": units, **{span: {"changes": changes} for span in redundancy_recorded.SPANS}}
    for units, changes in ((2, 5), (3, 1), (4, 2))
]
