"""Magnetometers of other programs: what these do, computed again here, corrects as Tumble does."""

from __future__ import annotations

import re

import numpy as np
import pytest

from exchange_units import magnetometer, with_current
from target_formulas import axes, by_mavparm, of_node, parameters
from tumble.calibration.document import Calibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.firmware.rotations import from_euler
from tumble.foundation.firmware.rotations import rotation as numbered
from tumble.tools.exchange.procedure import export, import_calibrations

SET = {"px4": {"magnetometer-id": "396809"}, "ardupilot": {}, "ros2": {}}
ENDINGS = {"px4": ".params", "ardupilot": ".param", "ros2": ".yaml"}
SINGLE = 3e-6
"""Single precision of readings of up to 200 uT, over that."""


def readings(seed):
    generator = np.random.default_rng(100 + seed)
    return 50.0 * generator.normal(size=(20, 3)), generator.uniform(0.0, 1.0, 20)


def written(folder, word, calibration):
    path = folder / f"unit{ENDINGS[word]}"
    exported = export(calibration, word, SET[word])
    path.write_bytes(exported.content)
    return path, exported


def px4_corrects(path, field, load):
    """Magnetometer.hpp, Correct: gauss, and kA where CAL_MAG_COMP_TYP is 2."""
    found = parameters(path)
    diagonal, others = (axes(found, f"CAL_MAG0_{{}}{name}") for name in ("SCALE", "ODIAG"))
    x, y, z = others
    scale = np.array([[diagonal[0], x, y], [x, diagonal[1], z], [y, z, diagonal[2]]])
    compensation = found.get("CAL_MAG_COMP_TYP", 0)
    power = {0: np.zeros_like(load), 1: load, 2: load / 1000.0}[compensation]
    effect = axes(found, "CAL_MAG0_{}COMP") if compensation else np.zeros(3)
    shifted = field / 100.0 + power[:, np.newaxis] * effect - axes(found, "CAL_MAG0_{}OFF")
    return 100.0 * shifted @ scale.T @ numbered(int(found.get("CAL_MAG0_ROT", 0))).T


def ardupilot_corrects(path, field, load):
    """AP_Compass_Backend.cpp, rotate_field and correct_field: milligauss, A."""
    found = by_mavparm(path)
    x, y, z = axes(found, "COMPASS_ODI_{}")
    diagonal = axes(found, "COMPASS_DIA_{}")
    matrix = np.array([[diagonal[0], x, y], [x, diagonal[1], z], [y, z, diagonal[2]]])
    orientation = int(found.get("COMPASS_ORIENT", 0))
    if orientation == 101:
        assert found["CUST_ROT_ENABLE"] == 1
        turn = from_euler(*(found[f"CUST_ROT1_{name}"] for name in ("ROLL", "PITCH", "YAW")))
    else:
        turn = numbered(orientation)
    turned = 10.0 * field @ turn.T
    scaled = (turned + axes(found, "COMPASS_OFS_{}")) * found["COMPASS_SCALE"]
    motor = axes(found, "COMPASS_MOT_{}") if found.get("COMPASS_MOTCT") else np.zeros(3)
    return (scaled @ matrix.T + load[:, np.newaxis] * motor) / 10.0


def node_corrects(path, field, load):
    """The formula in the head of the file: tesla, A."""
    found = {name: np.array(value) for name, value in of_node(path).items()}
    effect = found.get("magnetometer_current", found.get("magnetometer_throttle"))
    freed = 1e-6 * field - found["magnetometer_bias"] - load[:, np.newaxis] * effect
    return 1e6 * freed @ found["magnetometer_correction"].reshape(3, 3).T


FIRMWARE = {"px4": px4_corrects, "ardupilot": ardupilot_corrects}
PROGRAMS = FIRMWARE | {"ros2": node_corrects}


@pytest.mark.parametrize("word", PROGRAMS)
@pytest.mark.parametrize("number", [0, 6, 8, 29])
@pytest.mark.parametrize("current_unit", ["A", "1"])
def test_a_program_corrects_a_turned_magnetometer_as_tumble_does(tmp_path, word, number, current_unit):
    calibration = with_current(number, current_unit, number)
    path, exported = written(tmp_path, word, calibration)
    assert exported.losses == ()
    field, load = readings(number)
    expected = calibration.correct_magnetic(field, load)
    assert np.abs(PROGRAMS[word](path, field, load) - expected).max() < SINGLE * 200.0


