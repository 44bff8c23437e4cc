"""The page of a spin: whole, self-contained, complete, safe and repeatable."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import report_spin_cases as spins
from report_reader import Page
from tumble.procedures.spin.report.page import MOST_DRAWN, SPIN_REPORT
from tumble.report.numbers import MINUS

UNIT_FACTORS = {
    "m/s²": 1.0,
    "mm/s²": 1e3,
    "rad/s": 1.0,
    "mrad/s": 1e3,
    "µrad/s": 1e6,
    "m": 1.0,
    "mm": 1e3,
    "%": 1e2,
    "ppm": 1e6,
    "deg": 1.0,
}
RESULTS = {
    "one": spins.session,
    "several": spins.several,
    "short": lambda: spins.session(spins.short_spin()),
    "unobserved": spins.unobserved,
}


@pytest.fixture(scope="module")
def pages():
    return {name: Page(SPIN_REPORT.render(make())) for name, make in RESULTS.items()}


def as_number(text):
    return float(text.replace(MINUS, "-"))


def shown_parameters(page):
    """Cells of each parameter with the factor to its unit, one list a spin."""
    found, factor = [], 1.0
    for row in page.rows:
        if row and row[0] == "parameter":
            found.append({})
        unit = row[0].rpartition(", ")[2] if row else ""
        if len(row) == 2 and unit in UNIT_FACTORS:
            factor = UNIT_FACTORS[unit]
        elif found and len(row) >= 2 and re.match(r"[a-z][a-z -]+( [xyz])?$", row[0]):
            found[-1].setdefault(row[0], (factor, row[1:]))
    return found


@pytest.mark.parametrize("name", RESULTS)
def test_every_parameter_is_printed_to_the_digits_of_its_sigma(pages, name):
    result, shown = RESULTS[name](), shown_parameters(pages[name])
    assert len(shown) == len(result.spins)
    for spin, rows in zip(result.spins, shown, strict=True):
        for parameter in (*spin.parameters, spin.slow_turn):
            if not parameter.observable:
                continue
            factor, cells = rows[parameter.name]
            offset = 1.0 if "scale" in parameter.name else 0.0
            value, sigma = as_number(cells[0]) / factor, as_number(cells[1]) / factor
            low, high = (as_number(end) / factor for end in cells[2].split(" to "))
            assert value == pytest.approx(parameter.value - offset, abs=0.06 * parameter.sigma)
            assert sigma == pytest.approx(parameter.sigma, rel=0.06)
            assert low == pytest.approx(parameter.low - offset, abs=0.06 * parameter.sigma)
            assert high == pytest.approx(parameter.high - offset, abs=0.06 * parameter.sigma)


@pytest.mark.parametrize("name", ["one", "short", "unobserved"])
def test_unobservable_value_is_words_and_no_number(pages, name):
    spin, rows = RESULTS[name]().spins[0], shown_parameters(pages[name])[0]
    for parameter in spin.parameters:
        if not parameter.observable:
            cells = rows.get(parameter.name, (0, []))[1]
            rest = " ".join(cells).replace(parameter.reason, "")
            assert not re.search(r"\d", rest)
            assert any(parameter.name == row[0] for row in pages[name].rows if row)
            assert parameter.reason in pages[name].words
    assert "What these spins did not show" in pages[name].words


def test_headline_states_both_biases_with_sigma_and_their_basis(pages):
    words = pages["one"].words
    assert "The level-free bias is the result." in words
    assert "Both biases found" in words
    assert (
        f"Accelerometer bias: x 0.2013 ± 0.0011, y {MINUS}0.1507 ± 0.0012, z 0.30210 ± 0.00041 m/s²" in words
    )
    assert f"Gyroscope bias: x 20.130 ± 0.031, y {MINUS}10.090 ± 0.032, z 15.020 ± 0.043 mrad/s" in words
    assert "Level-free: over a full turn of heading" in words
    assert "Chi-square 27.3 for 29 degrees of freedom" in words


def test_bias_from_under_a_turn_is_not_called_free_of_the_floor(pages):
    words = pages["short"].words
    assert "by the published method, which holds on a level floor only" in words
    assert "Level-free: over a full turn" not in words
    assert (
        f"The level-free bias is not observable, so there is nothing to compare: {spins.NO_LEVEL_FREE}"
        in words
    )
    assert "The line for a level floor is not drawn" in words
    assert "Floor tilt: not observable. Lever arm: not observable." in words


def test_a_bias_that_was_not_found_is_a_reason_in_the_headline(pages):
    words = pages["unobserved"].words
    assert "Gyroscope bias only" in words
    assert "Neither is known well enough to be the result." in words
    assert "bias is the result" not in words
    assert "Accelerometer bias: not observable: the robot did not turn enough." in words
    assert "not observable with compensation" in words


def test_level_free_and_published_differ_by_the_tilt(pages):
    spin = spins.spin()
    rows = {row[0]: row[1:] for row in pages["one"].rows if len(row) == 4 and row[0] in ("x", "y", "z")}
    for k, axis in enumerate("xyz"):
        level_free, published, difference = rows[axis]
        assert as_number(level_free.split(" ± ")[0]) == pytest.approx(spin.level_free.value[k], abs=1e-4)
        assert as_number(published.split(" ± ")[0]) == pytest.approx(spin.published.value[k], abs=1e-4)
        apart = spin.published.value[k] - spin.level_free.value[k]
        assert as_number(difference) == pytest.approx(apart, abs=1e-4)
    found = re.search(r"a floor tilted by ([\d.]+) ± ([\d.]+) deg", pages["one"].words)
    across = np.array([0.79, 0.61, -0.06])
    across = np.linalg.norm(across - across @ spins.UP * spins.UP)
    assert float(found[1]) == pytest.approx(spins.TILT * across, abs=0.01)
    assert "the fit has a floor tilt of 1.0300 ± 0.0031 deg" in pages["one"].words


def test_fit_worse_than_the_noise_is_reported_at_the_top():
    bad = spins.session(replace(spins.spin(), chi_square=290.0, widening=16.2))
    words = Page(SPIN_REPORT.render(bad)).words
    assert "The model does not explain all that spin 1 measured" in words
    assert "differs from the model by more than its noise" in words
    assert "The model and the noise explain" not in words
    assert "Model not met" in words


def test_several_spins_stand_beside_what_they_agree_on(pages):
    result, found = spins.several(), pages["several"]
    assert "All spins: gyroscope scale clockwise" in found.words
    assert "The spins agree: chi-square of the spins against their mean 7.97" in found.words
    for bias, attribute, unit in (
        (result.accelerometer_bias, "accelerometer_bias", 1.0),
        (result.gyroscope_bias, "gyroscope_bias", 1e3),
    ):
        wanted = [*(getattr(spin, attribute) for spin in result.spins), bias]
        labels = [*(spin.label for spin in result.spins), "all spins"]
        rows = [row for row in found.rows if row and row[0] in labels and " ± " in " ".join(row)]
        rows = rows[:4] if unit == 1.0 else rows[4:]
        assert [row[0] for row in rows] == labels
        for row, each in zip(rows, wanted, strict=True):
            for cell, value, sigma in zip(row[1:4], each.value, each.sigma, strict=True):
                shown = [as_number(text) / unit for text in cell.split(" ± ")]
                assert shown[0] == pytest.approx(value, abs=0.06 * sigma)
                assert shown[1] == pytest.approx(sigma, rel=0.06)


def test_contradictory_spins_are_not_reported_to_agree():
    result = spins.several()
    words = Page(SPIN_REPORT.render(replace(result, agreement=replace(result.agreement, value=61.0)))).words
    assert "The spins differ from each other by more than their sigma" in words
    assert "The spins agree" not in words


def test_refused_stretches_warnings_and_method_are_reported(pages):
    result, found = spins.session(spins.short_spin()), pages["short"]
    assert ["2.0 to 5.1", result.refused[0][2]] in found.rows
    for text in (
        result.warnings[0],
        f"Spin 1: {result.spins[0].warnings[0]}",
        "9.80665 m/s² (standard)",
        "IMU-0042",
        "24.6 °C",
        "tumble 0.1.0",
    ):
        assert text in found.words


def test_each_rest_is_listed_with_its_readings(pages):
    rests = [row for row in pages["one"].rows if len(row) == 11 and row[1] == "spin 1"]
    for row, rest in zip(rests, spins.spin().rests, strict=True):
        assert [as_number(cell) for cell in row[4:7]] == pytest.approx(rest.specific_force, abs=5e-5)
        assert [as_number(cell) for cell in row[7:10]] == pytest.approx(rest.angular_rate, abs=5e-6)


def test_names_from_a_file_cannot_become_markup():
    evil = "<script>alert('x')</script> & $x_1$"
    bad = replace(
        spins.spin(),
        label=evil,
        warnings=(evil,),
        rests=tuple(replace(rest, remark=evil) for rest in spins.spin().rests),
        parameters=tuple(
            replace(each, reason="" if each.observable else evil) for each in spins.spin().parameters
        ),
    )
    result = spins.session(
        bad,
        name=evil,
        source=evil,
        serial=evil,
        refused=((0.0, 1.0, evil),),
        warnings=(evil,),
        options={"at": evil},
        software=evil,
    )
    for text in (SPIN_REPORT.render(result), result._repr_html_()):
        found = Page(text)
        assert "script" not in found.tags
        assert evil in "".join(found.text)


def test_many_spins_are_all_in_tables_and_the_page_stays_light():
    many = [spins.spin(number, 60.0 * number) for number in range(1, 31)]
    text = SPIN_REPORT.render(spins.session(*many))
    found = Page(text)
    assert len(text.encode()) < 800_000
    assert len(shown_parameters(found)) == 30
    assert found.words.count(f"Pictures are drawn of the first {MOST_DRAWN} spins only.") == 30 - MOST_DRAWN


def test_a_spin_without_blocks_has_a_page_that_says_so():
    nothing = np.empty(0)
    empty = replace(
        spins.spin().blocks,
        time=nothing,
        resting=nothing,
        heading=nothing,
        rate=nothing,
        across=np.empty((0, 2)),
        force=np.empty((0, 3)),
        fit=np.empty((0, 3)),
    )
    found = Page(SPIN_REPORT.render(spins.session(replace(spins.spin(), blocks=empty))))
    assert "No samples of this spin were kept to draw." in found.words
    assert "Gravity over heading" not in found.words
    assert "From above" in found.words


def test_a_notebook_shows_each_parameter_of_each_spin():
    result = spins.several()
    table = Page(result._repr_html_())
    names = [row[:2] for row in table.rows if len(row) == 5 and row[0].startswith("spin")]
    expected = [
        [spin.label, each.name] for spin in result.spins for each in (*spin.parameters, spin.slow_turn)
    ]
    assert sorted(names) == sorted(expected)
