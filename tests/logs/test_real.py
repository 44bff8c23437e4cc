"""Every real recording reads, and agrees with its own documentation."""

from __future__ import annotations

import json

import numpy as np
import pytest

from log_fixtures import real, refusal
from tumble.logs import ReadOptions, list_imus, open_recording
from tumble.tools.inspect.procedure import inspect

STANDARD_GRAVITY = 9.80665
MPU6050 = ReadOptions(
    accelerometer_scale=16384, accelerometer_unit="g", gyroscope_scale=131, gyroscope_unit="deg/s"
)
XSENS = ReadOptions(
    accelerometer_scale=(414.46, 412.01, 414.65),
    accelerometer_zero=(33124.2, 33275.2, 32364.4),
    gyroscope_scale=(4777.9, 4764.2, 4773.7),
    gyroscope_zero=(32777.1, 32459.8, 32511.8),
)
RECORDINGS = {
    "mimu4444/exp_3.parquet:imu1": (None, 37541, 600.6, 62.5),
    "mimu4444/exp_3.parquet:imu8": (None, 37541, 600.6, 62.5),
    "imucal/annotated_session.csv": (
        ReadOptions(
            rate=204.8, accelerometer_scale=208.0, gyroscope_scale=16.4, gyroscope_unit="deg/s", serial="A"
        ),
        9414,
        46.0,
        204.8,
    ),
    "imucal/example_ferraris_session.csv": (ReadOptions(rate=102.4), 10376, 101.3, 102.4),
    "mpu6050/calibration.csv": (MPU6050, 10245, 102.4, 100.0),
    "mpu6050/static_449s.csv": (MPU6050, 44930, 449.3, 100.0),
    "mpu6050/turn_90_x.csv": (MPU6050, 9987, 99.86, 100.0),
    "mpu9150/imu0.log": (ReadOptions(rate=100.0), 15969, 159.7, 100.0),
    "mpu9150/imu1.log": (ReadOptions(rate=100.0), 15931, 159.3, 100.0),
    "mpu9150/imu2.log": (ReadOptions(rate=100.0), 15934, 159.3, 100.0),
    "xsens": (XSENS, 51175, 511.7, 100.0),
    "husky/test1.bag": (None, 11865, 395.3, 30.0),
    "husky/test2.bag": (None, 3061, 61.2, 50.0),
}


@pytest.fixture(scope="module")
def inspected():
    """Inspections of real recordings, each made once."""
    made = {}

    def get(name):
        if name not in made:
            path = real(name.partition(":")[0])
            made[name] = inspect(
                open_recording(str(path) + name[len(name.partition(":")[0]) :], RECORDINGS[name][0])
            )
        return made[name]

    return get


@pytest.mark.parametrize("name", RECORDINGS)
def test_real_recording_has_the_published_length_and_rate(inspected, name):
    _, samples, duration, rate = RECORDINGS[name]
    timing = inspected(name).timing
    assert timing.samples == samples
    assert timing.duration == pytest.approx(duration, abs=0.05)
    assert timing.rate == pytest.approx(rate, rel=0.002)


@pytest.mark.parametrize("name", RECORDINGS)
def test_an_inspection_is_json_and_text(inspected, name):
    inspection = inspected(name)
    text = json.dumps(inspection.content(), allow_nan=False)
    assert json.loads(text)["timing"]["samples"] == inspection.timing.samples
    assert "turntable, as target: " in repr(inspection)


@pytest.mark.parametrize(
    "name", [name for name in RECORDINGS if not name.startswith(("husky", "imucal/anno"))]
)
def test_a_resting_unit_reads_gravity(inspected, name):
    rests = inspected(name).rests
    lengths = [float(np.linalg.norm(rest.specific_force)) for rest in rests]
    assert len(rests) > 0
    assert float(np.median(lengths)) == pytest.approx(STANDARD_GRAVITY, rel=0.1)


def test_the_eight_imus_of_the_array_are_found():
    assert list_imus(real("mimu4444/exp_3.parquet")) == tuple(f"imu{number}" for number in range(1, 9))
    assert "exp_3.parquet:imu1" in refusal(real("mimu4444/exp_3.parquet"))


