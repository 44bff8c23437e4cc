"""`tumble demo` shows commands that can be typed, and what they find."""

from __future__ import annotations

import re
import shlex

import pytest

from tumble.tools.demo import comparison
from tumble.tools.demo.scene import TARGETS
from turntable_sessions import one_line, typed


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo") / "results"
    return folder, typed("demo", "-o", folder)


def test_the_faulty_target_alone_fails_and_the_report_is_written(demo):
    folder, done = demo
    assert done.code == 0, done.err
    for name in TARGETS[:-1]:
        assert f"{name}: Pass" in done.out
    assert "target_5: fail: accelerometer scale y" in done.out
    assert "4 pass, 1 fail" in done.out
    assert "target_5" in (folder / "turntable.html").read_text(encoding="utf-8")
    assert done.out.rstrip().endswith(f"Now open {folder / 'turntable.html'}")


def test_the_commands_shown_do_the_same_when_they_are_typed(demo):
    _, done = demo
    shown = re.findall(r"^\$ tumble (.*)$", done.out, re.MULTILINE)
    assert [typed(*shlex.split(words)).code for words in shown] == [0, 3]


def test_every_target_is_compared_with_its_truth(demo):
    folder, done = demo
    found = list(comparison.differences(folder))
    assert tuple(each.name for each in found) == TARGETS
    assert all(each.line() in done.out for each in found)


def test_calibration_further_from_truth_than_noise_explains_is_a_bug(demo, monkeypatch):
    folder, _ = demo
    monkeypatch.setattr(comparison, "LARGEST_MATRIX_ERROR", 1e-9)
    with pytest.raises(ArithmeticError, match="target_1 accelerometer: M has an error of"):
        list(comparison.differences(folder))


def test_a_folder_that_cannot_be_written_to_is_one_line(tmp_path):
    (tmp_path / "file").touch()
    done = typed("demo", "-o", tmp_path / "file" / "results")
    assert done.code == 2
    assert one_line(done.err).startswith(f"{tmp_path / 'file' / 'results'}: cannot write")
