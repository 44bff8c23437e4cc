"""Figures of the report: small, repeatable, harmless to the user's own plots, and true to the numbers."""

from __future__ import annotations

import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import report_fixtures as sessions
from tumble.foundation.errors import ProcedureError
from tumble.foundation.log_time import FROM_START
from tumble.procedures.turntable.report.batch_figures import (
    distribution_figure,
    limits_off_scale,
    strip_groups,
)
from tumble.procedures.turntable.report.improvement import improvement
from tumble.procedures.turntable.report.overview import figure_overview
from tumble.procedures.turntable.report.pages import records_of
from tumble.procedures.turntable.report.readings import axis_reading_figure, calibrated_deviation, deviations
from tumble.report.canvas import Figure
from tumble.report.figures import recording_figure, residual_figure
from tumble.report.panel import tick_texts, ticks_between
from tumble.report.svg import INK, PAGE_COLOURS, X_AXIS, inline_svg
from tumble.report.whisker import WIDTH, Ruler, round_up, whisker


@pytest.fixture(scope="module")
def result():
    return sessions.batch()


def all_figures(result):
    target = result["target_1"]
    yield residual_figure(target.accelerometer, "a")
    yield residual_figure(target.gyroscope, "b")
    yield recording_figure(target.trace, target.rests, FROM_START, "c")
    for reading in target.axis_readings:
        states = deviations(target, reading, result.reference.mounting)
        yield axis_reading_figure(reading, states, f"d{reading.axis}")
    yield from (
        distribution_figure(group, f"e{n}") for n, group in enumerate(strip_groups(records_of(result)))
    )


def test_every_figure_is_well_formed_and_its_references_resolve(result):
    for svg in all_figures(result):
        root = ElementTree.fromstring(svg)
        found = {element.get("id") for element in root.iter() if element.get("id")}
        assert set(re.findall(r"url\(#([^)]+)\)|href=\"#([^\"]+)\"", svg)) != set()
        assert {a or b for a, b in re.findall(r"url\(#([^)]+)\)|href=\"#([^\"]+)\"", svg)} == found


def test_figures_take_their_colours_from_the_page(result):
    names = "|".join(PAGE_COLOURS.values())
    for svg in all_figures(result):
        assert not re.search(r"#[0-9a-fA-F]{6}\b", svg)
        assert set(re.findall(r"var\(--(\w+)\)", svg)) <= set(names.split("|"))


def test_a_colour_the_page_does_not_know_is_refused():
    figure = Figure(1, 1)
    figure.add_axes((0, 0, 1, 1)).text(0.5, 0.5, "x", color="#123456")
    with pytest.raises(KeyError, match="123456"):
        inline_svg(figure, "p", "label")


def test_text_is_never_taken_for_mathematics_or_markup():
    name = '<b> $x_1$ & " --> </svg>'
    figure = Figure(2, 1)
    figure.add_axes((0, 0, 2, 1)).text(0.1, 0.5, name, color=INK)
    svg = inline_svg(figure, "p", name)
    root = ElementTree.fromstring(svg)
    assert root.get("aria-label") == name
    assert "".join(root.itertext()) == name


def test_figures_drawn_in_threads_are_those_drawn_one_by_one(result):
    alone = list(all_figures(result))
    with ThreadPoolExecutor(4) as pool:
        assert all(figures == alone for figures in pool.map(lambda _: list(all_figures(result)), range(4)))


def test_lower_row_shows_deviations_in_a_finer_unit_than_the_upper(result):
    reading = replace(
        result["target_1"].axis_readings[0],
        uncompensated=result["target_1"].axis_readings[0].ideal + 0.002,
        compensated=result["target_1"].axis_readings[0].ideal + 0.001,
    )
    states = deviations(result["target_1"], reading, result.reference.mounting)
    figure = axis_reading_figure(reading, states, "p")
    texts = "".join(ElementTree.fromstring(figure).itertext())
    assert "reading, m/s²" in texts
    assert "deviation from the ideal, mm/s²" in texts


def test_the_recording_names_each_rest_and_says_which_were_not_used(result):
    target = result["target_1"]
    drawn = recording_figure(target.trace, target.rests, FROM_START, "p")
    texts = list(ElementTree.fromstring(drawn).itertext())
    for number, rest in enumerate(target.rests, start=1):
        assert (f"{number} {rest.pose}" if rest.used else f"{number} not used") in texts


def test_only_parameters_that_were_shown_are_in_a_distribution(result):
    groups = {(group.triad, group.title): group for group in strip_groups(records_of(result))}
    names = {target for strip in groups["gyroscope", "scale error"].strips for target in strip.names}
    assert names == {"target_1", "target_2", "target_5"}
    names = {target for strip in groups["gyroscope", "bias"].strips for target in strip.names}
    assert names == {"target_1", "target_2", "target_4", "target_5"}


def test_a_distribution_holds_each_targets_value_in_its_unit(result):
    group = next(group for group in strip_groups(records_of(result)) if group.title == "scale error")
    factor = {"%": 100.0, "ppm": 1e6}[group.unit]
    for strip in group.strips:
        for name, value in zip(strip.names, strip.values, strict=True):
            parameter = next(p for p in result[name].accelerometer.parameters if p.name == strip.name)
            assert value == pytest.approx(factor * (parameter.value - 1))


