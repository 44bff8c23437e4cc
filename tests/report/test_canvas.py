"""Marks stand where their numbers place them, within the panel, which is no larger than necessary."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tumble.report.canvas import POINTS, Figure
from tumble.report.directions import influence_bars
from tumble.report.svg import INK, SOFT, X_AXIS, inline_svg

WIDTH, HEIGHT = 3.0, 2.0
BOX = (0.5, 0.25, 2.0, 1.5)
"""Box of the panel, inches."""


def panel(across=(0.0, 1.0), up=(0.0, 1.0)):
    figure = Figure(WIDTH, HEIGHT)
    axes = figure.add_axes(BOX)
    axes.set_xlim(*across)
    axes.set_ylim(*up)
    return figure, axes


def drawn(figure):
    return ElementTree.fromstring(inline_svg(figure, "p", "a figure"))


def elements(root, tag):
    return [element for element in root.iter() if element.tag.endswith(tag)]


def corners(figure):
    """(n, 2) points of the only line, in points on paper."""
    (path,) = [path for path in elements(drawn(figure), "path") if "fill:none" in path.get("style", "")]
    return np.array(re.findall(r"([-\d.]+) ([-\d.]+)", path.get("d")), dtype=float)


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_point_stands_where_its_numbers_say(low, length, across, up):
    figure, axes = panel((low, low + length), (low + length, low))
    axes.points([low + across * length], [low + up * length], X_AXIS, "o")
    (use,) = elements(drawn(figure), "use")
    left, bottom, width, height = (POINTS * inches for inches in BOX)
    top = POINTS * HEIGHT - bottom - height
    assert float(use.get("x")) == pytest.approx(left + across * width, abs=0.02)
    assert float(use.get("y")) == pytest.approx(top + up * height, abs=0.02)


def test_limits_that_are_set_after_something_is_drawn_hold_for_it_too():
    figure, axes = panel()
    axes.points([5.0], [5.0], X_AXIS, "o")
    axes.set_xlim(5.0, 6.0)
    axes.set_ylim(5.0, 6.0)
    (use,) = elements(drawn(figure), "use")
    assert float(use.get("x")) == POINTS * BOX[0]
    assert float(use.get("y")) == POINTS * (HEIGHT - BOX[1])


def test_non_finite_point_is_not_drawn_and_breaks_a_line():
    figure, axes = panel()
    axes.points([0.1, np.nan, 0.3, np.inf], [0.1, 0.2, np.nan, 0.4], X_AXIS, "s")
    axes.line([0.0, 0.5, np.nan, 0.7, 1.0], [0.0, 0.5, 0.6, 0.2, np.nan], INK)
    root = drawn(figure)
    assert len(elements(root, "use")) == 1
    (line,) = [path for path in elements(root, "path") if "fill:none" in path.get("style", "")]
    assert line.get("d").count("M") == 2
    assert "nan" not in inline_svg(figure, "p", "a figure")


def test_level_stretch_keeps_its_ends_and_a_slope_every_point():
    figure, axes = panel()
    axes.line(np.linspace(0.0, 1.0, 1001), np.full(1001, 0.5), INK)
    assert len(corners(figure)) == 2
    figure, axes = panel()
    axes.line(np.linspace(0.0, 1.0, 101), np.linspace(0.0, 1.0, 101), INK)
    assert len(corners(figure)) == 101


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=60))
def test_points_left_out_of_a_line_are_invisible(heights):
    figure, axes = panel()
    across = np.linspace(0.0, 1.0, len(heights))
    axes.line(across, heights, INK)
    found = corners(figure)
    left, bottom, width, height = (POINTS * inches for inches in BOX)
    top = POINTS * HEIGHT - bottom - height
    wanted = top + (1.0 - np.array(heights)) * height
    shown = np.interp(left + across * width, found[:, 0], found[:, 1])
    steepest = np.abs(np.diff(wanted)).max() / (width / (len(heights) - 1))
    rounding = 0.05
    assert np.abs(shown - wanted).max() <= rounding * (2.0 + steepest) + 1e-9


def test_marks_outside_a_panel_are_clipped_and_text_is_not():
    figure, axes = panel()
    axes.line([-1.0, 2.0], [0.5, 0.5], INK)
    axes.text(0.5, 1.2, "above", color=SOFT)
    root = drawn(figure)
    (cut,) = [group for group in elements(root, "g") if group.get("clip-path")]
    (edges,) = elements(root, "clipPath")
    assert cut.get("clip-path") == f"url(#{edges.get('id')})"
    assert not elements(cut, "text")
    assert [text.text for text in elements(root, "text")] == ["above"]


def test_two_figures_of_one_page_share_no_identifier():
    names = []
    for prefix in ("a", "b"):
        figure, axes = panel()
        axes.points([0.5], [0.5], X_AXIS, "o")
        axes.bars([(0.0, 0.2)], 0.0, 1.0, SOFT, "////", ink=INK)
        names.append(set(re.findall(r'id="([^"]+)"', inline_svg(figure, prefix, "a figure"))))
    assert names[0]
    assert not names[0] & names[1]


@pytest.mark.parametrize("odd", [np.inf, np.nan])
def test_bars_of_what_is_not_known_end_within_the_panel(odd):
    picture = str(inline_svg(influence_bars(np.array([0.4, odd, 2.0])), "odd", "Influence"))
    assert "inf" not in picture.lower().replace("influence", "")
    assert "nan" not in picture.lower()
