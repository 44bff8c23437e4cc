"""Targets of make are held against the processor time that they may take."""

from __future__ import annotations

import pytest
import timed_make
from timed_make import BUDGET, TOLERANCE, Made, over_budget

TARGETS = list(BUDGET)


@pytest.fixture
def make(tmp_path, monkeypatch):
    """A stand-in of make that notes its targets, and fails at `test-python`."""
    program = tmp_path / "make"
    notes = tmp_path / "notes"
    program.write_text(f'#!/bin/sh\necho "$2" >>{notes}\n[ "$2" != test-python ]\n')
    program.chmod(0o755)
    monkeypatch.setenv("MAKE", str(program))
    return lambda: notes.read_text().split()


def spends(monkeypatch, share):
    """Every target takes a share of what is tolerated."""
    monkeypatch.setattr(
        timed_make,
        "make",
        lambda targets: [Made(each, 0, 1.0, share * TOLERANCE * BUDGET[each]) for each in targets],
    )
    monkeypatch.setattr(timed_make, "unit", lambda: 1.0)


def test_targets_of_a_step_run_together_and_a_failure_ends_all(make):
    assert timed_make.main(["test-rust+test-tools", "test-python", "test-commands"]) == 1
    assert sorted(make()) == ["test-python", "test-rust", "test-tools"]


def test_target_over_its_budget_fails_in_ci_alone(monkeypatch, capsys):
    for share, is_ci, code in ((1.01, "true", 1), (1.01, "", 0), (0.99, "true", 0)):
        spends(monkeypatch, share)
        monkeypatch.setenv("CI", is_ci)
        assert timed_make.main(TARGETS) == code
        assert capsys.readouterr().err.count("of its budget; shorten it") == (
            len(TARGETS) if share > 1 else 0
        )


def test_slower_computer_is_allowed_more_seconds():
    seconds = 1.5 * TOLERANCE * BUDGET["test-rust"]
    assert over_budget([Made("test-rust", 0, 1.0, seconds, speed=1.0)])
    assert not over_budget([Made("test-rust", 0, 1.0, seconds, speed=2.0)])


def test_each_step_is_held_against_the_speed_beside_it(monkeypatch, capsys):
    """The computer is three times slower from the second step on."""
    spends(monkeypatch, 1.5)
    speeds = iter([3.0, 3.0, 1.0, 1.0])
    monkeypatch.setattr(timed_make, "unit", lambda: next(speeds))
    monkeypatch.setenv("CI", "true")
    assert timed_make.main(["test-rust", "test-python", "test-commands"]) == 1
    assert capsys.readouterr().err.startswith("test-commands took")
