"""Effect of mounting on the off-diagonals of M: ignored, compensated as published, and by Tumble."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest
import yaml

import tumble
from report_reader import Page
from theory_formulas import seeded
from tumble.procedures.turntable.off_diagonals import ELEMENTS, sine_of_lean
from tumble.report.numbers import MINUS
from turntable_sessions import typed

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A session whose structure is mounted 6 deg off, and the truth of its target."""
    folder = tmp_path_factory.mktemp("mounted")
    made = typed(
        *("simulate", "turntable", "--mounting", "6", "--grades", "consumer", "--seed", "7", "-o", folder)
    )
    assert made.code == 0, made.err
    truth = yaml.safe_load((folder / "truth.yaml").read_text())
    return folder, np.array(truth["R_e"]), np.array(truth["units"]["target_1"]["accelerometer"]["M"])


def leans(matrix):
    """Angle of each element, deg."""
    rows = matrix / np.linalg.norm(matrix, axis=1, keepdims=True)
    return np.array([np.degrees(np.arcsin(rows[element])) for element in ELEMENTS])


def test_ignored_mounting_leaves_table_off_diagonals(session):
    folder, R_e, M = session
    found = tumble.turntable(folder / "reference.csv", [folder / "target_1.csv"]).targets[0].off_diagonals

    def errors(way, wanted):
        stated = [getattr(each, way) for each in found]
        values, sigmas = np.array([[each.value, each.sigma] for each in stated]).T
        return (values - leans(wanted)) / sigmas, sigmas

    ignored, _ = errors("ignored", M @ R_e)
    assert np.abs(ignored).max() < 4.5
    published, published_sigma = errors("published", R_e.T @ M @ R_e)
    assert np.abs(published).max() < 4.5
    ours, sigma = errors("found", M)
    assert np.abs(ours).max() < 4.5
    assert (sigma < published_sigma).all()
    corrupted, _ = errors("ignored", M)
    assert np.abs(corrupted).max() > 50.0


def test_the_slope_of_the_lean_is_its_derivative():
    random = seeded()
    for _ in range(20):
        row, column = np.eye(3)[random.integers(3)] + random.normal(0.0, 0.3, 3), int(random.integers(3))
        _, slope = sine_of_lean(row, column)
        for k, step in enumerate(1e-6 * np.eye(3)):
            change = sine_of_lean(row + step, column)[0] - sine_of_lean(row - step, column)[0]
            assert slope[k] == pytest.approx(change / 2e-6, abs=1e-8)


def test_page_shows_off_diagonals_in_three_ways_with_sigmas(session, tmp_path):
    folder, R_e, M = session
    done = typed("turntable", folder / "reference.csv", folder / "target_1.csv", "-o", tmp_path)
    assert done.code == 0, done.err
    page = Page((tmp_path / "target_1.html").read_text(encoding="utf-8"))
    rows = [row for row in page.rows if row and row[0].startswith("M ")]
    assert [row[0] for row in rows] == [f"M {'xyz'[i]}{'xyz'[j]}" for i, j in ELEMENTS]
    for row, wanted in zip(rows, leans(M @ R_e), strict=True):
        ignored, published, ours = row[1:]
        assert float(ignored.split()[0].replace(MINUS, "-")) == pytest.approx(wanted, abs=0.1)
        assert all("±" in shown for shown in (ignored, published, ours))
    heads = page.rows[page.rows.index(rows[0]) - 1][1:]
    assert all(head.endswith("deg") for head in heads), heads


def test_without_poses_there_is_no_table_of_off_diagonals(session):
    folder, _, _ = session
    result = tumble.turntable(folder / "reference.csv", [folder / "target_1.csv"], poses=None)
    assert result.targets[0].off_diagonals == ()


def test_the_drawing_of_the_structure_is_what_its_script_draws():
    script = runpy.run_path(str(ROOT / "scripts" / "draw_structure.py"))
    assert script["DRAWING"].read_text(encoding="utf-8") == script["drawing"]()
