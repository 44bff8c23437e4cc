"""`tumble turntable` on simulated sessions, from logs to files: what a calibration engineer does and gets."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import types
from pathlib import Path

import numpy as np
import pytest
import yaml

import tumble
from tumble.cli import main as command_line
from tumble.tools.simulate import simulate_turntable, write_turntable

COMMAND = Path(sys.executable).with_name("tumble")
SIGMAS = 5.0
"""A miss this large comes by chance once in 1.7 million normal draws; there are some hundred here."""


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A reference, an industrial and a tactical target: folder of the logs."""
    folder = tmp_path_factory.mktemp("session")
    simulated = simulate_turntable(
        seed=11, grades=("industrial", "tactical"), rate_hz=100.0, rest_seconds=6.0, bias_instability=False
    )
    print("seed 11")
    write_turntable(simulated, folder)
    return folder


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs the command in this process."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["tumble", *map(str, arguments)])
        with pytest.raises(SystemExit) as caught:
            command_line.main()
        captured = capsys.readouterr()
        return types.SimpleNamespace(code=caught.value.code or 0, out=captured.out, err=captured.err)

    return run


def logs(session):
    return [session / f"{name}.csv" for name in ("reference", "target_1", "target_2")]


def rows(folder):
    with (folder / "summary.csv").open(newline="", encoding="utf-8") as file:
        return {row["target"]: row for row in csv.DictReader(file)}


def truth(session):
    return yaml.safe_load((session / "truth.yaml").read_text(encoding="utf-8"))["units"]


