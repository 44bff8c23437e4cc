"""The report as files: whole, self-contained, complete, safe and repeatable."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import report_fixtures as sessions
from report_reader import Page
from tumble.foundation.errors import OutputError
from tumble.procedures.turntable.report.notebook import batch_html, target_html
from tumble.procedures.turntable.report.pages import page_names, records_of, render_batch, write_reports
from tumble.procedures.turntable.report.readings import deviations
from tumble.report.numbers import MINUS

UNIT_FACTORS = {
    "m/s²": 1.0,
    "mm/s²": 1e3,
    "µm/s²": 1e6,
    "rad/s": 1.0,
    "mrad/s": 1e3,
    "µrad/s": 1e6,
    "%": 1e2,
    "ppm": 1e6,
    "deg": 1.0,
}


@pytest.fixture(scope="module")
def result():
    return sessions.batch()


@pytest.fixture(scope="module")
def folder(result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    write_reports(result, folder)
    return folder


def page(folder, name):
    return Page((folder / name).read_text(encoding="utf-8"))


def run_python(code, *arguments, **settings):
    """Runs code in a process of its own that finds the same modules."""
    found = {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[1] / "support"), *sys.path])}
    subprocess.run([sys.executable, "-c", code, *arguments], check=True, env=os.environ | found | settings)


def shown_parameters(page):
    """Value, sigma and interval of each parameter, in SI, by triad and name, as the page prints them."""
    found, factor, triad = {}, 1.0, -1
    for row in page.rows:
        if row and row[0] == "parameter" and "95 % interval" in row:
            triad += 1
        unit = row[0].rpartition(", ")[2] if row else ""
        if len(row) == 2 and unit in UNIT_FACTORS:
            factor = UNIT_FACTORS[unit]
        elif len(row) >= 4 and re.match(r"(bias|scale|non-orthogonality|mounting) \w+$", row[0]):
            found[triad, row[0]] = (factor, row[1:])
    return found


def as_number(text):
    return float(text.replace(MINUS, "-"))


def test_every_target_has_a_page_and_the_batch_page_comes_first(result, tmp_path):
    paths = write_reports(result, tmp_path / "made" / "for it")
    assert paths[0].name == "turntable.html"
    assert [path.stem for path in paths[1:]] == [target.name for target in result.targets]
    assert sorted(path.name for path in paths[0].parent.iterdir()) == sorted(path.name for path in paths)


@pytest.mark.parametrize("name", ["target_1", "target_2", "target_4", "target_5"])
def test_every_parameter_is_printed_to_the_digits_of_its_sigma(folder, result, name):
    shown = shown_parameters(page(folder, f"{name}.html"))
    target = result[name]
    for index, triad in enumerate((target.accelerometer, target.gyroscope)):
        for parameter in triad.parameters:
            if not parameter.observable:
                continue
            factor, cells = shown[index, parameter.name]
            offset = 1.0 if parameter.name.startswith("scale") else 0.0
            value, sigma = as_number(cells[0]) / factor, as_number(cells[1]) / factor
            low, high = (as_number(end) / factor for end in cells[2].split(" to "))
            assert value == pytest.approx(parameter.value - offset, abs=0.06 * parameter.sigma)
            assert sigma == pytest.approx(parameter.sigma, rel=0.06)
            assert low == pytest.approx(parameter.low - offset, abs=0.06 * parameter.sigma)
            assert high == pytest.approx(parameter.high - offset, abs=0.06 * parameter.sigma)


def test_unobservable_value_is_words_on_the_page_and_no_number(folder, result):
    found = page(folder, "target_4.html")
    rows = shown_parameters(found)
    for parameter in result["target_4"].gyroscope.parameters:
        if not parameter.observable:
            _, cells = rows.get((1, parameter.name), (0, []))
            assert not re.search(r"\d", " ".join(cells))
            assert any(parameter.name == row[0] for row in found.rows if row)
    assert "What this session did not show" in found.words
    assert sessions.NO_SCALE in found.words
    assert re.search(r"M\s+sensor from case\s+not observable: ", found.words)


def test_the_page_says_verdict_reason_method_and_warnings(folder, result):
    failed = page(folder, "target_2.html").words
    assert "Fail" in failed
    assert "1 of 9 limits failed: accelerometer bias" in failed
    refused = page(folder, "target_3.html").words
    assert "Not calibrated" in refused
    assert result["target_3"].failure in refused
    warned = page(folder, "target_5.html").words
    assert result["target_5"].warnings[0] in warned
    for text in ("9.80665 m/s² (standard)", "HG4930-0042", "SN-1005", "tumble 0.1.0", "24.6 °C", "9f2c0000"):
        assert text in warned


def test_table_error_clock_noise_and_matrices_stand_on_the_page(folder, result):
    found = page(folder, "target_1.html")
    for pose in result.poses:
        row = next(row for row in found.rows if row and row[0] == pose.name and " ± " in " ".join(row))
        assert f"{pose.table_error_angle:.4f} ± 0.0012" in row
    assert "offset 1.2346 ± 0.0021 s, skew 14.2 ± 3.3 ppm" in found.words
    density = 1e3 * result["target_1"].accelerometer.noise_density
    row = next(row for row in found.rows if row and row[0] == "accelerometer noise density")
    assert [as_number(cell) for cell in row[1:4]] == pytest.approx(density, rel=0.01)
    assert "none seen" in next(row for row in found.rows if row and row[0] == "gyroscope bias instability")
    for entry in result["target_1"].accelerometer.Q.ravel():
        assert f"{abs(entry):.6f}" in found.words


def test_each_rest_is_listed_with_readings_and_rejection_reason(folder, result):
    found = page(folder, "target_1.html")
    for number, rest in enumerate(result["target_1"].rests, start=1):
        row = next(row for row in found.rows if len(row) == 11 and row[0] == str(number))
        shown = [as_number(cell) for cell in row[4:7]]
        assert shown == pytest.approx(rest.specific_force, abs=0.06 * rest.specific_force_sigma[0])
        assert row[10] == ("" if rest.used else "not used: moved during the rest")


def test_pages_without_mounting_angle_give_the_reason(tmp_path):
    result = sessions.batch_without_mounting()
    write_reports(result, tmp_path)
    for name in ("turntable.html", "target_1.html"):
        found = page(tmp_path, name)
        assert result.reference.mounting_reason in found.words
        assert "without compensation" not in found.words
    assert "0.600 ± 0.016" not in page(tmp_path, "turntable.html").words


def test_the_batch_page_leads_to_every_target_worst_first(folder, result):
    found = page(folder, "turntable.html")
    table = [row[0] for row in found.rows if row and row[0] in {target.name for target in result.targets}]
    assert table == ["target_3", "target_2", "target_5", "target_1", "target_4"]
    assert {f"{target.name}.html" for target in result.targets} <= set(found.links)
    assert result["target_3"].failure in found.words
    assert f"x 0.600 ± 0.016 deg, y {MINUS}0.800 ± 0.016 deg, z 0.450 ± 0.016 deg" in found.words
    assert "How to read this page." in found.words
    assert result.warnings[0] in found.words


def test_a_batch_of_many_targets_keeps_every_one_and_stays_light(tmp_path):
    result = sessions.many_targets(500)
    text = render_batch(result, records_of(result))
    found = Page(text)
    assert {f"{target.name}.html" for target in result.targets} <= set(found.links)
    assert "460 more targets" in found.words
    assert len(text.encode()) < 1_500_000


def test_names_from_a_file_cannot_become_markup_nor_leave_the_folder(result, tmp_path):
    evil = "<script>alert('x')</script>/../$x_1$"
    target = replace(
        result["target_2"],
        name=evil,
        serial=f"{evil} serial",
        source=evil,
        warnings=(evil,),
        rests=tuple(replace(rest, pose=evil, remark=evil) for rest in result["target_2"].rests),
        axis_readings=tuple(
            replace(r, labels=(evil,) * len(r.labels)) for r in result["target_2"].axis_readings
        ),
    )
    reference = replace(result.reference, name=evil, source=evil, serial=evil)
    poses = tuple(replace(pose, name=evil) for pose in result.poses)
    bad = replace(
        result, targets=(target,), reference=reference, poses=poses, warnings=(evil,), software=evil
    )
    paths = write_reports(bad, tmp_path)
    assert {path.parent for path in paths} == {tmp_path}
    for path in paths:
        found = Page(path.read_text(encoding="utf-8"))
        assert not found.tags & {"script"}
        assert evil in "".join(found.text)
    for text in (batch_html(bad), target_html(target)):
        assert "<script>" not in text
        assert evil in "".join(Page(text).text)


def test_no_two_pages_share_a_name_whatever_the_targets_are_called(result):
    names = ["turntable", "a/b", "a b", "A_B", "..", "", "a_b-2", "ok.v1"]
    pages = page_names([replace(result["target_1"], name=name) for name in names])
    folded = [name.casefold() for name in pages]
    assert len(set(folded)) == len(names)
    assert "turntable.html" not in folded
    assert pages[-1] == "ok.v1.html"
    assert all(re.fullmatch(r"[\w+-][\w.+-]*\.html", name) for name in pages)


def test_rewriting_gives_the_same_bytes_with_any_processes(result, folder, tmp_path):
    many = replace(result, targets=tuple(replace(result["target_1"], name=f"t{k}") for k in range(9)))
    one = write_reports(many, tmp_path / "one")
    two = write_reports(many, tmp_path / "two", jobs=2)
    assert [path.name for path in one] == [path.name for path in two]
    assert all(a.read_bytes() == b.read_bytes() for a, b in zip(one, two, strict=True))


def test_a_page_that_cannot_be_written_leaves_what_was_there(result, tmp_path):
    (tmp_path / "turntable.html").write_text("<!doctype html>the last report")
    (tmp_path / "target_2.html").mkdir()
    with pytest.raises(OutputError, match=r"target_2\.html"):
        write_reports(result, tmp_path)
    assert (tmp_path / "turntable.html").read_text() == "<!doctype html>the last report"
    assert not list(tmp_path.glob(".*"))


def test_a_page_that_cannot_be_drawn_leaves_what_was_there(result, tmp_path):
    (tmp_path / "target_1.html").write_text("the last page")
    broken = replace(
        result["target_1"], trace=replace(result["target_1"].trace, accelerometer=np.zeros((2, 2)))
    )
    with pytest.raises((ValueError, IndexError)):
        write_reports(replace(result, targets=(broken,)), tmp_path)
    assert (tmp_path / "target_1.html").read_text() == "the last page"
    assert not list(tmp_path.glob(".*"))


def test_a_folder_that_cannot_be_made_is_one_clear_line(result, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError) as caught:
        write_reports(result, tmp_path / "file" / "out")
    assert "\n" not in str(caught.value)


def test_a_notebook_shows_each_parameter_and_each_target(result):
    table = Page(target_html(result["target_4"]))
    names = [row[1] for row in table.rows if len(row) == 5 and row[0] in ("accelerometer", "gyroscope")]
    expected = [
        p.name for t in (result["target_4"].accelerometer, result["target_4"].gyroscope) for p in t.parameters
    ]
    assert names == expected
    assert "not observable" in table.words
    batch = Page(batch_html(result))
    assert [row[0] for row in batch.rows[1:]] == [target.name for target in result.targets]
    assert result["target_3"].failure in batch.words


def test_limits_stand_beside_their_parameters_and_nowhere_else(folder, result):
    found = page(folder, "target_2.html")
    target = result["target_2"]
    rows = [row for row in found.rows if len(row) == 7 and re.match(r"bias \w$", row[0])]
    limited = [row for row in rows if row[4].startswith("±")]
    assert len(limited) == sum(" bias " in check.parameter for check in target.checks)
    broken = sum("not kept" in row[4] for row in limited)
    assert broken == sum(not check.passed for check in target.checks if " bias " in check.parameter)
    assert "limits" not in found.ids


def test_calibrated_state_is_beside_raw_and_compensated_readings(folder, result):
    number = r"([\d.]+) (m?m/s²)"
    caption = f"raw {number}, mounting compensated {number}, calibrated {number}"
    captions = re.findall(caption, page(folder, "target_1.html").words)
    readings = result["target_1"].axis_readings
    assert len(captions) == len(readings)
    for shown, reading in zip(captions, readings, strict=True):
        states = deviations(result["target_1"], reading, result.reference.mounting)
        said = [float(n) / UNIT_FACTORS[unit] for n, unit in zip(shown[::2], shown[1::2], strict=True)]
        left = [np.sqrt(np.mean(state**2)) for state in states.values()]
        assert said == pytest.approx(left, rel=0.06)
        assert left[2] < left[1]
