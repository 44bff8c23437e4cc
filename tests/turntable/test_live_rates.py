"""A live session on a table that turns at constant rates, from what a user types to scale by rate."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

from live_benches import simulated_bench, words_of
from tumble.poses.pose_list import SIX_FACES
from turntable_sessions import typed

RATES = [10.0, 30.0]
TARGETS = ("target_1", "target_2")
TRUTH = ("--truth", "table", "--rate-accuracy", "40")
MOST_SIGMAS = 5.0
"""Largest error of any of the 14 figures, in sigmas."""


def listed(path):
    """Writes a pose list with rates, deg/s, as a user does."""
    poses = [{"name": pose.name, "up": pose.up.tolist()} for pose in SIX_FACES]
    path.write_text(yaml.safe_dump({"poses": poses, "rates": RATES, "rate_seconds": 6.0}))
    return path


def gyroscopes(folder):
    """Gyroscope of each target in the files of a folder."""
    files = {name: yaml.safe_load((folder / f"{name}.yaml").read_text()) for name in TARGETS}
    return {name: file["gyroscope"] for name, file in files.items()}


def test_live_session_finds_scale_by_rate_with_the_table_as_truth(tmp_path):
    with simulated_bench(seed=96) as bench:
        done = typed(
            *("turntable", "--live", *words_of(bench), "--table", bench.table_address, "--armed"),
            *("--poses", listed(tmp_path / "poses.yaml"), "--pose-seconds", "3s", *TRUTH),
            *("-o", tmp_path / "out", "--json"),
        )
        truth = bench.truth
    assert done.code == 0, done.err
    events = [json.loads(line) for line in done.out.splitlines()]
    aims = [each["subject"].partition(": ")[2] for each in events if each["event"] == "pose wanted"]
    assert {f"inner at {sign}{rate:g} deg/s" for rate in RATES for sign in ("", "-")} <= set(aims)
    assert [each["text"] for each in events if each["event"] == "warning"] == []
    session = tmp_path / "out" / "session"
    for folder, words in (("again", TRUTH), ("reference", ())):
        again = typed("turntable", session, *words, "-o", tmp_path / folder)
        assert again.code == 0, again.err
    live = gyroscopes(tmp_path / "out")
    assert live == gyroscopes(tmp_path / "again")
    by_reference = gyroscopes(tmp_path / "reference")
    for name in TARGETS:
        true = np.array(truth["units"][name]["gyroscope"]["M"])
        assert_taken_from_the_table(live[name], true)
        assert_scale_by_rate(by_reference[name], true)


def assert_taken_from_the_table(found, true):
    """Scale about the axis that turns is the table's, with its accuracy within sigma."""
    column = np.array(found["M"])[:, 2]
    inherited = np.array(found["inherited"]["covariance"], dtype=float)
    assert "table" in found["inherited"]["source"]
    assert np.sqrt(inherited[8, 8]) == pytest.approx(40e-6 * column[2], rel=1e-3)
    variance = np.array(found["covariance"], dtype=float)[8, 8] + inherited[8, 8]
    assert abs(column[2] - true[2, 2]) < MOST_SIGMAS * np.sqrt(variance)


def assert_scale_by_rate(found, true):
    """Scale follows from the reference, level by level."""
    scale = np.linalg.norm(true, axis=1)
    off = (np.diag(found["K"]) - scale) / found["sigma"]["scale"]
    assert np.abs(off).max() < MOST_SIGMAS, off
    [about] = found["constant_rates"]
    assert about["axis"] == "z", "the axis without limits turns about it"
    held = sorted(sign * rate for rate in RATES for sign in (1.0, -1.0))
    assert [each["rate"] for each in about["levels"]] == pytest.approx(held, rel=2e-3)
    for each in (*about["levels"], about):
        assert abs(each["scale"] - scale[2]) < MOST_SIGMAS * each["scale_sigma"], each
