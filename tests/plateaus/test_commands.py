"""`tumble plateaus` as it is typed, from a simulated chamber to one file."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

from tumble.calibration.document import Calibration
from turntable_sessions import calibrated, one_line, typed

TEMPERATURES = "-20,10,40,70,10"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A unit in a chamber, calibrated on the table at each temperature."""
    folder = tmp_path_factory.mktemp("chamber")
    done = typed(
        *("simulate", "plateaus", f"--temperatures={TEMPERATURES}", "--no-bias-instability"),
        *("--rate", 50, "--seed", 7, "-o", folder),
    )
    assert done.code == 0, done.err
    for session in sorted(folder.glob("session_*")):
        calibrated(session / "reference.csv", session / "target_1.csv", "-o", session / "found")
    return folder


def put_together(folder, *options):
    sessions = sorted(folder.glob("session_*"))
    return typed("plateaus", *(each / "found" / "target_1.yaml" for each in sessions), *options)


def test_sessions_in_a_chamber_become_one_calibration(folder, tmp_path):
    done = put_together(folder, "--json", "-o", tmp_path)
    assert done.code == 0, done.out + done.err
    content = json.loads(done.out)
    assert content["verdict"] == "measured"
    assert content["range"] == pytest.approx([-20.0, 70.0], abs=0.1)
    assert not any(each["probability"] < 1e-4 for triad in content["triads"] for each in triad["constancies"])
    truth = yaml.safe_load((folder / "truth.yaml").read_text())
    calibration = Calibration.load(content["files"]["calibration"])
    for triad, far in (("accelerometer", 3e-3), ("gyroscope", 5e-5)):
        section = getattr(calibration, triad)
        for temperature, at in zip(truth["temperatures"], truth[triad], strict=True):
            resting = section.at_reference(np.array([at["b"]]), np.array([temperature]))
            assert np.abs(resting[0] - section.b).max() < far
            scale = np.linalg.norm(at["M"], axis=1) / np.linalg.norm(section.M, axis=1)
            t = temperature - section.temperature_drift.reference
            predicted = 1.0 + sum(
                row * t**k for k, row in enumerate(section.temperature_drift.scale, start=1)
            )
            assert np.abs(predicted / scale - 1.0).max() < 3e-4
    page = (tmp_path / "target_1.plateaus.html").read_text()
    for words in ("Held constant", "Each plateau predicted from the others", "reached by warming"):
        assert words in page


def test_stated_temperatures_replace_those_of_the_files(folder, tmp_path):
    options = [word for degrees in (0, 20, 40, 60, 20) for word in ("--temperature", degrees)]
    done = put_together(folder, *options, "--reference-temperature", 20, "-o", tmp_path)
    assert done.code == 0, done.out + done.err
    assert "from 5 sessions, 0.0 to 60.0 °C" in done.text
    assert "M and b hold at 20.0 °C" in done.text


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--temperature", 20), "--temperature is given 1 times for 5 calibrations"),
        (("--reference-temperature", 90), "--reference-temperature 90: is beyond the plateaus"),
    ],
)
def test_wrong_options_end_with_one_line(folder, tmp_path, options, message):
    done = put_together(folder, *options, "-o", tmp_path)
    assert done.code == 2
    assert one_line(done.err).startswith(message)
