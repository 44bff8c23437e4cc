"""Corrections by firmware, undone by the parameters in its log."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from dataflash_fixtures import DataFlashWriter
from exchange_units import calibration
from log_fixtures import DATA
from tumble.foundation.errors import LogError
from tumble.foundation.firmware.px4 import correction_of
from tumble.foundation.firmware.rotations import from_euler, rotation
from tumble.logs import ReadOptions, open_recording
from tumble.tools.exchange.parameters import numbers_of
from tumble.tools.exchange.procedure import export
from turntable_sessions import typed
from ulog_fixtures import ULogWriter, turning

DEVICES = {"accelerometer": 2424842, "gyroscope": 2424843}
FLOWN = DATA / "px4" / "sample_log_small.ulg"
"""Three IMUs, on a board turned by 180 degrees and levelled."""
FLOAT32 = 2e-6
"""m/s^2 and rad/s, about 10: what single precision keeps."""


def parameters_of(unit, to, separator, name, value, **settings_):
    text = export(unit, to, {key.replace("_", "-"): str(each) for key, each in settings_.items()}).content
    return numbers_of(text.decode(), separator, name, value)


def px4_parameters(unit):
    return parameters_of(unit, "px4", r"\t", 2, 3, **{f"{triad}_id": id_ for triad, id_ in DEVICES.items()})


def as_types(parameters):
    whole = ("_ID", "_ENABLE", "_ROT")
    return {name: int(v) if name.endswith(whole) else float(v) for name, v in parameters.items()}


def vector(found, names):
    return np.array([found[names.format(axis)] for axis in "XYZ"])


def corrected_by_px4(found, readings, board, thermal=None):
    """sensor_calibration: R ((data - thermal - offset) * scale), but for changes of up to 0.01."""
    corrected = {}
    for triad, word in (("accelerometer", "ACC"), ("gyroscope", "GYRO")):
        offset = vector(found, f"CAL_{word}0_{{}}OFF")
        scale = vector(found, "CAL_ACC0_{}SCALE") if word == "ACC" else np.ones(3)
        offset = offset if np.linalg.norm(offset) > 0.01 else np.zeros(3)
        scale = scale if np.linalg.norm(scale - 1.0) > 0.01 else np.ones(3)
        free = (readings[triad] - (0.0 if thermal is None else thermal[triad]) - offset) * scale
        corrected[triad] = (free @ board.T).astype(np.float32)
    return corrected


def logged(path, time, corrected, parameters, temperature=None):
    writer = ULogWriter(as_types(parameters))
    writer.add(
        "vehicle_imu", 0, time, accel_device_id=DEVICES["accelerometer"],
        gyro_device_id=DEVICES["gyroscope"], delta_angle=corrected["gyroscope"],
        delta_velocity=corrected["accelerometer"], delta_angle_dt=1_000_000, delta_velocity_dt=1_000_000,
    )  # fmt: skip
    if temperature is not None:
        writer.add("sensor_accel", 0, time, device_id=DEVICES["accelerometer"], temperature=temperature)
    return writer.write(path)


def read(source, **options):
    recording = open_recording(str(source), ReadOptions(**options))
    chunks = list(recording.chunks())
    names = ("accelerometer", "gyroscope")
    return recording, {name: np.concatenate([getattr(chunk, name) for chunk in chunks]) for name in names}


@settings(max_examples=10)
@given(seed=st.integers(0, 1000), board=st.integers(0, 40))
def test_px4_correction_by_an_exported_calibration_is_undone(tmp_path_factory, seed, board):
    unit = calibration(seed, parts=("scale",))
    unit = unit.model_copy(update={"gyroscope": unit.gyroscope.model_copy(update={"M": np.eye(3)})})
    found = px4_parameters(unit) | {"SENS_BOARD_ROT": board}
    time, force, turn = turning(np.random.default_rng(seed), 200)
    raw = {"accelerometer": force, "gyroscope": turn}
    corrected = corrected_by_px4(found, raw, rotation(board))
    path = logged(tmp_path_factory.mktemp("px4") / "flight.ulg", time, corrected, found)
    recording, undone = read(path, undo_correction=True)
    assert recording.metadata.already_corrected is False
    assert any("was undone by the parameters" in remark for remark in recording.metadata.remarks)
    for triad, readings in raw.items():
        assert np.abs(undone[triad] - readings).max() < FLOAT32 * max(1.0, np.abs(readings).max())
    _, left = read(path)
    assert np.array_equal(left["accelerometer"], corrected["accelerometer"])


@pytest.mark.skipif(not FLOWN.exists(), reason="../shared/data/px4 is not there")
@pytest.mark.parametrize("instance", range(3))
def test_correction_by_a_vehicle_is_undone_to_raw_readings(instance):
    _, raw = read(f"{FLOWN}:sensor_{instance}")
    _, corrected = read(f"{FLOWN}:vehicle_imu_{instance}")
    _, undone = read(f"{FLOWN}:vehicle_imu_{instance}", undo_correction=True)
    for triad, apart in (("accelerometer", 0.03), ("gyroscope", 0.006)):
        # Both are means of about ten readings at rest, not of the same moments.
        said = raw[triad].mean(axis=0)
        assert np.abs(undone[triad].mean(axis=0) - said).max() < apart
        assert np.abs(corrected[triad].mean(axis=0) - said).max() > 2 * apart


def test_temperature_correction_of_px4_is_undone(tmp_path):
    unit = calibration(4, parts=("scale",), over_temperature=True)
    unit = unit.model_copy(update={"gyroscope": unit.gyroscope.model_copy(update={"M": np.eye(3)})})
    found = px4_parameters(unit)
    time, force, turn = turning(np.random.default_rng(4), 400)
    temperature = np.linspace(-30.0, 80.0, len(time)).astype(np.float32)
    thermal = {}
    for triad, letter in (("accelerometer", "A"), ("gyroscope", "G")):
        # temperature_compensation.cpp: the temperature is held within TMIN and TMAX
        held = np.clip(temperature, found[f"TC_{letter}0_TMIN"], found[f"TC_{letter}0_TMAX"])
        powers = (held.astype(np.float64) - found[f"TC_{letter}0_TREF"])[:, np.newaxis]
        thermal[triad] = sum(
            np.array([found[f"TC_{letter}0_X{power}_{axis}"] for axis in range(3)]) * powers**power
            for power in range(4)
        )
    raw = {"accelerometer": force, "gyroscope": turn}
    corrected = corrected_by_px4(found, raw, np.eye(3), thermal)
    path = logged(tmp_path / "flight.ulg", time, corrected, found, temperature)
    _, undone = read(path, undo_correction=True, topic="vehicle_imu_0")
    for triad, readings in raw.items():
        assert np.abs(undone[triad] - readings).max() < 3 * FLOAT32 * max(1.0, np.abs(readings).max())
    without = logged(tmp_path / "without.ulg", time, corrected, found)
    with pytest.raises(LogError, match="the firmware followed temperature, which the log does not hold"):
        read(without, undo_correction=True)


def test_thermal_parameters_of_px4_serve_the_device_that_they_name():
    # TemperatureCompensation.cpp, set_sensor_id: whatever slot of CAL_* or TC_* that is, calibrated or not
    device = DEVICES["accelerometer"]
    found = {"TC_A_ENABLE": 1, "TC_A2_ID": device, "TC_A2_X0_0": 0.25, "TC_A2_TMAX": 50.0}
    for calibrated in ({}, {"CAL_ACC1_ID": device}):
        thermal = correction_of(found | calibrated, "accelerometer", device).thermal
        assert thermal.at(np.array([20.0]))[0] == pytest.approx([0.25, 0.0, 0.0])
    assert correction_of(found | {"TC_A_ENABLE": 0}, "accelerometer", device).thermal is None
    assert correction_of(found, "accelerometer", device + 1).thermal is None


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan, np.inf])
def test_a_scale_that_px4_refuses_is_not_undone(scale):
    # Accelerometer.cpp, set_scale: none but finite ones above zero are taken.
    found = {"CAL_ACC0_ID": 7, "CAL_ACC0_XSCALE": scale, "CAL_ACC0_YSCALE": 1.5, "CAL_ACC0_XOFF": 0.3}
    correction = correction_of(found, "accelerometer", 7)
    assert np.array_equal(correction.scale, np.ones(3))
    assert correction.offset[0] == 0.3


def turned_by_ardupilot(board):
    # AP_Math/rotations.h: "this is actually, roll 90, pitch 68.8, yaw 293.3"
    return from_euler(90.0, 68.8, 293.3) if board == 38 else rotation(board)


@settings(max_examples=8)
@example(seed=1, board=38, ending="bin")
@given(seed=st.integers(0, 1000), board=st.integers(0, 40), ending=st.sampled_from(["bin", "log"]))
def test_ardupilot_correction_by_an_exported_calibration_is_undone(tmp_path_factory, seed, board, ending):
    unit = calibration(seed, parts=("scale",), over_temperature=True)
    unit = unit.model_copy(update={"gyroscope": unit.gyroscope.model_copy(update={"M": np.eye(3)})})
    found = parameters_of(unit, "ardupilot", r"[,\s]+", 0, 1, instance=2) | {"AHRS_ORIENTATION": board}
    time, force, turn = turning(np.random.default_rng(seed), 150)
    temperature = np.float64(np.float32(np.random.default_rng(seed).uniform(-30.0, 80.0)))
    corrected = {}
    for triad, word, readings in (("accelerometer", "ACC", force), ("gyroscope", "GYR", turn)):
        # AP_InertialSensor_tempcal.cpp: coefficients times 1e-6 about 35 degC, within TMIN and TMAX
        def polynomial(degrees, word=word):
            held = np.clip(degrees, found["INS_TCAL2_TMIN"], found["INS_TCAL2_TMAX"]) - 35.0
            powers = (vector(found, f"INS_TCAL2_{word}{k}_" + "{}") * held**k for k in (1, 2, 3))
            return 1e-6 * sum(powers)

        free = readings - polynomial(temperature) + polynomial(found[f"INS_{word}2_CALTEMP"])
        scale = vector(found, "INS_ACC2SCAL_{}") if word == "ACC" else np.ones(3)
        turned = (free - vector(found, f"INS_{word}2OFFS_{{}}")) * scale @ turned_by_ardupilot(board).T
        corrected[triad] = turned.astype(np.float32).astype(np.float64)
    writer = DataFlashWriter(found).triads("IMU", time, *corrected.values(), 1, temperature)
    path = writer.write(tmp_path_factory.mktemp("ardupilot") / f"flight.{ending}")
    recording, undone = read(path, undo_correction=True)
    assert recording.metadata.already_corrected is False
    for triad, readings in (("accelerometer", force), ("gyroscope", turn)):
        assert np.abs(undone[triad] - readings).max() < 3 * FLOAT32 * max(1.0, np.abs(readings).max())


def test_ardupilot_log_without_parameters_cannot_be_undone(tmp_path):
    time, force, turn = turning(np.random.default_rng(9), 150)
    path = DataFlashWriter().triads("IMU", time, force, turn).write(tmp_path / "flight.bin")
    result = typed("inspect", path, "--undo-correction")
    assert result.code == 2
    assert "the log holds no parameters (PARM)" in result.err


def test_a_parameter_that_changes_in_flight_holds_from_then_on(tmp_path):
    found = {f"CAL_ACC0_{axis}OFF": 0.1 for axis in "XYZ"} | {"CAL_ACC0_ID": DEVICES["accelerometer"]}
    time, force, turn = turning(np.random.default_rng(5), 400)
    change = 200
    corrected = force - 0.1
    corrected[change:] = force[change:] - [0.1, 0.5, 0.1]
    writer = ULogWriter(as_types(found))
    writer.add(
        "vehicle_imu", 0, time, accel_device_id=DEVICES["accelerometer"],
        gyro_device_id=DEVICES["gyroscope"], delta_angle=turn, delta_velocity=corrected,
        delta_angle_dt=1_000_000, delta_velocity_dt=1_000_000,
    )  # fmt: skip
    path = writer.change(time[change] - 1e-3, "CAL_ACC0_YOFF", 0.5).write(tmp_path / "flight.ulg")
    _, undone = read(path, undo_correction=True)
    apart = np.abs(undone["accelerometer"] - force).max(axis=1)
    # The log shows only between which samples it changed.
    assert np.delete(apart, change - 1).max() < 1e-5


def test_logs_of_px4_whose_drivers_corrected_are_refused(tmp_path):
    time, force, turn = turning(np.random.default_rng(8), 300)
    writer = ULogWriter({"CAL_ACC_PRIME": 1, "CAL_GYRO_PRIME": 1, "CAL_ACC0_ID": 1, "CAL_ACC0_XOFF": 0.3})
    writer.add("sensor_combined", 0, time, gyro_rad=turn, accelerometer_m_s2=force)
    result = typed("inspect", writer.write(tmp_path / "flight.ulg"), "--undo-correction")
    assert result.code == 2
    assert "is of PX4 before 1.11, whose drivers corrected as well" in result.err


def test_readings_as_the_sensor_gives_them_have_nothing_to_undo(tmp_path):
    time, force, turn = turning(np.random.default_rng(6), 300)
    writer = ULogWriter({"CAL_ACC0_ID": 1, "CAL_ACC0_XOFF": 0.3})
    for topic, values in (("sensor_accel", force), ("sensor_gyro", turn)):
        writer.add(topic, 0, time, device_id=1, **dict(zip("xyz", values.T, strict=True)))
    recording, found = read(writer.write(tmp_path / "flight.ulg"), undo_correction=True)
    assert np.array_equal(found["accelerometer"], force)
    assert any("nothing was undone" in remark for remark in recording.metadata.remarks)


def test_log_of_unknown_correction_is_refused_in_one_line(tmp_path):
    time = np.arange(300) / 100.0
    table = np.column_stack([time, np.full((300, 3), 5.6), np.full((300, 3), 0.01)])
    path = tmp_path / "log.csv"
    np.savetxt(path, table, delimiter=",", header="time,ax,ay,az,gx,gy,gz", comments="")
    result = typed("inspect", path, "--undo-correction", "--accelerometer-unit", "m/s^2")
    assert result.code == 2
    assert "it does not state how it was corrected" in result.err
    assert len(result.err.strip().splitlines()) == 1


def test_a_procedure_that_calibrates_corrected_readings_warns(tmp_path):
    time, force, turn = turning(np.random.default_rng(7), 300)
    path = logged(tmp_path / "flight.ulg", time, {"accelerometer": force, "gyroscope": turn}, {})
    warned = typed("inspect", path).text
    assert "the log is already corrected" in warned
    assert "the log is already corrected" not in typed("inspect", path, "--undo-correction").text