def test_limit_beyond_the_scale_is_noted_in_the_distribution(result):
    group = next(group for group in strip_groups(records_of(result)) if group.title == "bias")
    largest = max(float(np.abs(strip.values).max()) for strip in group.strips)
    far = replace(group, strips=tuple(replace(strip, limit=100.0 * largest) for strip in group.strips))
    near = replace(group, strips=tuple(replace(strip, limit=1.1 * largest) for strip in group.strips))
    for shown, says in ((far, True), (near, False)):
        texts = "".join(ElementTree.fromstring(distribution_figure(shown, "p")).itertext())
        assert ("limits off scale: ±" in texts) is says
    one = replace(near, strips=(*near.strips[:2], far.strips[2]))
    assert limits_off_scale(one, 2.0 * largest).endswith("(z)")


def test_long_name_is_cut_to_the_panel_of_the_figure(result):
    name = "left wing, third bay, as delivered"
    target = result["target_1"]
    rests = tuple(replace(rest, pose=name) for rest in target.rests)
    labels = (name,) * len(target.accelerometer.residual_labels)
    for figure in (
        recording_figure(target.trace, rests, FROM_START, "p"),
        residual_figure(replace(target.accelerometer, residual_labels=labels), "p"),
    ):
        texts = list(ElementTree.fromstring(figure).itertext())
        cut = [text for text in texts if "left wing" in text]
        assert cut
        assert all(text.endswith("…") and len(text) < len(name) for text in cut)


def test_the_overview_stands_alone_and_names_the_three_states(result):
    svg = figure_overview(result)
    texts = "".join(ElementTree.fromstring(svg).itertext())
    for state in ("raw", "mounting compensated", "calibrated", "target_1"):
        assert state in texts
    assert "var(" not in svg
    assert figure_overview(result) == svg


def test_no_overview_is_drawn_without_a_mounting_angle():
    with pytest.raises(ProcedureError, match="pose list"):
        figure_overview(sessions.batch_without_mounting())


def test_calibration_leaves_only_the_table_error_in_an_axis(result):
    target = result["target_1"]
    for reading in target.axis_readings:
        left = calibrated_deviation(target, reading, result.reference.mounting)
        session_error = sessions.Session(20240607)
        column = "XY".index(reading.axis)
        table = (session_error.specific_force @ sessions.R_E)[:, column] - reading.ideal
        assert left == pytest.approx(table, abs=2e-3)


def test_reading_outside_all_rests_is_not_calibrated(result):
    target = result["target_1"]
    foreign = replace(target.axis_readings[0], uncompensated=target.axis_readings[0].uncompensated + 1.0)
    assert calibrated_deviation(target, foreign, result.reference.mounting) is None


def test_improvement_is_the_rms_of_the_norm_error_before_and_after(result):
    target = result["target_2"]
    gain = improvement(target, result.gravity)
    used = [rest.specific_force for rest in target.rests if rest.used]
    before = [np.linalg.norm(force) - result.gravity for force in used]
    C, b = np.linalg.inv(target.accelerometer.M), target.accelerometer.b
    after = [np.linalg.norm(C @ (force - b)) - result.gravity for force in used]
    assert gain.before == pytest.approx(np.sqrt(np.mean(np.square(before))))
    assert gain.after == pytest.approx(np.sqrt(np.mean(np.square(after))))
    assert gain.after < gain.before / 10


def test_there_is_no_improvement_where_there_is_no_matrix(result):
    target = result["target_1"]
    assert improvement(result["target_3"], result.gravity) is None
    blind = replace(target, accelerometer=replace(target.accelerometer, estimated=("bias",)))
    assert improvement(blind, result.gravity) is None


@given(st.lists(st.floats(-1e6, 1e6, allow_subnormal=False), min_size=1))
def test_a_ruler_holds_all_its_numbers_and_is_not_much_longer(numbers):
    reach = round_up(numbers)
    largest = max(map(abs, numbers))
    assert largest <= reach
    assert largest == 0 or reach <= 1.5 * largest


def test_a_ruler_for_next_to_nothing_is_that_for_nothing():
    assert round_up([5e-324, -1e-310]) == round_up([0.0]) == 1.0


@given(st.floats(-5, 5), st.floats(0, 2))
def test_whisker_stays_in_its_picture_with_its_dot_at_the_value(value, half):
    ruler = Ruler(-4.0, 4.0)
    svg = whisker(ruler, value, value - half, value + half, 3.0, alarm=False)
    places = [float(x) for x in re.findall(r'(?:x1|x2|cx)="([-\d.]+)"', svg)]
    assert all(0 <= place <= WIDTH for place in places)
    centre = float(re.search(r'cx="([\d.]+)"', svg)[1])
    assert centre == pytest.approx(ruler.place(value), abs=0.06)


def test_a_whisker_of_no_number_is_no_picture():
    assert whisker(Ruler(-1, 1), float("nan"), -1, 1, None, alarm=False) == ""
    assert whisker(Ruler(-1, 1), 0.0, -np.inf, np.inf, None, alarm=False) == ""


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
def test_ticks_lie_inside_their_span_and_their_texts_tell_them_apart(low, length):
    ticks = ticks_between(low, low + length, 5)
    texts = tick_texts(ticks)
    assert all(low <= tick <= low + length for tick in ticks)
    assert len(set(texts)) == len(ticks)


def test_the_style_that_many_markers_share_is_written_once():
    figure = Figure(2.0, 2.0)
    figure.add_axes((0.0, 0.0, 2.0, 2.0)).points(np.arange(50.0), np.arange(50.0), X_AXIS, "o")
    root = ElementTree.fromstring(inline_svg(figure, "m", "markers"))
    groups = [group for group in root.iter() if any(child.tag.endswith("use") for child in group)]
    group = max(groups, key=len)
    points = [child for child in group if child.tag.endswith("use")]
    assert len(points) == 50
    assert "var(--x)" in group.get("style")
    assert all(child.get("style") is None for child in points)
