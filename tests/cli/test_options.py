"""Options as people type them: cut short, and found in the help where they belong."""

from __future__ import annotations

import pytest

from log_fixtures import made_up, write
from turntable_sessions import typed

READING = "Reading options"


@pytest.fixture
def log(tmp_path):
    return write(tmp_path / "log.csv", made_up(300))


@pytest.mark.parametrize("option", ["--gyroscope-u", "--gyroscope-uni", "--gyroscope-unit"])
@pytest.mark.parametrize("sign", [" ", "="])
def test_option_may_be_any_unambiguous_prefix(log, option, sign):
    words = f"{option}{sign}rpm".split(" ")
    done = typed("inspect", log, *words)
    assert "--gyroscope-unit rpm" in done.err


def test_ambiguous_option_prefix_is_refused_with_its_candidates(log):
    done = typed("inspect", log, "--gyroscope", "rpm")
    assert done.code == 2
    assert "--gyroscope-unit" in done.err
    assert "--gyroscope-zero" in done.err


def test_an_option_is_not_completed_behind_two_dashes(log):
    done = typed("inspect", "--", log, "--gyroscope-u")
    assert "--gyroscope-u: no such file" in done.err


def test_commands_of_simulate_take_options_cut_short_too(tmp_path):
    done = typed("simulate", "spin", "--floor", "2", "--out", tmp_path, "--js")
    assert done.code == 0, done.err
    assert done.out.startswith("{")


@pytest.mark.parametrize("command", ["turntable", "spin", "redundancy", "align", "apply", "inspect"])
def test_reading_options_stand_together_at_the_end_of_the_help(command):
    shown = typed(command, "--help").out
    own, _, reading = shown.partition(READING)
    assert "--output" in own or command == "inspect"
    for option in ("--columns", "--gyroscope-unit", "--serial"):
        assert option in reading
        assert option not in own
    assert "--help" not in reading
    assert ("--for" in reading) == (command in ("turntable", "redundancy", "align"))
