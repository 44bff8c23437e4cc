"""The page of an alignment: whole, self-contained, and with every figure of the result."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tumble
from align_motions import Motion, Sensor, drawn, recordings
from report_reader import Page
from tumble.procedures.align.report.page import ALIGN_REPORT
from tumble.report.numbers import fixed, readable_scale, round_pair

UPRIGHT = {"turning": (0.0, 0.0, 1.0), "pushing": 0.0}


def aligned(motion, *secondaries):
    first, *others = recordings(motion, (Sensor(rate_hz=100.0), *secondaries), 30.0)
    return tumble.align(first, others)


@pytest.fixture(scope="module")
def result():
    return aligned(Motion(71), drawn(71, rate_hz=100.0), drawn(72, rate_hz=100.0))


@pytest.fixture(scope="module")
def hidden():
    return aligned(Motion(73, **UPRIGHT), drawn(73, rate_hz=100.0))


def test_every_parameter_of_every_unit_is_on_the_page_with_its_sigma(result):
    page = Page(ALIGN_REPORT.render(result))
    cells = [[cell.strip() for cell in row] for row in page.rows]
    for unit in result:
        for parameter in unit.parameters:
            rows = [row[1:3] for row in cells if row and row[0] == parameter.name]
            assert len(rows) == len(result.units), parameter.name
            scales = {readable_scale(parameter.unit, 10.0**power) for power in range(-9, 3)}
            printed = [
                [*round_pair(scale.factor * parameter.value, scale.factor * parameter.sigma)]
                for scale in scales
            ]
            assert any(row in printed for row in rows), f"{parameter.name}: {rows}"


def test_the_rotation_is_on_the_page_as_a_matrix(result):
    words = Page(ALIGN_REPORT.render(result)).words
    for value in result.units[0].sensor_from_primary.ravel():
        assert fixed(float(value), 6) in words


def test_the_picture_names_every_unit(result):
    text = ALIGN_REPORT.render(result)
    assert text.count("<svg") >= 1
    picture = Page(text).words
    for name in ("unit_0", "unit_1", "unit_2"):
        assert picture.count(name) >= 3


def test_unobservable_values_come_first_with_reason_and_no_picture(hidden):
    text = ALIGN_REPORT.render(hidden)
    page = Page(text)
    assert "What this motion did not show" in page.words
    assert page.words.index("about one axis only") < page.words.index("Parameters")
    assert "places" not in page.ids
    assert "nan" not in page.words.lower().split()
    assert np.isnan(hidden.units[0].lever_arm).all()


def test_a_name_with_signs_of_html_does_not_become_html(result, tmp_path):
    named = replace(result, primary="<b>1</b>", units=(replace(result.units[0], name="a&<i>"),))
    ALIGN_REPORT.write(named, tmp_path / "align.html")
    text = (tmp_path / "align.html").read_text()
    assert "<b>1</b>" not in text
    assert "<i>" not in text


def test_badge_states_whether_all_rotations_and_arms_were_observable(result, hidden):
    assert result.verdict == "aligned"
    assert "● Aligned Rotation and lever arm" in Page(ALIGN_REPORT.render(result)).words
    assert hidden.verdict == "partly aligned"
    assert "◐ Partly aligned The motion did not show all" in Page(ALIGN_REPORT.render(hidden)).words


def test_a_notebook_shows_every_parameter_and_what_was_not_shown(result, hidden):
    shown = Page(result._repr_html_())
    assert [row[0] for row in shown.rows[1:]] == [each.name for each in result.units[0].parameters]
    assert shown.rows[0][1:] == [unit.name for unit in result]
    assert "not observable" not in result._repr_html_()
    assert "not observable" in hidden._repr_html_()
