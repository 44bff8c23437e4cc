"""From events to spans, and from windows to lines: properties of the time line."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import report_redundancy_cases as cases
from tumble.procedures.redundancy.report.difference import agreements, thinned
from tumble.procedures.redundancy.report.figures import MARKS, decades, timeline_figure
from tumble.procedures.redundancy.report.timeline import (
    COLLECTING,
    WAITING,
    Span,
    evaluations,
    merged,
    time_line,
)
from tumble.procedures.redundancy.result import Selected


def lane(result, unit):
    return next(lane for lane in time_line(result).lanes if lane.unit == unit)


def test_secondary_waits_from_trigger_and_collects_from_motion_to_fit():
    modes = lane(cases.mission(), "imu2").modes
    assert modes == (Span(2.6, 10.2, WAITING), Span(10.2, cases.ADOPTED, COLLECTING))


@pytest.mark.parametrize("ending", ["fitted", "adopted", "refused", "abandoned"])
def test_every_end_of_a_calibration_ends_its_mode(ending):
    events = (cases.event(1.0, "imu2", "triggered", sensors="both"), cases.event(4.0, "imu2", ending))
    assert lane(replace(cases.mission(), events=events), "imu2").modes == (Span(1.0, 4.0, WAITING),)


def test_open_span_lasts_to_the_end():
    events = (
        cases.event(1.0, "imu2", "triggered", sensors="both"),
        cases.event(2.0, "imu2", "unhealthy", reason="late"),
        cases.event(3.0, "imu1", "rest began"),
    )
    result = replace(cases.mission(), events=events)
    assert lane(result, "imu2").modes == (Span(1.0, 100.0, WAITING),)
    assert lane(result, "imu2").unhealthy == (Span(2.0, 100.0),)
    assert time_line(result).rests == (Span(3.0, 100.0),)


def test_several_faults_are_one_span_that_ends_with_health():
    events = tuple(
        cases.event(at, "imu2", name, reason="late")
        for at, name in ((1.0, "unhealthy"), (2.0, "unhealthy"), (5.0, "healthy"), (7.0, "healthy"))
    )
    assert lane(replace(cases.mission(), events=events), "imu2").unhealthy == (Span(1.0, 5.0),)


def test_each_unit_is_the_source_where_it_was_selected():
    result = cases.mission()
    assert lane(result, "imu1").source == (Span(0.0, cases.TOOK_OVER),)
    assert lane(result, "imu2").source == (Span(cases.TOOK_OVER, 100.0),)
    assert lane(result, "imu3").source == ()
    assert time_line(cases.unfit()).no_source == (Span(0.12, 100.0),)


def test_a_threshold_is_shown_as_it_was_at_each_evaluation():
    found = evaluations(cases.mission(), "imu2", "accelerometer")
    assert found["norm"].threshold == [0.1, 0.12]
    assert found["norm"].deviation == [0.3, 0.004]
    assert found["norm"].exceeded == [True, False]
    assert found["vector"].time == [2.6]


spans = st.lists(st.tuples(st.floats(0, 1e4), st.floats(0, 50)), max_size=40).map(
    lambda drawn: [Span(start, start + length) for start, length in sorted(drawn)]
)


@given(spans, st.floats(0.001, 100))
def test_merging_loses_no_time_and_leaves_only_gaps_that_can_be_seen(drawn, gap):
    joined = merged(drawn, gap)
    for span in drawn:
        assert any(whole.start <= span.start and span.end <= whole.end for whole in joined)
    for first, second in pairwise(joined):
        assert second.start - first.end >= gap


@given(st.integers(1, 3000), st.integers(1, 500))
def test_thinning_keeps_the_sum_of_squares_of_evenly_filled_groups(count, most):
    values = np.linspace(1.0, 2.0, count)
    time, shown = thinned(np.arange(float(count)), values, most)
    assert len(time) == len(shown) == min(count, most)
    assert np.all(np.diff(time) > 0)
    assert shown.min() >= 1.0 - 1e-12
    assert shown.max() <= 2.0 + 1e-12
    if count % most == 0:
        assert np.mean(shown**2) == pytest.approx(np.mean(values**2), rel=1e-12)


def test_thinning_keeps_gaps_and_finite_values():
    values = np.array([np.nan, np.nan, 3.0, np.nan, 4.0, 4.0])
    _, shown = thinned(np.arange(6.0), values, 3)
    assert np.isnan(shown[0])
    assert shown[1:] == pytest.approx([3.0, 4.0])


def test_windows_of_an_unhealthy_unit_do_not_count():
    result = cases.mission()
    before = {(row.unit, row.sensor, row.condition): row.windows for row in agreements(result)}
    fault = (
        cases.event(65.0, "imu2", "unhealthy", reason="late"),
        cases.event(75.0, "imu2", "healthy"),
    )
    after = {
        (row.unit, row.sensor, row.condition): row.windows
        for row in agreements(replace(result, events=(*result.events, *fault)))
    }
    key = ("imu2", "gyroscope", "in motion")
    assert before[key] - after[key] == 200


@given(st.lists(st.one_of(st.floats(1e-9, 1e6), st.just(float("nan")), st.just(0.0)), max_size=30))
def test_decades_hold_the_largest_number_and_are_two_at_least(numbers):
    low, high = decades([np.array(numbers)])
    assert high - low >= 2
    positive = [number for number in numbers if number > 0]
    if positive:
        assert 10.0**high >= max(positive)


def test_key_of_the_time_line_explains_exactly_what_occurs():
    calm = time_line(told(cases.event(0.0, "imu1", "selected", reason="start")))
    assert named(calm) == {"source"}
    adopted = cases.event(20.0, "imu2", "adopted", sensor="gyroscope")
    frozen = cases.event(30.0, "imu2", "unhealthy", reason="frozen")
    more = told(cases.event(0.0, "imu1", "selected", reason="start"), adopted, frozen)
    assert named(time_line(more)) == {"source", "adopted", "unhealthy"}


def told(*events):
    return replace(cases.quiet(), events=events, selected=(Selected(0.0, 60.0, "imu1", "start"),))


def named(line):
    """Names in the key, which are the texts of the figure that are names of spans or marks."""
    spans = {"source", "no source", "at rest", WAITING, COLLECTING, "unhealthy", "disagree"}
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", str(timeline_figure(line, "line")))
    return {text for text in texts if text in spans | set(MARKS)}
