"""A live session on a table that turns at constant rates, from what a user types to scale by rate."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

from live_benches import waiting_bench, words_of
from tumble.poses.pose_list import SIX_FACES
from turntable_sessions import typed

RATES = [10.0, 30.0]
MOST_SIGMAS = 5.0
"""Largest error of any of the 14 figures, in sigmas."""


def listed(path, rates=RATES):
    """Writes a pose list with rates, deg/s, as a user does."""
    poses = [{"name": pose.name, "up": pose.up.tolist()} for pose in SIX_FACES]
    path.write_text(yaml.safe_dump({"poses": poses, "rates": rates, "rate_seconds": 6.0}))
    return path


def test_rates_of_a_pose_list_give_scale_by_rate_live(tmp_path, monkeypatch):
    with waiting_bench(monkeypatch, seed=96) as bench:
        done = typed(
            *("turntable", "--live", *words_of(bench), "--table", bench.table_address, "--armed"),
            *("--poses", listed(tmp_path / "poses.yaml"), "--pose-seconds", "3s"),
            *("-o", tmp_path / "out", "--json"),
        )
        truth = bench.truth
    assert done.code == 0, done.err
    events = [json.loads(line) for line in done.out.splitlines()]
    aims = [each["subject"].partition(": ")[2] for each in events if each["event"] == "pose wanted"]
    assert {f"inner at {sign}{rate:g} deg/s" for rate in RATES for sign in ("", "-")} <= set(aims)
    assert [each["text"] for each in events if each["event"] == "warning"] == []
    again = typed("turntable", tmp_path / "out" / "session", "-o", tmp_path / "again")
    assert again.code == 0, again.err
    for name in ("target_1", "target_2"):
        live, logged = (
            yaml.safe_load((tmp_path / folder / f"{name}.yaml").read_text())["gyroscope"]
            for folder in ("out", "again")
        )
        assert live == logged
        true = np.linalg.norm(truth["units"][name]["gyroscope"]["M"], axis=1)
        off = (np.diag(live["K"]) - true) / live["sigma"]["scale"]
        assert np.abs(off).max() < MOST_SIGMAS, off
        [found] = live["constant_rates"]
        assert found["axis"] == "z", "the axis without limits turns about it"
        levels = found["levels"]
        held = sorted(sign * rate for rate in RATES for sign in (1.0, -1.0))
        assert [each["rate"] for each in levels] == pytest.approx(held, rel=2e-3)
        for each in (*levels, found):
            assert abs(each["scale"] - true[2]) < MOST_SIGMAS * each["scale_sigma"], each


def test_a_live_session_takes_the_commanded_rates_as_truth(tmp_path, monkeypatch):
    """Scale about the axis that turns is the table's, with its accuracy within sigma."""
    with waiting_bench(monkeypatch, seed=97) as bench:
        done = typed(
            *("turntable", "--live", *words_of(bench), "--table", bench.table_address, "--armed"),
            *("--poses", listed(tmp_path / "poses.yaml", [30.0]), "--pose-seconds", "3s"),
            *("--truth", "table", "--rate-accuracy", "40", "-o", tmp_path / "out", "--json"),
        )
        truth = bench.truth
    assert done.code == 0, done.out[-2000:] + done.err
    for name in ("target_1", "target_2"):
        file = yaml.safe_load((tmp_path / "out" / f"{name}.yaml").read_text())
        assert file["method"]["truth"] == "table"
        gyroscope = file["gyroscope"]
        true = np.array(truth["units"][name]["gyroscope"]["M"])[:, 2]
        found = np.array(gyroscope["M"])[:, 2]
        inherited = np.array(gyroscope["inherited"]["covariance"], dtype=float)
        assert "table" in gyroscope["inherited"]["source"]
        assert np.sqrt(inherited[8, 8]) == pytest.approx(40e-6 * found[2], rel=1e-3)
        variance = np.array(gyroscope["covariance"], dtype=float)[8, 8] + inherited[8, 8]
        assert abs(found[2] - true[2]) < MOST_SIGMAS * np.sqrt(variance)
