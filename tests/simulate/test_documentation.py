"""Statements of docs/how-to/simulate.md hold: options, faults, files, figures and the snippet."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from flight_units import fly
from tumble.tools.simulate import FAULTS, LIVE_FAULTS, VIBRATIONS
from turntable_sessions import typed

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "how-to" / "simulate.md").read_text(encoding="utf-8")


def commands():
    """Commands of the page as words, one for each."""
    joined = TEXT.replace("\\\n", " ")
    return [line.split() for line in re.findall(r"^    tumble (simulate .+)$", joined, re.MULTILINE)]


@pytest.mark.parametrize("words", commands(), ids=" ".join)
def test_every_command_of_the_page_runs(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = typed(*words)
    assert done.code == 0, done.err
    assert (tmp_path / words[-1] / "truth.yaml").exists()


def test_the_faults_of_the_page_are_those_there_are_in_the_same_words():
    told = dict(re.findall(r"^\| `([a-z-]+)` \| (.+) \|$", TEXT.split("## Faults")[1], re.MULTILINE))
    assert told == {kind: text.replace("m/s^2", "m/s²") for kind, text in FAULTS.items()}


def test_live_faults_of_page_and_help_are_those_that_exist():
    section = TEXT.split("## A live bench")[1].split("## Faults")[0]
    own = {kind: text for kind, text in LIVE_FAULTS.items() if kind not in FAULTS}
    told = re.findall(r"^\| `([a-z-]+)` \| (.+) \|$", section.split("| kind |")[1], re.MULTILINE)
    assert dict(told) == own
    assert [kind for kind in LIVE_FAULTS if f"`{kind}`" not in section] == []
    text = typed("simulate", "live", "--help").text
    assert [kind for kind in LIVE_FAULTS if not re.search(rf"\b{kind}\b", text)] == []


def test_the_help_names_every_fault():
    for words in (("turntable",), ("flight",)):
        told = typed("simulate", *words, "--help").text
        assert [kind for kind in FAULTS if not re.search(rf"\b{kind}\b", told)] == []


def test_the_snippet_runs_and_shows_an_aged_secondary_at_rest():
    (snippet,) = (each for each in re.findall(r"```python\n(.+?)```", TEXT, re.DOTALL) if "Flight" in each)
    names = {}
    exec(compile(snippet, "simulate.md", "exec"), names)
    flight, error = names["flight"], names["error"]
    resting = names["secondary"].time < flight.rests[0, 1]
    unit = names["secondary"].accelerometer
    expected = unit.b + (unit.M - np.eye(3)) @ names["truth"].specific_force[0]
    np.testing.assert_allclose(error[resting].mean(axis=0), expected, rtol=0.0, atol=0.01)
    assert flight["primary"].time[-1] < 60.0


def row(start):
    (cells,) = re.findall(rf"^\| {re.escape(start)} \| (.+) \|$", TEXT, re.MULTILINE)
    return [[float(number) for number in cell.split(", ")] for cell in cells.split(" | ")]


@pytest.mark.parametrize("column", [0, 1, 2])
@pytest.mark.parametrize("motion", ["quadrotor", "vehicle"])
def test_motion_is_as_lively_as_the_page_says(motion, column):
    intensity = (0.3, 0.6, 1.0)[column]
    figures = []
    for seed in range(40):
        flight = fly(motion=motion, seed=seed, intensity=intensity, motion_seconds=60.0)
        time = np.arange(flight.manoeuvres[0, 0], flight.manoeuvres[-1, 1], 0.02)
        truth, path = flight.truth(time), flight.path(time)
        rate, scatter = truth.angular_rate, truth.specific_force.std(axis=0)
        if motion == "quadrotor":
            tilt = np.degrees(np.arccos(path.level_from_case[:, 2, 2].min()))
            across = np.hypot(scatter[0], scatter[1]) / np.sqrt(2.0)
            figures.append([np.linalg.norm(rate, axis=1).max(), tilt, across, scatter[2]])
        else:
            across = np.linalg.norm(rate[:, :2], axis=1).max()
            figures.append([np.abs(rate[:, 2]).max(), across, scatter[0], scatter[1]])
    rows = {
        "quadrotor": (
            "quadrotor: largest angular rate, rad/s",
            "largest tilt, deg",
            "scatter of specific force across and along up, m/s²",
        ),
        "vehicle": (
            "vehicle: largest angular rate about up and across it, rad/s",
            "scatter of specific force forward and left, m/s²",
        ),
    }
    told = [figure for name in rows[motion] for figure in row(name)[column]]
    # The page rounds to a tenth, or to two digits.
    assert np.median(figures, axis=0) == pytest.approx(told, rel=0.02, abs=0.06)


def test_the_vibration_of_the_page_is_the_usual_one():
    for motion, vibration in VIBRATIONS.items():
        tones = ", ".join(f"{tone:g}" for tone in vibration.tones_hz)
        low, high = vibration.band_hz
        expected = (
            f"| {motion} | {vibration.specific_force:g} m/s² | {vibration.angular_rate:g} rad/s "
            f"| {tones} Hz | {low:g} to {high:g} Hz |"
        )
        assert expected in TEXT


def test_the_grades_of_python_are_those_of_the_core():
    check = [sys.executable, ROOT / "scripts" / "write_grades.py", "--check"]
    done = subprocess.run(check, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
