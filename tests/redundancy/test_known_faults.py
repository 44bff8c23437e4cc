"""Known faults are reported first and end with code 3, unless another unit took over."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

import report_redundancy_cases as cases
from tumble.procedures.redundancy.report.timeline import time_line
from tumble.procedures.redundancy.result import Selected
from tumble.procedures.redundancy.spans import disagreements
from turntable_sessions import typed

SEED = 7
FAULT = 55
"""s at which the primary goes wrong, in motion, when all secondaries are calibrated."""


def flown(folder, secondaries, fault):
    """Simulates a flight whose primary has a fault of its accelerometer along x, and replays it, as typed."""
    print(f"seed {SEED}")
    grades = ("--unit", "tactical", *("--unit", "industrial") * secondaries)
    fault = f"primary:{fault}:triad=accelerometer:axis=x:start={FAULT}"
    simulated = typed(
        *("simulate", "flight", *grades, "--fault", fault, "--vibration", 0.5, "--seed", SEED, "-o", folder)
    )
    assert simulated.code == 0, simulated.err
    logs = [folder / f"secondary_{number}.csv" for number in range(1, secondaries + 1)]
    return typed(
        *("redundancy", "--primary", folder / "primary.csv", "--settings", folder / "units.yaml"),
        *(word for log in logs for word in ("--secondary", log)),
        *("-o", folder / "out"),
    )


def test_jumping_primary_of_three_is_named_with_successor_and_exits_0(
    tmp_path,
):
    done = flown(tmp_path, 2, "bias-jump")
    said = " ".join(done.out.split())
    assert done.code == 0
    assert said.startswith("primary: accelerometer, out of family (")
    assert f"agreeing: secondary_1 and secondary_2, since {FAULT}." in said
    assert re.search(rf"; secondary_[12] took over at {FAULT}\.\d\d s\.", said)


def test_two_units_that_disagree_across_gravity_lead_and_exit_3(tmp_path):
    """A smooth change shows no step, and one across gravity equals a tilt."""
    done = flown(tmp_path, 1, f"bias-drift:end={FAULT + 2}:size=1.3")
    said = " ".join(done.out.split())
    told = rf"primary and secondary_1 disagree since {FAULT}\.\d\d s, and nobody knows which is wrong"
    assert done.code == 3
    assert re.match(told, said)
    assert re.search(told, (tmp_path / "out" / "redundancy.html").read_text("utf-8"))


def with_events(*events, **changes):
    made = cases.untriggered()
    return replace(made, events=(*made.events, *events), **changes)


def kinds(result):
    return [fault.kind for fault in result.known_faults]


DISAGREE = cases.event(
    40.0, "imu1", "disagree", sensor="accelerometer", other=("imu2",), value=1.0, limit=0.2, scale=0.1
)


def test_disagreement_that_ends_in_agreement_or_isolation_is_no_fault():
    agree = cases.event(45.0, "imu1", "agree", sensor="accelerometer", other=("imu2",))
    named = cases.event(
        45.0,
        "imu3",
        "unhealthy",
        sensor="accelerometer",
        reason="isolated",
        ground="rest",
        value=1.0,
        limit=0.1,
    )
    assert kinds(with_events(DISAGREE)) == ["disagreement"]
    assert kinds(with_events(DISAGREE, agree)) == []
    assert kinds(with_events(DISAGREE, named)) == []


def test_disagreement_of_one_sensor_outlives_agreement_of_the_other():
    agree = cases.event(45.0, "imu1", "agree", sensor="gyroscope", other=("imu2",))
    assert kinds(with_events(DISAGREE, agree)) == ["disagreement"]


told = st.lists(
    st.tuples(
        st.sampled_from(["disagree", "agree", "unhealthy"]), st.sampled_from(["accelerometer", "gyroscope"])
    ),
    max_size=30,
)


@given(told)
def test_disagreements_of_a_sensor_are_in_sequence_and_the_last_open(drawn):
    events = [
        cases.event(float(time), "imu1", name, sensor=sensor, other=("imu2",), reason="isolated")
        for time, (name, sensor) in enumerate(drawn)
    ]
    found = list(disagreements(events, 100.0))
    assert len(found) == sum(name == "disagree" for name, _ in drawn)
    for sensor in ("accelerometer", "gyroscope"):
        own = sorted((d for d in found if d.cause.figures["sensor"] == sensor), key=lambda d: d.start)
        assert all(first.end <= second.start for first, second in pairwise(own))
        assert not any(dispute.is_open for dispute in own[:-1])
        last = next((name for name, of in reversed(drawn) if of == sensor), "")
        assert [d.is_open for d in own[-1:]] in ([], [last == "disagree"])


def test_unhealthy_source_is_a_fault_unless_another_takes_over():
    late = cases.event(40.0, "imu1", "unhealthy", reason="late", value=0.1)
    assert kinds(with_events(late)) == ["source unhealthy"]
    took_over = (Selected(0.0, 40.1, "imu1", "start"), Selected(40.1, 100.0, "imu2", "primary failed"))
    assert kinds(with_events(late, selected=took_over)) == []
    healthy = cases.event(50.0, "imu1", "healthy")
    (fault,) = with_events(late, healthy).known_faults
    assert (fault.start, fault.end) == (40.0, 50.0)


def test_deviating_primary_is_a_fault_until_a_rest_clears_it():
    found = cases.evaluated(40.0, "imu1", 0.4, 0.001, True)
    (fault,) = with_events(found[0]).known_faults
    assert (fault.kind, fault.start, fault.end) == ("source deviates", 40.0, 100.0)
    (fault,) = with_events(found[0], *cases.evaluated(60.0, "imu1", 0.01, 0.001, False)).known_faults
    assert (fault.start, fault.end) == (40.0, 60.0)


@pytest.mark.parametrize("reason", ["primary invalid", "disputed", "on command only"])
def test_a_secondary_whose_calibration_is_withheld_is_not_calibrated(reason):
    withheld = cases.event(40.0, "imu3", "withheld", sensor="accelerometer", reason=reason)
    made = with_events(*cases.evaluated(40.0, "imu3", 0.3, 0.001, True), withheld)
    assert kinds(made) == ["not calibrated"]
    within = cases.evaluated(60.0, "imu3", 0.01, 0.001, False)
    assert kinds(replace(made, events=(*made.events, *within))) == []


@pytest.mark.parametrize(("reason", "found"), [("implausible scale", ["not calibrated"]), ("not better", [])])
def test_a_refused_fit_of_one_sensor_counts_whatever_the_other_has(reason, found):
    refused = cases.event(45.0, "imu3", "refused", sensor="gyroscope", reason=reason, value=0.5, limit=0.1)
    adopted = cases.event(46.0, "imu3", "adopted", sensor="accelerometer")
    figures = {"check": "vector", "deviation": 0.3, "threshold": 0.001, "exceeded": True}
    deviates = cases.event(44.0, "imu3", "evaluated", sensor="gyroscope", **figures)
    assert kinds(with_events(deviates, refused, adopted)) == found
    later = cases.event(60.0, "imu3", "adopted", sensor="gyroscope")
    assert kinds(with_events(deviates, refused, adopted, later)) == []


@pytest.mark.parametrize(
    ("reason", "found"), [("residual too large", ["not calibrated"]), ("disagrees with rest", [])]
)
def test_agreement_at_rest_answers_no_refusal_by_motion(reason, found):
    refused = cases.event(45.0, "imu3", "refused", sensor="gyroscope", reason=reason, value=0.5, limit=0.1)
    adopted = cases.event(46.0, "imu3", "adopted", sensor="accelerometer")
    figures = {"check": "vector", "deviation": 0.006, "threshold": 0.01, "exceeded": False}
    agrees = [cases.event(time, "imu3", "evaluated", sensor="gyroscope", **figures) for time in (44.0, 70.0)]
    assert kinds(with_events(agrees[0], refused, adopted, agrees[1])) == found


def test_a_refuted_secondary_is_a_fault_until_it_is_healthy():
    refuted = cases.event(
        40.0, "imu3", "unhealthy", sensor="accelerometer", reason="refuted", value=19.4, limit=4.0
    )
    assert kinds(with_events(refuted)) == ["refuted"]
    assert with_events(refuted).verdict == "not calibrated"
    assert kinds(with_events(refuted, cases.event(60.0, "imu3", "healthy"))) == []


def test_secondary_as_source_without_error_or_rest_is_reported():
    made = with_events()
    unseen = tuple(event for event in made.events if event.unit != "imu2")
    spans = (Selected(0.0, 50.0, "imu1", "start"), Selected(50.0, 100.0, "imu2", "primary failed"))
    assert "source not calibrated" in kinds(replace(made, events=unseen, selected=spans))
    assert kinds(replace(made, selected=spans)) == []


def test_secondary_unhealthy_at_the_end_is_reported_beside_its_source():
    from tumble.procedures.redundancy.report.text import output_sentences, unit_state

    blamed = {"reason": "isolated", "ground": "own step", "value": 0.93, "limit": 0.5}
    made = with_events(DISAGREE, cases.event(45.0, "imu2", "unhealthy", sensor="accelerometer", **blamed))
    (sentence,) = output_sentences(made)
    assert sentence.startswith("imu2 does not count at the end: accelerometer, isolated")
    assert unit_state(made, "imu1") == ("healthy", "")


def test_a_degraded_output_is_told_with_its_share():
    from tumble.procedures.redundancy.report.text import output_sentences

    assert output_sentences(with_events()) == []
    (sentence,) = output_sentences(with_events(degraded=0.25))
    assert sentence.startswith("Of the output 25 % are degraded")


def test_time_line_marks_disagreements_and_verdicts_with_figures():
    from tumble.procedures.redundancy.report.figures import timeline_figure

    blamed = cases.event(
        45.0,
        "imu2",
        "unhealthy",
        sensor="accelerometer",
        reason="isolated",
        ground="own step",
        value=0.93,
        limit=0.5,
    )
    line = time_line(with_events(DISAGREE, blamed))
    (dispute,) = line.disagreements
    assert (dispute.start, dispute.end, dispute.units) == (40.0, 45.0, ("imu1", "imu2"))
    assert [event.event for event in line.lanes[1].marks] == ["unhealthy"]
    drawn = str(timeline_figure(line, "line"))
    assert drawn.count("<title>40.00 to 45.00 s: imu1: accelerometer, with imu2 (1.00 m/s² apart") == 2
    assert (
        "<title>45.00 s: isolated, accelerometer, isolated "
        "(share of the difference 0.930 against 0.500" in drawn
    )
