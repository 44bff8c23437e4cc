"""`tumble simulate static` and `tumble noise` as typed: table, JSON, files, exit codes, help."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

import tumble
from turntable_sessions import contents, typed

GYROSCOPE = {"n": 1e-3, "b": 3e-4, "k": 6e-5}
ACCELEROMETER = {"n": 1e-2, "b": 3e-3, "k": 6e-4}
TERMS = {"n": "white noise", "b": "bias instability", "k": "random walk"}
HOURS = "3h"


def option(terms):
    return ",".join(f"{letter}={value}" for letter, value in terms.items())


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    folder = tmp_path_factory.mktemp("static")
    done = typed(
        *("simulate", "static", "--duration", HOURS, "--rate", 10, "--seed", 5, "-o", folder),
        *("--gyroscope", option(GYROSCOPE), "--accelerometer", option(ACCELEROMETER)),
    )
    assert done.code == 0, done.err
    return folder / "static.csv"


@pytest.fixture(scope="module")
def done(log):
    return typed("noise", log, "--json", "-o", log.parent / "out")


@pytest.fixture(scope="module")
def content(done):
    assert done.code == 0, done.out + done.err
    return json.loads(done.out)


def test_the_truth_lies_within_nearly_all_intervals(content, log):
    truth = yaml.safe_load((log.parent / "truth.yaml").read_text())
    inside = []
    for channel in content["channels"]:
        for term in channel["terms"]:
            true = truth[channel["triad"]][term["name"]]
            inside.append(term["low"] <= true <= term["high"])
    assert len(inside) == 30
    # More than five of 30 intervals of 95 % miss in one session of 300.
    assert sum(inside) >= 25


def test_requested_terms_are_found_for_every_channel(content):
    assert content["verdict"] == "measured"
    for channel in content["channels"]:
        found = {term["name"]: term for term in channel["terms"]}
        assert all(found[word]["observable"] for word in TERMS.values())
        assert found["ramp"]["value"] is None


def test_kalibr_reads_densities_and_vins_what_one_sample_scatters_by(content, log):
    keys = yaml.safe_load((log.parent / "out" / "static.noise.kalibr.yaml").read_text())
    assert keys["gyroscope_noise_density"] == pytest.approx(GYROSCOPE["n"], rel=0.02)
    assert keys["gyroscope_random_walk"] == pytest.approx(GYROSCOPE["k"], rel=0.5)
    assert keys["accelerometer_noise_density"] == pytest.approx(ACCELEROMETER["n"], rel=0.02)
    assert keys["accelerometer_random_walk"] == pytest.approx(ACCELEROMETER["k"], rel=0.5)
    assert keys["update_rate"] == pytest.approx(10.0)
    assert content["kalibr"]["gyroscope_noise_density"] == pytest.approx(keys["gyroscope_noise_density"])
    assert content["vins"]["gyr_n"] == pytest.approx(np.sqrt(10.0) * keys["gyroscope_noise_density"])
    assert content["vins"]["acc_w"] == pytest.approx(np.sqrt(10.0) * keys["accelerometer_random_walk"])


def test_a_calibration_it_is_started_from_keeps_all_but_its_noise(log, tmp_path):
    before = tumble.Calibration.model_validate(
        {
            "name": "drive",
            "method": {"procedure": "turntable"},
            "accelerometer": {
                "M": np.diag([1.01, 0.99, 1.0]),
                "b": np.array([0.1, 0.2, 0.3]),
                "estimated": ["bias"],
            },
        }
    )
    before.save(tmp_path / "drive.yaml")
    typed("noise", log, "--calibration", tmp_path / "drive.yaml", "-o", tmp_path)
    after = tumble.Calibration.load(tmp_path / "static.noise.yaml")
    assert after.accelerometer.b.tolist() == [0.1, 0.2, 0.3]
    assert after.accelerometer.M.tolist() == before.accelerometer.M.tolist()
    assert after.method == before.method
    assert after.accelerometer.noise_density == pytest.approx([ACCELEROMETER["n"]] * 3, rel=0.03)
    assert after.gyroscope.M.tolist() == np.eye(3).tolist()
    assert np.isfinite(after.gyroscope.random_walk).all()


def test_short_log_reports_missing_terms_and_the_length_needed(log, tmp_path):
    head = log.read_text().splitlines()[: 2 + 600]
    (tmp_path / "short.csv").write_text("\n".join(head) + "\n")
    done = typed("noise", tmp_path / "short.csv", "-o", tmp_path / "out")
    assert done.code == 3
    line = next(
        line for line in done.out.splitlines() if line.startswith("Not identifiable: random walk of gyro")
    )
    assert "at most" in line
    assert "a log of" in line
    assert (tmp_path / "out" / "short.noise.html").is_file()


def test_moving_log_is_refused_in_one_line_and_writes_nothing(tmp_path):
    typed("simulate", "spin", "--still", 1, "--turns", 3, "-o", tmp_path)
    rows = (tmp_path / "spin.csv").read_text().splitlines()
    names = next(number for number, row in enumerate(rows) if row.startswith("time"))
    (tmp_path / "moving.csv").write_text("\n".join([*rows[: names + 1], *rows[400:900]]) + "\n")
    done = typed("noise", tmp_path / "moving.csv", "-o", tmp_path / "out")
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert "moving: never stands still for a second" in done.err
    assert contents(tmp_path / "out") == {}


def test_logs_of_different_rates_are_not_joined(log, tmp_path):
    typed("simulate", "static", "--duration", "60s", "--rate", 50, "-o", tmp_path)
    done = typed("noise", log, tmp_path / "static.csv", "--serial", "SN 1", "-o", tmp_path / "out")
    assert done.code == 2
    assert "join logs of one rate only" in done.err


@pytest.mark.parametrize("given", ["n", "x=1", "n=one", "n=-1"])
def test_terms_that_are_none_are_refused_in_one_line(given, tmp_path):
    done = typed("simulate", "static", "--gyroscope", given, "-o", tmp_path / "out")
    assert done.code == 2
    assert done.err.count("\n") == 1


def test_notebook_shows_every_channel_and_a_frame_holds_every_term(log):
    result = tumble.noise(log)
    table = result._repr_html_()
    for channel in result.channels:
        assert f"<td>{channel.name}</td>" in table
    assert "white noise" in table
    assert "at rest" in table
    assert len(result.to_pandas()) == 30