def test_array_shows_counts_saturation_and_redundancy(inspected):
    inspection = inspected("mimu4444/exp_3.parquet:imu1")
    accelerometer, gyroscope = inspection.channels[:3], inspection.channels[3:]
    for channel in accelerometer:
        assert channel.step == pytest.approx(STANDARD_GRAVITY / 2048, rel=1e-3)
    for channel in gyroscope:
        assert channel.step == pytest.approx(np.deg2rad(1 / 16.4), rel=1e-3)
        assert channel.high == pytest.approx(np.deg2rad(2000), rel=0.01)
    assert 900 < sum(channel.saturated for channel in gyroscope) < 1300
    assert sum(channel.saturated for channel in accelerometer) == 0
    services = {service.procedure: service for service in inspection.services}
    assert services["turntable, as target"].possible
    assert services["redundancy"].possible
    assert not services["spin"].possible


def test_the_step_of_a_log_written_in_five_decimals_is_found(inspected):
    for channel in inspected("mpu9150/imu0.log").channels[:3]:
        assert channel.step == pytest.approx(9.81 / 2048, rel=1e-3)


def test_an_unnamed_peak_of_the_ferraris_session_makes_it_degrees(inspected):
    unit = inspected("imucal/example_ferraris_session.csv").metadata.gyroscope_unit
    assert unit.name == "deg/s"


def test_the_rate_of_the_mpu6050_stands_before_its_columns(inspected):
    assert (
        "rate of 100 Hz from the line 'fs' before the columns" in inspected("mpu6050/calibration.csv").remarks
    )


def test_wheeled_robot_off_the_spot_is_reported(inspected):
    spin = next(service for service in inspected("husky/test1.bag").services if service.procedure == "spin")
    assert not spin.possible
    assert any("full turn on the spot" in need for need in spin.missing)


def test_a_robot_with_its_imu_y_up_reads_gravity_on_y(inspected):
    force = inspected("husky/test1.bag").rests[0].specific_force
    assert int(np.argmax(np.abs(force))) == 1


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("mimu4444/IMU_positions.csv", "not a log"),
        ("mpu6050/params_acc.csv", "not a log"),
        ("mpu6050/static_intervals.csv", "no column for"),
        ("imucal/example_cal.json", "JSON"),
        ("imucal/annotated_session.csv", "--rate"),
        ("mpu9150/imu0.log", "--rate"),
        ("mpu6050/calibration.csv", "--accelerometer-scale"),
        ("xsens", "--accelerometer-scale"),
        ("husky/LICENSE", "not a log"),
        ("README.md", "not a log"),
    ],
)
def test_invalid_or_incomplete_log_is_refused_in_one_line(name, words):
    assert words in refusal(real(name))


@pytest.mark.parametrize(
    "name",
    [
        *("husky/test1.bag", "husky/test2.bag", "mimu4444/exp_3.parquet"),
        *(
            f"px4/{name}.ulg"
            for name in ("sample", "sample_appended_multiple", "sample_log_small", "test_ulog")
        ),
        *(
            f"redundancy_cases/{name}.parquet"
            for name in ("flip_primary", "p5019_secondary_3", "p5037_primary")
        ),
    ],
)
def test_recording_that_states_time_and_units_needs_no_options(name):
    path = real(name)
    for imu in list_imus(path):
        assert open_recording(f"{path}:{imu}" if imu else path).metadata.accelerometer_unit.scale > 0.0


@pytest.mark.parametrize(
    ("name", "option"),
    [
        *((f"mpu9150/imu{number}.log", "--rate") for number in range(3)),
        ("imucal/example_ferraris_session.csv", "--rate"),
        *((f"mpu6050/{name}.csv", "--accelerometer-scale") for name in ("static_449s", "turn_90_x")),
        ("xsens/xsens_acc.mat", "--accelerometer-scale"),
    ],
)
def test_lacking_time_or_scale_is_refused_with_the_option_to_state_it(name, option):
    assert option in refusal(real(name))
