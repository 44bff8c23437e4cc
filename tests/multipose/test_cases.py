"""Cases of ../shared/data/cases: hand-held sessions whose truth is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

import tumble

CASES = Path(__file__).parents[3] / "shared" / "data" / "cases"

pytestmark = pytest.mark.skipif(not CASES.is_dir(), reason="the cases in ../shared/data are not here")

OWN = [0, 3, 4, 6, 7, 8, 9, 10, 11]
"""Free elements of [M, b] of an accelerometer in its own axes."""
LARGEST = 4.5
"""Sigmas beyond which one of 21 figures errs once in seven thousand sessions."""


def calibrated(case, name="hand"):
    read = tumble.ReadOptions(gyroscope_unit="rad/s")
    return tumble.multipose(CASES / case / f"{name}.parquet", read=read)


def sigmas_off(triad, truth, free):
    """Error of each figure over its sigma."""
    found = np.concatenate([triad.M.ravel(), triad.b])
    true = np.concatenate([np.ravel(truth["matrix"]), truth["bias"]])
    return (found - true)[free] / np.sqrt(np.diag(triad.covariance)[free])


def true_figures(case):
    return yaml.safe_load((CASES / case / "truth.yaml").read_text())


def assert_holds(found, truth):
    assert found.verdict == "calibrated"
    assert np.abs(sigmas_off(found.accelerometer, truth["accelerometer"], OWN)).max() < LARGEST
    assert np.abs(sigmas_off(found.gyroscope, truth["gyroscope"], range(12))).max() < LARGEST


def test_clipped_force_in_turns_costs_no_turn():
    found = calibrated("multipose_clipped")
    assert len(found.turns) == 21
    assert np.sqrt(found.gyroscope.covariance[0, 0]) < 2e-4
    assert_holds(found, true_figures("multipose_clipped"))


def test_clipped_samples_are_counted_by_channel_and_turn():
    found = calibrated("multipose_clipped")
    clipped = [line for line in found.warnings if "end of its range" in line]
    assert len(clipped) == 3
    assert all("of 14178 samples" in line and "of 21 turns" in line for line in clipped)
    assert sum(int(line.split(" in ")[1].split()[0]) for line in clipped) == 32


@pytest.mark.parametrize("name", ["hand", "hand_all"])
def test_trembling_poses_are_rests_with_more_sigma(name):
    found = calibrated("multipose_tremor", name)
    truth = true_figures("multipose_tremor")
    assert (len(found.poses), len(found.turns)) == (22, 21)
    assert_holds(found, truth)
    # Quiet or not, a rest shows the gyroscope as well.
    assert np.sqrt(np.diag(found.gyroscope.covariance)[:9]).max() < 2e-4


def test_trembling_rests_are_named_by_amplitude_and_frequency():
    found = calibrated("multipose_tremor")
    held = true_figures("multipose_tremor")["held"]
    remarks = [rest.remark for rest in found.rests if rest.used]
    assert [bool(remark) for remark in remarks] == held
    figures = [[float(part.split()[0]) for part in remark[10:].split(" at ")] for remark in remarks if remark]
    assert np.allclose(figures, [44.0, 8.0], rtol=0.08)
    assert found.trembling == 16
