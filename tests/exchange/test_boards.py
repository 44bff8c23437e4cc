"""Boards of hobbyists: from the text of a sketch to the registers of the chip."""

import numpy as np
import pytest
import yaml

from arduino_chip import CHIPS
from log_fixtures import read, real
from tumble.calibration.document import Calibration
from tumble.logs import ReadOptions
from tumble.tools.exchange.procedure import export
from turntable_sessions import typed

G = 9.80665


def test_registers_take_the_bias_out_of_a_sketchs_text(tmp_path):
    folder = real("cases/arduino_texts")
    truth = yaml.safe_load((folder / "truth.yaml").read_text())
    sections = {
        triad: {"unit": unit, "M": np.array(truth[triad]["matrix"]), "b": np.array(truth[triad]["bias"])}
        for triad, unit in (("accelerometer", "m/s^2"), ("gyroscope", "rad/s"))
    }
    unit = Calibration.model_validate({"name": "board", **sections})
    path = tmp_path / "offsets.h"
    path.write_bytes(export(unit, "registers-mpu6050").content)
    log = read(folder / "adafruit.txt", ReadOptions(rate=20.0))
    force, rate = CHIPS["registers-mpu6050"](path, log.accelerometer, log.gyroscope)
    still = log.time - log.time[0] < 3.0
    forces = force[still] @ np.linalg.inv(unit.accelerometer.M).T
    assert abs(np.linalg.norm(forces.mean(axis=0)) - G) < 0.02
    assert np.abs(rate[still].mean(axis=0)).max() < 0.006


@pytest.mark.parametrize("word", CHIPS)
def test_a_bias_beyond_the_registers_is_one_line(tmp_path, word):
    sections = {
        "accelerometer": {"unit": "m/s^2", "M": np.eye(3), "b": np.array([0.0, 400.0, 0.0])},
        "gyroscope": {"unit": "rad/s", "M": np.eye(3), "b": np.zeros(3)},
    }
    path = tmp_path / "board.yaml"
    Calibration.model_validate({"name": "board", **sections}).save(path)
    done = typed("export", path, "--format", word, "-o", tmp_path / "offsets.h")
    assert done.code == 2
    assert "takes" in done.err
    assert done.err.count("\n") == 1
    assert not (tmp_path / "offsets.h").exists()
