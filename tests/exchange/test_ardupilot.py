"""Parameters of ArduPilot as its firmware names, fills and applies them.

Names and defaults: ArduPilot/ardupilot, libraries/AP_InertialSensor/AP_InertialSensor.cpp at 5b049ea0bf31 and
AP_InertialSensor_Params.cpp at 232621231671 (IMUs 4 and 5).
"""

import numpy as np
import pytest

from dataflash_fixtures import DataFlashWriter
from exchange_units import calibration
from tumble.calibration.document import Calibration
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.firmware.ardupilot import correction_of
from tumble.logs import ReadOptions, open_recording
from tumble.tools.exchange.ardupilot import calibrations_in
from tumble.tools.exchange.parameters import numbers_of
from tumble.tools.exchange.procedure import export, import_calibrations
from turntable_sessions import typed
from ulog_fixtures import turning

FLOWN = {
    "INS_GYROFFS_X": -0.0799, "INS_GYROFFS_Y": -0.0060, "INS_GYROFFS_Z": 0.0063,
    "INS_GYR2OFFS_X": 0.0171, "INS_GYR2OFFS_Y": 0.0129, "INS_GYR2OFFS_Z": 0.0067,
    "INS_GYR3OFFS_X": 0.0, "INS_GYR3OFFS_Y": 0.0, "INS_GYR3OFFS_Z": 0.0,
    "INS_ACCSCAL_X": 0.9997, "INS_ACCSCAL_Y": 0.9025, "INS_ACCSCAL_Z": 1.0013,
    "INS_ACCOFFS_X": -0.0317, "INS_ACCOFFS_Y": 2.4852, "INS_ACCOFFS_Z": -0.2932,
    "INS_ACC2SCAL_X": 0.0, "INS_ACC2SCAL_Y": 0.0, "INS_ACC2SCAL_Z": 0.0,
    "INS_ACC2OFFS_X": 0.0, "INS_ACC2OFFS_Y": 0.0, "INS_ACC2OFFS_Z": 0.0,
    "INS_ACC3SCAL_X": 0.0, "INS_ACC3SCAL_Y": 0.0, "INS_ACC3SCAL_Z": 0.0,
}  # fmt: skip
"""Parameters of a vehicle that flew, rounded; the second accelerometer made absent, which older firmware
marks by 0."""


def of_vehicle(path, parameters):
    path.write_text("".join(f"{name},{value}\n" for name, value in parameters.items()))
    return path


@pytest.mark.parametrize(
    ("instance", "gyroscope", "accelerometer"),
    [
        (1, "INS_GYROFFS_", "INS_ACCOFFS_"),
        (2, "INS_GYR2OFFS_", "INS_ACC2OFFS_"),
        (3, "INS_GYR3OFFS_", "INS_ACC3OFFS_"),
        (4, "INS4_GYROFFS_", "INS4_ACCOFFS_"),
        (5, "INS5_GYROFFS_", "INS5_ACCOFFS_"),
    ],
)
def test_biases_stand_under_the_names_that_the_firmware_has(instance, gyroscope, accelerometer):
    unit = calibration(3, parts=("scale",))
    text = export(unit, "ardupilot", {"instance": str(instance)}).content.decode()
    found = numbers_of(text, ",", 0, 1)
    for names, section in ((gyroscope, unit.gyroscope), (accelerometer, unit.accelerometer)):
        assert [found[names + axis] for axis in "XYZ"] == pytest.approx(section.b, rel=1e-6)
    assert not any(name.startswith("INS_GYRO") and not name.startswith("INS_GYROFFS") for name in found)


@pytest.mark.parametrize("form", ["param", "bin"])
def test_parameters_of_a_vehicle_give_all_that_it_has_and_no_more(tmp_path, form):
    path = tmp_path / f"vehicle.{form}"
    _ = of_vehicle(path, FLOWN) if form == "param" else DataFlashWriter(FLOWN).write(path)
    first, second = import_calibrations(path)
    assert first.gyroscope.b == pytest.approx([-0.0799, -0.0060, 0.0063])
    assert np.diag(first.accelerometer.M) == pytest.approx([1 / 0.9997, 1 / 0.9025, 1 / 1.0013])
    assert second.gyroscope.b == pytest.approx([0.0171, 0.0129, 0.0067])
    assert second.accelerometer is None


