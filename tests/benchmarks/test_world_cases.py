"""Recordings of others get the answers that they need."""

from __future__ import annotations

import shutil

import pytest
from benchmarks.results import load
from benchmarks.world_cases import CASES, OPEN, WORLD, failing

from typed_commands import typed

OF_SETS = ("redundancy", "clocks", "frozen", "gyro_noise")
"""Redundant sets, whose missions take longer: `python -m benchmarks.cases` replays them."""


@pytest.mark.parametrize(
    "case",
    [case for case in CASES if not case.folder.startswith(OF_SETS) and case.name not in OPEN],
    ids=lambda case: case.command.replace(" ", "_"),
)
def test_recording_of_others_gets_its_answer(tmp_path, case, monkeypatch):
    if not WORLD.exists():
        pytest.skip(f"no recordings of others: {WORLD} is absent")
    monkeypatch.setenv("COLUMNS", "200")
    shutil.copytree(WORLD / case.folder, tmp_path / "files")
    monkeypatch.chdir(tmp_path / "files")
    done = typed(*case.command.split())
    assert failing(case, done.code, done.out + done.err) == ""


def test_open_cases_are_those_that_the_benchmark_found_wrong():
    assert {case.name for case in CASES} >= OPEN
    rows = load("cases")["world"]
    assert {row["case"] for row in rows if row["missing"]} == OPEN