def test_the_installed_command_calibrates_to_the_truth(session, tmp_path):
    options = ["--poses", session / "poses.yaml", "--g-sensitivity", "-o", tmp_path / "out"]
    done = subprocess.run(
        [COMMAND, "turntable", *logs(session), *options], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == "", "a progress bar was drawn where there is no terminal"
    for name, row in rows(tmp_path / "out").items():
        for triad, unit in (("accelerometer", "m/s^2"), ("gyroscope", "rad/s")):
            true = truth(session)[name][triad]
            for axis, value in zip("xyz", true["b"], strict=True):
                column = f"{triad} bias {axis} ({unit})"
                miss = (float(row[column]) - value) / float(row[f"sigma {column}"])
                assert abs(miss) < SIGMAS, f"{name} {column}: {miss:.1f} sigma from the truth"
            for k, axis in enumerate("xyz"):
                column = f"{triad} scale {axis}"
                miss = (float(row[column]) - true["K"][k][k]) / float(row[f"sigma {column}"])
                assert abs(miss) < SIGMAS, f"{name} {column}: {miss:.1f} sigma from the truth"


def test_a_calibration_file_says_what_the_summary_says(session, tmp_path, run):
    assert run("turntable", *logs(session), "-o", tmp_path / "out").code == 0
    for name, row in rows(tmp_path / "out").items():
        calibration = tumble.Calibration.load(tmp_path / f"out/{name}.yaml")
        biases = [float(row[f"accelerometer bias {axis} (m/s^2)"]) for axis in "xyz"]
        np.testing.assert_array_equal(calibration.accelerometer.b, biases)
        assert calibration.serial == row["serial"]


def test_calibration_by_the_command_corrects_its_own_recording(session, tmp_path, run):
    out = tmp_path / "out"
    assert run("turntable", *logs(session), "--g-sensitivity", "-o", out).code == 0
    corrected = tmp_path / "corrected.csv"
    assert run("apply", out / "target_1.yaml", session / "target_1.csv", "-o", corrected).code == 0
    again = run("turntable", session / "reference.csv", corrected, "-o", tmp_path / "again", "--json")
    found = json.loads(again.out)["targets"][0]["calibration"]["accelerometer"]
    left = np.append((np.array(found["M"]) - np.eye(3)).ravel(), found["b"])
    sigma = np.sqrt(np.diag(np.array(found["covariance"])))
    # Weights are taken from the scatter anew, so the second answer differs, but by much less than its sigma.
    assert np.all(np.abs(left) < 0.05 * sigma), left / sigma


def test_poses_need_not_be_known(session, tmp_path, run):
    done = run("turntable", *logs(session), "--poses", "none", "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert "mounting angle was not estimated" in " ".join(done.out.split())
    assert set(rows(tmp_path / "out")) == {"target_1", "target_2"}


def test_the_truth_that_needs_poses_says_so_where_none_are_known(session, tmp_path, run):
    done = run(
        "turntable", *logs(session), "--poses", "none", "--truth", "rotate-truth", "-o", tmp_path / "out"
    )
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert "poses" in done.err


@pytest.mark.parametrize("truth_name", ["reference", "rotate-truth", "rotate-measurement", "ideal"])
def test_the_calibration_file_names_the_truth_used(session, tmp_path, run, truth_name):
    assert run("turntable", *logs(session), "--truth", truth_name, "-o", tmp_path / "out").code == 0
    assert tumble.Calibration.load(tmp_path / "out/target_1.yaml").method.truth == truth_name


def test_published_option_is_the_published_truth_and_no_other(session, tmp_path, run):
    assert run("turntable", *logs(session), "--as-published", "-o", tmp_path / "out").code == 0
    assert tumble.Calibration.load(tmp_path / "out/target_1.yaml").method.truth == "rotate-measurement"
    done = run("turntable", *logs(session), "--as-published", "--truth", "ideal", "-o", tmp_path / "out")
    assert done.code == 2
    assert "--as-published is --truth rotate-measurement, not ideal" in done.err


def test_gravity_follows_from_latitude_and_height(session, tmp_path, run):
    done = run("turntable", *logs(session), "--latitude", 48.1, "--height", 520, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    gravity = tumble.Calibration.load(tmp_path / "out/target_1.yaml").gravity
    # WGS 84 normal gravity at 48.1 deg is 9.8090 m/s^2 on the ellipsoid and falls 3.086e-6 a metre.
    assert gravity.value == pytest.approx(9.8090 - 520 * 3.086e-6, abs=2e-4)
    assert "48.1" in gravity.source


def test_limits_decide_between_exit_codes_0_and_3(session, tmp_path, run):
    limits = tmp_path / "limits.yaml"
    limits.write_text("accelerometer: {bias: 2.0}\n")
    out = tmp_path / "out"
    assert run("turntable", *logs(session), "--limits", limits, "-o", out).code == 0
    assert {row["verdict"] for row in rows(out).values()} == {"pass"}
    limits.write_text("accelerometer: {bias: {x: 1.0e-9}}\n")
    assert run("turntable", *logs(session), "--limits", limits, "-o", out).code == 3
    assert {row["verdict"] for row in rows(out).values()} == {"fail"}
    assert all("accelerometer bias x" in row["reason"] for row in rows(out).values())


@pytest.mark.parametrize(
    ("corrupt", "part"),
    [
        (lambda path: path.write_bytes(b""), "is empty"),
        (lambda path: path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100)), "PNG"),
        (lambda path: path.write_bytes(bytes(range(256)) * 40), "corrupted.csv"),
        (lambda path: path.write_text("time,ax,ay,az,gx,gy,gz\n"), "corrupted.csv"),
        (lambda path: path.write_text(path.read_text()[:3000]), "cut short"),
    ],
    ids=["empty", "a picture", "not a log", "column names only", "cut short"],
)
def test_target_with_an_unusable_log_is_one_line(session, tmp_path, run, corrupt, part):
    path = tmp_path / "corrupted.csv"
    path.write_bytes((session / "target_1.csv").read_bytes())
    corrupt(path)
    done = run("turntable", session / "reference.csv", path, "-o", tmp_path / "out")
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert part in done.err
    assert not (tmp_path / "out").exists()


def test_a_bad_target_does_not_stop_the_good_one(session, tmp_path, run):
    empty = tmp_path / "empty.csv"
    empty.write_bytes(b"")
    done = run(
        "turntable", session / "reference.csv", empty, session / "target_1.csv", "-o", tmp_path / "out"
    )
    assert done.code == 3
    verdicts = {name: row["verdict"] for name, row in rows(tmp_path / "out").items()}
    assert sorted(verdicts.values()) == ["calibrated", "not calibrated"]
    assert (tmp_path / "out/target_1.yaml").exists()


def test_a_bad_reference_stops_everything_in_one_line(session, tmp_path, run):
    empty = tmp_path / "empty.csv"
    empty.write_bytes(b"")
    done = run("turntable", empty, session / "target_1.csv", "-o", tmp_path / "out")
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert "empty.csv" in done.err


def test_reference_and_target_in_the_wrong_order_are_noticed(tmp_path, run):
    simulated = simulate_turntable(seed=12, grades=("consumer",), rate_hz=100.0, rest_seconds=6.0)
    print("seed 12")
    write_turntable(simulated, tmp_path)
    done = run("turntable", tmp_path / "target_1.csv", tmp_path / "reference.csv", "-o", tmp_path / "out")
    assert done.code == 2
    assert "swapped" in done.err
    assert done.err.count("\n") == 1