@pytest.mark.parametrize("word", FIRMWARE)
@pytest.mark.parametrize("seed", range(3))
def test_error_of_a_tilt_is_no_more_than_its_loss(tmp_path, word, seed):
    calibration = magnetometer(seed, 8, tilt=0.1)
    path, exported = written(tmp_path, word, calibration)
    (loss,) = exported.losses
    assert str(loss).startswith("compass: magnetometer: mounting in the case is lost: 5 uT in 50 uT")
    generator = np.random.default_rng(seed)
    truth = generator.normal(size=(200, 3))
    truth *= 50.0 / np.linalg.norm(truth, axis=1)[:, np.newaxis]
    field = truth @ calibration.magnetometer.M.T + calibration.magnetometer.b
    left = np.linalg.norm(FIRMWARE[word](path, field, np.zeros(200)) - truth, axis=1).max()
    assert 0.9 * loss.size < left < 1.001 * loss.size


@pytest.mark.parametrize("seed", range(3))
def test_custom_rotation_of_a_compass_holds_all_of_its_mounting(tmp_path, seed):
    calibration = magnetometer(seed, 8, tilt=0.4, current=np.array([0.4, -1.1, 0.2]))
    exported = export(calibration, "ardupilot", {"compass-rotation": "custom"})
    assert exported.losses == ()
    path = tmp_path / "unit.param"
    path.write_bytes(exported.content)
    field, load = readings(seed)
    expected = calibration.correct_magnetic(field, load)
    assert np.abs(ardupilot_corrects(path, field, load) - expected).max() < SINGLE * 200.0


@pytest.mark.parametrize("word", PROGRAMS)
@pytest.mark.parametrize("current_unit", ["A", "1"])
def test_imported_magnetometer_corrects_as_the_exported_one(tmp_path, word, current_unit):
    calibration = with_current(5, current_unit)
    path, _ = written(tmp_path, word, calibration)
    (found,) = import_calibrations(path)
    assert found.magnetometer.estimated == ("bias", "matrix")
    assert found.magnetometer.current_unit == current_unit
    field, load = readings(5)
    before, after = (each.correct_magnetic(field, load) for each in (calibration, found))
    assert np.abs(after - before).max() < SINGLE * 200.0


def test_values_that_px4_ignores_are_losses():
    section = {"M": np.diag([1.004, 1.0, 1.0]), "b": np.array([0.4, 0.0, 0.0])}
    small = Calibration.model_validate({"name": "small", "magnetometer": section})
    assert [str(loss).partition(" is lost")[0] for loss in export(small, "px4", SET["px4"]).losses] == [
        "small: magnetometer: bias, as PX4 ignores up to 1 uT,",
        "small: magnetometer: scale, as PX4 ignores up to 0.01,",
    ]


def test_left_handed_magnetometer_is_refused():
    mirrored = Calibration.model_validate(
        {"name": "mirror", "magnetometer": {"M": np.diag([1.0, 1.0, -1.0]), "b": np.zeros(3)}}
    )
    with pytest.raises(ProcedureError, match="mirror: the axes of the magnetometer are left-handed"):
        export(mirrored, "px4", SET["px4"])


def test_magnetometer_alone_is_refused_where_there_is_no_place():
    with pytest.raises(ProcedureError, match="compass: has a magnetometer section only, and imucal has no"):
        export(magnetometer(1), "imucal")


def test_formats_without_a_place_for_a_magnetometer_report_it(tmp_path):
    section = {"M": np.eye(3), "b": np.zeros(3)}
    both = Calibration.model_validate(
        {"name": "both", "accelerometer": section, "gyroscope": section, "magnetometer": section}
    )
    exported = export(both, "imucal")
    assert "the magnetometer of both is left out: imucal has no place for one" in exported.remarks
    assert exported.losses == ()


def test_betaflight_takes_hard_iron_in_counts_of_the_chip(tmp_path):
    unit = magnetometer(3)
    # An HMC5883L has 1090 counts in a gauss, of which one is 100 uT.
    exported = export(unit, "betaflight", {"counts-per-gauss": "1090", "axes": "FLU"})
    line = re.search(r"^set mag_calibration = (.*)$", exported.content.decode(), re.MULTILINE).group(1)
    counts = np.array(line.split(","), dtype=int)
    assert counts * 100.0 / 1090.0 == pytest.approx(unit.magnetometer.b, abs=0.5 * 100.0 / 1090.0)
    lost = {each.part for each in exported.losses if each.triad == "magnetometer"}
    assert {"scale", "mounting", "rounding to counts"} <= lost
    with pytest.raises(ProcedureError, match="or with --set counts-per-gauss the magnetometer's"):
        export(unit, "betaflight")
