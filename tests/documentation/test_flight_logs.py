"""The way from a flight log to parameters of the autopilot, as the page shows it."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from tumble.calibration.document import Calibration
from tumble.foundation.firmware.px4 import correction_of
from tumble.logs import open_recording
from turntable_sessions import typed
from ulog_fixtures import ULogWriter

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "flight-logs.md"
DEVICES = (2424842, 2424843)
BEFORE = {
    "CAL_ACC0_ID": DEVICES[0], "CAL_GYRO0_ID": DEVICES[1], "SENS_BOARD_ROT": 4,
    "CAL_ACC0_XOFF": 0.12, "CAL_ACC0_ZOFF": -0.2, "CAL_ACC0_XSCALE": 0.98, "CAL_GYRO0_YOFF": 0.02,
}  # fmt: skip


def flight_log(path, session):
    """Logs a session by hand as PX4 does: as the sensor reads, and corrected."""
    (chunk,) = open_recording(session).chunks()
    writer = ULogWriter(BEFORE)
    corrected = {}
    for name, topic, device in zip(
        ("accelerometer", "gyroscope"), ("sensor_accel", "sensor_gyro"), DEVICES, strict=True
    ):
        readings = getattr(chunk, name)
        writer.add(topic, 0, chunk.time, device_id=device, **dict(zip("xyz", readings.T, strict=True)))
        px4 = correction_of(BEFORE, name, device)
        corrected[name] = (readings - px4.offset) * px4.scale @ px4.body_from_sensor.T
    writer.add(
        "vehicle_imu", 0, chunk.time, accel_device_id=DEVICES[0], gyro_device_id=DEVICES[1],
        delta_velocity=corrected["accelerometer"], delta_angle=corrected["gyroscope"],
        delta_angle_dt=1_000_000, delta_velocity_dt=1_000_000,
    )  # fmt: skip
    return writer.write(path)


def test_the_commands_lead_from_a_flight_log_to_parameters(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made = typed(*shlex.split("simulate multipose --orientations 14 --rate 50 --seed 3 -o hand"))
    assert made.code == 0, made.err
    flight_log(Path("flight.ulg"), "hand/multipose.csv")
    commands = re.findall(r"^    tumble (.*flight\.ulg.*|export .*)$", PAGE.read_text(), re.MULTILINE)
    commands = [each for each in commands if "vehicle_imu_1" not in each]
    assert len(commands) == 5
    for command in commands:
        done = typed(*shlex.split(command))
        assert done.code == 0, f"{command}: {done.err}"
    raw, undone = (
        Calibration.load(f"{folder}/flight-{name}.multipose.yaml")
        for folder, name in (("results", "sensor_0"), ("undone", "vehicle_imu_0"))
    )
    assert np.abs(raw.accelerometer.b - undone.accelerometer.b).max() < 1e-4
    assert np.abs(raw.gyroscope.M - undone.gyroscope.M).max() < 1e-4
    (before,) = Path("before").iterdir()
    assert Calibration.load(before).accelerometer.b == pytest.approx([0.12, 0.0, -0.2])
    assert "CAL_ACC0_XOFF" in Path("flight.params").read_text()
