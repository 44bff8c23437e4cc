"""Real robots, recorded by others: none of them turned on the spot, and `tumble spin` has to report it."""

from __future__ import annotations

from pathlib import Path

import pytest

from turntable_sessions import contents, one_line, typed

HUSKY = Path(__file__).parents[3] / "shared" / "data" / "husky"

pytestmark = pytest.mark.skipif(not HUSKY.is_dir(), reason="the recordings in ../shared/data are not here")


@pytest.mark.parametrize("name", ["test1", "test2"])
def test_a_drive_without_a_turn_on_the_spot_is_said_to_lack_one(tmp_path, name):
    done = typed("spin", HUSKY / f"{name}.bag", "-o", tmp_path / "out")
    assert done.code == 2
    line = one_line(done.err)
    assert line.startswith(f"{name}: shows no spin that can be used: ")
    assert line.endswith("let the robot stand still for 5 s, then turn on the spot once round or more")
    assert contents(tmp_path / "out") == {}


def test_inspect_agrees_that_there_is_none():
    done = typed("inspect", HUSKY / "test1.bag")
    assert "spin: no, it needs a full turn on the spot" in done.text


def test_times_in_the_middle_of_the_drive_do_not_make_it_a_spin(tmp_path):
    done = typed("spin", HUSKY / "test2.bag", "-o", tmp_path / "out", "--at", "65:120")
    assert done.code == 2
    one_line(done.err)