def test_scales_of_zero_are_ones_as_the_firmware_sets_them():
    # AP_InertialSensor::init sets a scale of three zeros to ones before anything is corrected by it.
    found = FLOWN | {"INS_ACC2OFFS_X": 0.2}
    second = Calibration.model_validate(calibrations_in(found)[1])
    assert np.array_equal(second.accelerometer.M, np.eye(3))
    assert second.accelerometer.b[0] == 0.2
    with pytest.raises(CalibrationFileError, match="INS_ACCSCAL_Y is 0, no scale"):
        calibrations_in(FLOWN | {"INS_ACCSCAL_Y": 0.0})


def test_the_first_gyroscope_gets_its_offset_back_when_undone(tmp_path):
    time, force, turn = turning(np.random.default_rng(9), 150)
    offset = np.array([FLOWN[f"INS_GYROFFS_{axis}"] for axis in "XYZ"])
    log = DataFlashWriter(FLOWN).triads("IMU", time, force, turn - offset, 0, 30.0)
    recording = open_recording(str(log.write(tmp_path / "flight.bin")), ReadOptions(undo_correction=True))
    undone = np.concatenate([chunk.gyroscope for chunk in recording.chunks()])
    assert np.abs(undone - turn).max() < 1e-6


@pytest.mark.parametrize(("enabled", "applied"), [(0, False), (1, True), (2, False)])
def test_a_thermal_correction_that_is_being_learned_is_not_applied(enabled, applied):
    found = FLOWN | {"INS_TCAL1_ENABLE": enabled, "INS_TCAL1_ACC1_X": 1e4, "INS_ACC1_CALTEMP": 20.0}
    thermal = correction_of(found, "accelerometer", 1).thermal
    assert (thermal is not None) == applied


def test_a_sensor_without_a_temperature_of_calibration_has_the_lowest():
    found = FLOWN | {"INS_TCAL1_ENABLE": 1, "INS_TCAL1_TMIN": 5.0, "INS_TCAL1_ACC1_X": 1e4}
    # INS_ACC1_CALTEMP is -300 by default, held within TMIN and TMAX.
    assert correction_of(found, "accelerometer", 1).thermal.at(np.array([5.0]))[0, 0] == 0.0
    given = correction_of(found | {"INS_ACC1_CALTEMP": -300.0}, "accelerometer", 1)
    assert given.thermal.reference == 5.0


@pytest.mark.parametrize(
    ("number", "first_row"),
    [
        # AP_Math/vector3.cpp, Vector3::rotate
        (8, (1.0, 0.0, 0.0)),
        (38, (0.143038972, 0.368776487, -0.918446381)),
        (41, (0.992546152, 0.0, 0.121869343)),
        (42, (1.0, 0.0, 0.0)),
        (43, (1.0, 0.0, 0.0)),
    ],
)
def test_boards_are_turned_as_the_firmware_turns_them(number, first_row):
    turned = correction_of(FLOWN | {"AHRS_ORIENTATION": number}, "gyroscope", 1).body_from_sensor
    assert turned[0] == pytest.approx(first_row, abs=1e-9)
    lower = {8: (0.0, -1.0), 42: (np.sqrt(0.5), np.sqrt(0.5)), 43: (-np.sqrt(0.5), np.sqrt(0.5))}
    if number in lower:
        assert turned[2, 1:] == pytest.approx(lower[number])


@pytest.mark.parametrize("number", [44, 100, 101])
def test_a_board_turned_in_a_way_that_is_not_known_is_not_undone(number):
    with pytest.raises(CalibrationFileError, match=f"AHRS_ORIENTATION is {number}.*not undone"):
        correction_of(FLOWN | {"AHRS_ORIENTATION": number}, "gyroscope", 1)


@pytest.mark.parametrize("instance", [1, 4])
def test_temperature_of_any_imu_goes_out_and_comes_back(tmp_path, instance):
    first = calibration(3, parts=("scale",), over_temperature=True)
    first.save(tmp_path / "unit.yaml")
    out, back = tmp_path / "imu.param", tmp_path / "back"
    settings = ("--set", f"instance={instance}")
    assert typed("export", tmp_path / "unit.yaml", "--format", "ardupilot", *settings, "-o", out).code == 0
    assert typed("import", out, "-o", back).code == 0
    force = np.random.default_rng(1).normal(size=(20, 3))
    for temperature in (-40.0, 33.0, 90.0):
        theirs = Calibration.load(back / f"imu{instance}.yaml").correct(force, force, temperature)
        ours = first.correct(force, force, temperature)
        assert np.abs(np.subtract(theirs, ours)[0]).max() < 2e-5
