"""`tumble simulate spin`, then `tumble spin`, as typed: the truth is found, and mishaps are reported."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

from turntable_sessions import one_line, typed

SIGMAS = 5.0


def simulated(folder, *options):
    """The log and its truth."""
    done = typed("simulate", "spin", "-o", folder / "session", *options)
    assert done.code == 0, done.err
    truth = yaml.safe_load((folder / "session/truth.yaml").read_text(encoding="utf-8"))
    return folder / "session/spin.csv", truth


def spun(log, folder, *options):
    done = typed("spin", log, "-o", folder / "out", "--json", *options)
    assert done.code == 0, done.err
    return json.loads(done.out)


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["--floor-tilt", 3],
        ["--floor-tilt", 0],
        ["--unevenness", 0.5],
        ["--slips", 3],
        ["--vibration", 2],
        ["--mounting", "170,40,0"],
        ["--grade", "tactical"],
    ],
    ids=lambda options: " ".join(map(str, options)) or "as it comes",
)
def test_the_biases_of_a_simulated_robot_are_found(tmp_path, options):
    log, truth = simulated(tmp_path, "--seed", 7, *options)
    found = spun(log, tmp_path)
    for bias in ("accelerometer_bias", "gyroscope_bias"):
        miss = (np.array(found[bias]["value"]) - truth[bias]) / found[bias]["sigma"]
        assert np.all(np.abs(miss) < SIGMAS), f"{bias}: {miss.round(1)} sigmas"
    shown = {parameter["name"]: parameter for parameter in found["spins"][0]["parameters"]}
    for name, key in (
        ("mounting roll", "roll_deg"),
        ("mounting pitch", "pitch_deg"),
        ("lever arm x", ("lever_arm", 0)),
        ("lever arm y", ("lever_arm", 1)),
    ):
        value = truth[key] if isinstance(key, str) else truth[key[0]][key[1]]
        assert abs(shown[name]["value"] - value) < SIGMAS * shown[name]["sigma"], name


def test_a_plan_with_drives_gives_as_many_spins_as_it_has(tmp_path):
    plan = "rest 6, 2 turns, rest 4, drive 8, rest 5, -2 turns, rest 3, 1 turns, rest 3"
    log, truth = simulated(tmp_path, "--seed", 8, "--plan", plan, "--vibration", 0.3)
    found = spun(log, tmp_path)
    assert len(found["spins"]) == 2
    assert len(found["spins"][1]["rests"]) == 3
    for bias in ("accelerometer_bias", "gyroscope_bias"):
        miss = (np.array(found[bias]["value"]) - truth[bias]) / found[bias]["sigma"]
        assert np.all(np.abs(miss) < SIGMAS), f"{bias}: {miss.round(1)} sigmas"


def test_a_slow_turn_at_the_start_is_noticed_on_a_tilted_floor(tmp_path):
    log, truth = simulated(tmp_path, "--seed", 9, "--slow-turn", 0.01)
    found = spun(log, tmp_path)
    assert any("while it seemed to stand still" in line for line in found["spins"][0]["warnings"])
    miss = (np.array(found["gyroscope_bias"]["value"]) - truth["gyroscope_bias"]) / found["gyroscope_bias"][
        "sigma"
    ]
    assert np.all(np.abs(miss) < SIGMAS), miss


def test_scale_is_found_where_the_true_turns_are_known(tmp_path):
    log, _ = simulated(tmp_path, "--seed", 11, "--gyroscope-scale", 0.02)
    found = spun(log, tmp_path, "--true-turns", "+3,-3", "--true-turns-sigma", 0.5)
    shown = {parameter["name"]: parameter for parameter in found["spins"][0]["parameters"]}
    for direction in ("clockwise", "counter-clockwise"):
        scale = shown[f"gyroscope scale {direction}"]
        assert abs(scale["value"] - 1.02) < SIGMAS * scale["sigma"]
        assert scale["sigma"] < 0.005


@pytest.mark.parametrize(
    ("kind", "part"),
    [("picked-up", "lifted"), ("sill", "about more than one axis")],
    ids=["picked up", "sill"],
)
def test_event_of_the_robot_is_reported(tmp_path, kind, part):
    log, _ = simulated(tmp_path, "--seed", 12, "--disturb", f"{kind}@15", "--turns", 4, "--no-both-ways")
    done = typed("spin", log, "-o", tmp_path / "out")
    assert done.code == 2
    assert part in one_line(done.err)


def test_a_floor_beyond_the_limit_is_refused(tmp_path):
    log, _ = simulated(tmp_path, "--seed", 10, "--floor-tilt", 12)
    done = typed("spin", log, "-o", tmp_path / "out")
    assert done.code == 2
    assert "floor tilts by 12.0 deg" in one_line(done.err)


@pytest.mark.parametrize(
    ("tilt", "scale", "named"), [(1, 0.11, True), (1, -0.06, True), (1, 0.01, False), (0, 0.11, False)]
)
def test_a_scale_error_that_no_sound_gyroscope_has_is_named(tmp_path, tilt, scale, named):
    """A gyroscope that read 11 % too much was stated with its scale, without a word."""
    log, _ = simulated(tmp_path, "--seed", 12, "--gyroscope-scale", scale, "--floor-tilt", tilt)
    (spin,) = spun(log, tmp_path)["spins"]
    shown = {parameter["name"]: parameter for parameter in spin["parameters"]}
    assert shown["gyroscope scale about the axis"]["observable"] == bool(tilt)
    assert any("the gyroscope's scale is off by" in line for line in spin["warnings"]) == named
