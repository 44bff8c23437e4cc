"""Imports restore exports, and read files of other programs by the formulas of those programs."""

import re

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from exchange_units import READABLE, calibration, needed
from tumble.calibration.document import Calibration
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.units import TRIADS
from tumble.tools.exchange.calibration_parts import sensing_axes
from tumble.tools.exchange.procedure import export, import_calibrations
from tumble.tools.exchange.registry import TARGETS

FLOAT = 3e-7
"""Single precision of a number of about one, and some."""
DOUBLE = 1e-12
"""Double precision of numbers of about one, and some."""
TURNING = ("kalibr", "openvins", "imu-tk-accelerometer", "imu-tk-gyroscope")
"""Formats in a frame of the sensor's own."""


def back(folder, unit, word):
    path = folder / f"exported{TARGETS[word].ending}"
    path.write_bytes(export(unit, word, needed(word)).content)
    (found,) = import_calibrations(path, word)
    return found


def imported(folder, name, text, word=None):
    """Calibration of the one unit in a file of that name and text."""
    path = folder / name
    path.write_text(text)
    (found,) = import_calibrations(path, word)
    return found


def apart(one, other):
    return np.abs(one - other).max()


def relative(unit):
    """The gyroscope against the accelerometer, which no turn of the frame changes."""
    return unit.gyroscope.M @ unit.accelerometer.M.T


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("exported")


@pytest.mark.parametrize("word", READABLE)
@settings(max_examples=15)
@given(seed=st.integers(0, 2**32))
def test_import_of_an_export_restores_what_the_format_holds(folder, word, seed):
    unit = calibration(seed)
    found = back(folder, unit, word)
    held = TARGETS[word].holds
    for triad, parts in held.items():
        if triad not in TRIADS:
            continue  # tests/exchange/test_magnetometers.py
        ours, theirs = getattr(unit, triad), getattr(found, triad)
        assert apart(theirs.b, ours.b if "bias" in parts else 0.0) < FLOAT
        if "mounting" in parts and word not in TURNING:
            assert apart(theirs.M, ours.M) < FLOAT
        elif "mounting" in parts:
            # No turn of the frame changes these.
            assert apart(theirs.M @ theirs.M.T, ours.M @ ours.M.T) < FLOAT
        elif "scale" in parts:
            assert apart(np.diag(theirs.M), sensing_axes(ours.M).scale) < FLOAT
        if "g-sensitivity" in parts:
            between = ours.g_sensitivity @ unit.accelerometer.M.T
            assert apart(theirs.g_sensitivity @ found.accelerometer.M.T, between) < FLOAT
    if all("mounting" in held.get(triad, ()) for triad in TRIADS):
        assert apart(relative(found), relative(unit)) < FLOAT


@pytest.mark.parametrize("word", ["kalibr", "openvins", "kalibr-noise"])
def test_noise_comes_back_too(tmp_path, word):
    unit = calibration(1)
    found = back(tmp_path, unit, word)
    for triad in TRIADS:
        ours, theirs = getattr(unit, triad), getattr(found, triad)
        assert theirs.noise_density == pytest.approx(ours.noise_density)
        assert theirs.random_walk == pytest.approx(ours.random_walk)


KALIBR = """\
imu0:
  T_i_b:
  - [1.0, 0.0, 0.0, 0.0]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  accelerometer_noise_density: 0.01
  accelerometer_random_walk: 1e-04
  accelerometers:
    M:
    - [1.01, 0.0, 0.0]
    - [0.002, 0.99, 0.0]
    - [-0.003, 0.004, 1.02]
  gyroscope_noise_density: 0.001
  gyroscope_random_walk: 1.0e-05
  gyroscopes:
    A:
    - [1e-04, 0.0, 0.0]
    - [0.0, 2.0e-04, 0.0]
    - [0.0, 0.0, 3.0e-04]
    C_gyro_i:
    - [0.0, 1.0, 0.0]
    - [-1.0, 0.0, 0.0]
    - [0.0, 0.0, 1.0]
    M:
    - [1.1, 0.0, 0.0]
    - [0.01, 0.9, 0.0]
    - [0.0, 0.02, 1.0]
  model: scale-misalignment
  rostopic: /imu0
  time_offset: 0.0
  update_rate: 200.0
"""
"""Results as Kalibr writes them, keys in their order."""


def test_results_of_kalibr_model_what_kalibr_models(tmp_path):
    unit = imported(tmp_path, "imu-static.yaml", KALIBR)
    force, rate = np.random.default_rng(1).normal(size=(2, 20, 3))
    imu = yaml.safe_load(KALIBR)["imu0"]
    turned = np.array(imu["gyroscopes"]["C_gyro_i"])
    M, A = (np.array(imu["gyroscopes"][key], dtype=float) for key in "MA")
    # IccSensors.py: a_m = M a, w_m = M C w + A C a
    read_force = force @ np.array(imu["accelerometers"]["M"]).T
    read_rate = rate @ (M @ turned).T + force @ (A @ turned).T
    true_force, true_rate = unit.correct(read_force, read_rate)
    assert max(apart(true_force, force), apart(true_rate, rate)) < DOUBLE
    assert unit.accelerometer.estimated == ("matrix",)


