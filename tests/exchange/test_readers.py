"""Exported files, parsed by what the projects themselves parse them with in Python.

Kalibr reads YAML by PyYAML, OpenVINS, VINS-Fusion and ORB-SLAM3 by OpenCV, ArduPilot's tools parameters by
pymavlink. QGroundControl, which reads those of PX4, has no reader in Python; pyulog of PX4 writes its format.
"""

import re
import sys
from itertools import pairwise

import cv2
import numpy as np
import pytest
import yaml

from exchange_units import calibration, needed
from tumble.tools.exchange.calibration_parts import sensing_axes
from tumble.tools.exchange.procedure import export
from ulog_fixtures import ULogWriter


@pytest.fixture
def unit():
    return calibration(1)


def written(folder, unit, word, **settings):
    path = folder / word
    path.write_bytes(export(unit, word, needed(word) | settings).content)
    return path


def test_pymavlink_reads_the_parameters_of_ardupilot(tmp_path, unit, capsys):
    from pymavlink.mavparm import MAVParmDict

    found = MAVParmDict()
    assert found.load(str(written(tmp_path, unit, "ardupilot")))
    assert "Invalid line" not in capsys.readouterr().out
    offsets = [found[f"INS_ACCOFFS_{axis}"] for axis in "XYZ"]
    scales = [found[f"INS_ACCSCAL_{axis}"] for axis in "XYZ"]
    assert offsets == pytest.approx(unit.accelerometer.b, rel=1e-6)
    assert scales == pytest.approx(1.0 / sensing_axes(unit.accelerometer.M).scale, rel=1e-6)


def test_lines_of_px4_are_those_that_pyulog_writes_for_qgroundcontrol(tmp_path, unit, monkeypatch):
    from pyulog.params import main

    ours = [line for line in written(tmp_path, unit, "px4").read_text().splitlines() if line[0] != "#"]
    fields = [line.split("\t") for line in ours]
    values = {name: int(text) if kind == "6" else float(text) for _, _, name, text, kind in fields}
    log = ULogWriter(values).write(tmp_path / "log.ulg")
    theirs = tmp_path / "theirs.params"
    monkeypatch.setattr(sys, "argv", ["ulog_params", "-i", "--format", "qgc", str(log), str(theirs)])
    main()
    lines = [line.split("\t") for line in theirs.read_text().splitlines() if line and line[0] != "#"]
    assert {name: (system, component, kind) for system, component, name, _, kind in lines} == {
        name: (system, component, kind) for system, component, name, _, kind in fields
    }
    stored = {name: np.float32(text) for _, _, name, text, _ in lines}
    assert stored == {name: np.float32(text) for _, _, name, text, _ in fields}


def test_the_yaml_of_kalibr_holds_numbers_alone_even_small_ones(tmp_path, unit):
    small = unit.gyroscope.model_copy(update={"g_sensitivity": np.diag([1e-5, -2e-5, 3e-5])})
    for word in ("kalibr", "kalibr-noise"):
        imu = yaml.safe_load(
            written(tmp_path, unit.model_copy(update={"gyroscope": small}), word).read_text()
        )
        imu = imu.get("imu0", imu)
        # ConfigReader.py refuses noise that is not above zero, and topics that are no text.
        for name in ("accelerometer_noise_density", "gyroscope_random_walk", "update_rate"):
            assert imu[name] > 0.0
        assert isinstance(imu["rostopic"], str)
        if word == "kalibr":
            matrices = [
                imu["accelerometers"]["M"],
                *(imu["gyroscopes"][key] for key in ("M", "A", "C_gyro_i")),
            ]
            assert {type(number) for matrix in matrices for row in matrix for number in row} == {float}


def test_opencv_reads_the_chain_of_openvins(tmp_path, unit):
    file = cv2.FileStorage(str(written(tmp_path, unit, "openvins")), cv2.FILE_STORAGE_READ)
    imu = file.getNode("imu0")
    chain = yaml.safe_load(written(tmp_path, unit, "openvins").read_text().partition("\n")[2])["imu0"]
    assert imu.getNode("model").string() == "kalibr"
    assert imu.getNode("gyroscope_noise_density").real() == pytest.approx(2e-3)
    for key in ("T_i_b", "Tw", "R_IMUtoGYRO", "Ta", "R_IMUtoACC", "Tg"):
        node = imu.getNode(key)
        size = 4 if key == "T_i_b" else 3
        found = [[node.at(row).at(column).real() for column in range(size)] for row in range(size)]
        assert found == chain[key]


@pytest.mark.parametrize(("word", "key"), [("vins", "acc_n"), ("orb-slam3", "IMU.NoiseAcc")])
def test_opencv_reads_keys_of_noise(tmp_path, unit, word, key):
    path = written(tmp_path, unit, word)
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    stated = re.search(rf"^{re.escape(key)}: (.*)$", path.read_text(), re.MULTILINE)
    assert file.getNode(key).real() == float(stated.group(1))


def test_every_list_is_indented_below_its_key_as_opencv_demands(tmp_path, unit):
    lines = written(tmp_path, unit, "openvins").read_text().splitlines()
    for before, line in pairwise(lines):
        if line.lstrip().startswith("- ") and before.endswith(":"):
            assert len(line) - len(line.lstrip()) > len(before) - len(before.lstrip())