OPENVINS = """\
%YAML:1.0 # need to specify the file type at the top!

imu0:
  T_i_b:
    - [1.0, 0.0, 0.0, 0.0]
    - [0.0, 1.0, 0.0, 0.0]
    - [0.0, 0.0, 1.0, 0.0]
    - [0.0, 0.0, 0.0, 1.0]
  accelerometer_noise_density: 0.01  # [ m / s^2 / sqrt(Hz) ]
  accelerometer_random_walk: 0.0002
  gyroscope_noise_density: 0.005
  gyroscope_random_walk: 4.0e-06
  rostopic: /imu
  time_offset: 0.0
  update_rate: 1000.0
  # three different modes supported:
  model: "rpng"
  Tw:
    - [1.01, 0.02, 0.0]
    - [0.0, 0.98, 0.01]
    - [0.0, 0.0, 1.0]
  R_IMUtoGYRO:
    - [1.0, 0.0, 0.0]
    - [0.0, 1.0, 0.0]
    - [0.0, 0.0, 1.0]
  Ta:
    - [1.0, 0.003, 0.0]
    - [0.0, 1.002, 0.004]
    - [0.0, 0.0, 0.99]
  R_IMUtoACC:
    - [0.0, -1.0, 0.0]
    - [1.0, 0.0, 0.0]
    - [0.0, 0.0, 1.0]
  Tg:
    - [0.0, 0.001, 0.0]
    - [0.0, 0.0, 0.0]
    - [0.002, 0.0, 0.0]
"""
"""Configuration with the layout of OpenVINS."""


def test_a_chain_of_openvins_corrects_as_openvins_does(tmp_path):
    unit = imported(tmp_path, "kalibr_imu_chain.yaml", OPENVINS)
    imu = yaml.safe_load(OPENVINS.partition("\n")[2])["imu0"]
    Tw, Ta, Tg, to_gyroscope, to_accelerometer = (
        np.array(imu[key]) for key in ("Tw", "Ta", "Tg", "R_IMUtoGYRO", "R_IMUtoACC")
    )
    read_force, read_rate = np.random.default_rng(2).normal(size=(2, 20, 3))
    # a = R_ACCtoIMU Da a_m, w = R_GYROtoIMU Dw (w_m - Tg a), D = T^-1
    force = read_force @ np.linalg.inv(Ta).T @ to_accelerometer
    rate = (read_rate - force @ Tg.T) @ np.linalg.inv(Tw).T @ to_gyroscope
    true_force, true_rate = unit.correct(read_force, read_rate)
    assert max(apart(true_force, force), apart(true_rate, rate)) < DOUBLE


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("camchain.yaml", "cam0:\n  camera_model: pinhole\n", "is a chain of cameras"),
        ("a.yaml", "imu0: 3\n", "imu0 holds 3 where keys are needed"),
        ("a.yaml", "imu0:\n  model: odd\n", "imu0: model 'odd' is none of calibrated"),
        ("a.yaml", KALIBR.replace("    A:\n", "    B:\n"), "imu0: has no A; all matrices"),
        ("a.yaml", KALIBR.replace("1.02]", "x]"), "imu0: M is "),
        ("a.yaml", KALIBR.replace("0.01\n", ".inf\n", 1), "accelerometer_noise_density is inf, no number"),
        ("a.yaml", "imu0: [\n", "correct the YAML there"),
        ("a.yaml", "imu0: " + "[" * 500, "correct the YAML there"),
    ],
)
def test_a_chain_that_cannot_be_read_is_said_in_one_line(tmp_path, name, text, message):
    with pytest.raises(CalibrationFileError, match=re.escape(message)) as raised:
        imported(tmp_path, name, text, "kalibr")
    assert "\n" not in str(raised.value)


def test_parts_missing_from_a_format_are_not_compared(tmp_path):
    from tumble import compare

    first = calibration(3).model_dump(mode="json", by_alias=True)
    for triad in TRIADS:
        first[triad]["covariance"] = (1e-6 * np.eye(12)).tolist()
    unit = Calibration.model_validate(first)
    pair = compare([unit, back(tmp_path, unit, "kalibr")]).pairs[0]
    compared = {each.group for each in pair.differences if each.compared}
    assert compared == {
        *(f"accelerometer {part}" for part in ("scale", "non-orthogonality")),
        *(f"gyroscope {part}" for part in ("scale", "non-orthogonality", "mounting")),
    }
    assert pair.verdict == "same"
