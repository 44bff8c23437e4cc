"""Logs of PX4: every IMU, in each form in which it was logged, as pyulog reads it."""

import numpy as np
import pytest
from pyulog.core import ULog

from log_fixtures import DATA
from tumble.foundation.errors import LogError
from tumble.logs import ReadOptions, list_imus, open_recording
from tumble.tools.inspect.procedure import inspect
from turntable_sessions import typed
from ulog_fixtures import DEVICES, ULogWriter, message, sensors, turning

PX4 = sorted((DATA / "px4").glob("*.ulg"))


def samples_of(source, **options):
    recording = open_recording(str(source), ReadOptions(**options))
    chunks = list(recording.chunks())
    joined = {
        name: np.concatenate([getattr(chunk, name) for chunk in chunks])
        for name in ("time", "accelerometer", "gyroscope")
    }
    return recording, joined


@pytest.mark.skipif(not PX4, reason="../shared/data/px4 is not there")
@pytest.mark.parametrize("path", PX4, ids=lambda path: path.stem)
def test_px4_log_opens_without_options_and_equals_pyulog(path):
    recording, found = samples_of(path)
    assert recording.metadata.name.endswith("sensor_combined") or len(list_imus(path)) == 1
    assert recording.metadata.already_corrected
    theirs = ULog(str(path)).get_dataset("sensor_combined").data
    for name, field in (("accelerometer", "accelerometer_m_s2"), ("gyroscope", "gyro_rad")):
        expected = np.stack([theirs[f"{field}[{axis}]"] for axis in range(3)], axis=-1)
        assert np.array_equal(found[name], expected)
    assert np.array_equal(found["time"], theirs["timestamp"] / 1e6)


@pytest.mark.skipif(not PX4, reason="../shared/data/px4 is not there")
@pytest.mark.parametrize("path", PX4, ids=lambda path: path.stem)
def test_every_imu_of_a_log_of_px4_is_inspected(path):
    for name in list_imus(path):
        assert inspect(open_recording(f"{path}:{name}")).timing.samples > 5


def test_both_triads_are_joined_on_the_time_of_the_sensor(tmp_path):
    time, force, turn = turning(np.random.default_rng(1), 3000)
    writer = sensors(ULogWriter(), 1, time, force, turn, shift=0.0007)
    path = sensors(writer, 0, time, force + 1.0, turn).write(tmp_path / "flight.ulg")
    assert list_imus(path) == ("sensor_0", "sensor_1")
    recording, found = samples_of(f"{path}:sensor_1")
    assert recording.metadata.already_corrected is False
    assert recording.metadata.serial == str(DEVICES["accelerometer"] + 1)
    assert np.allclose(found["time"], time + 0.0007, atol=1e-6)
    assert np.array_equal(found["accelerometer"], force)
    assert np.array_equal(found["gyroscope"], turn)
    assert "device ids: accelerometer 2424843, gyroscope 2424844" in recording.metadata.remarks
    with pytest.raises(LogError, match=r"holds 2 IMUs: name one, as flight\.ulg:sensor_0"):
        open_recording(path)


def test_triad_read_at_a_lower_rate_repeats_and_that_is_reported(tmp_path):
    time, force, turn = turning(np.random.default_rng(2), 4000)
    writer = ULogWriter()
    writer.add("sensor_accel", 0, time[::4], device_id=1, **dict(zip("xyz", force[::4].T, strict=True)))
    writer.add("sensor_gyro", 0, time, device_id=2, **dict(zip("xyz", turn.T, strict=True)))
    recording, found = samples_of(writer.write(tmp_path / "flight.ulg"))
    assert len(found["time"]) > 3990
    assert np.array_equal(found["gyroscope"], turn[: len(found["time"])])
    assert np.array_equal(found["accelerometer"][4:12:4], force[4:12:4])
    assert any("stands in several samples" in remark for remark in recording.metadata.remarks)


def test_batches_are_unpacked_by_their_scale_and_interval(tmp_path):
    generator = np.random.default_rng(3)
    batches, size, dt = 300, 7, 125.0
    last = 2.0 + np.arange(1, batches + 1) * size * dt / 1e6
    writer, counts = ULogWriter(), {}
    for topic, scale in (("sensor_accel_fifo", 0.0023), ("sensor_gyro_fifo", 0.00106)):
        values = generator.integers(-3000, 3000, (batches, 20, 3))
        axes = {axis: values[:, :, index] for index, axis in enumerate("xyz")}
        writer.add(topic, 0, last, device_id=7, dt=dt, scale=scale, samples=size, **axes)
        counts[topic] = np.float64(np.float32(scale)) * values[:, :size].reshape(-1, 3)
    recording, found = samples_of(writer.write(tmp_path / "flight.ulg"))
    assert recording.metadata.source.endswith(":sensor_fifo_0") or recording.metadata.alone
    assert np.allclose(found["accelerometer"], counts["sensor_accel_fifo"], rtol=1e-12)
    assert np.allclose(found["gyroscope"], counts["sensor_gyro_fifo"], rtol=1e-12)
    assert np.allclose(np.diff(found["time"]), dt / 1e6, atol=1.1e-6)
    assert found["time"][-1] == pytest.approx(last[-1], abs=1e-6)


def test_angle_and_velocity_are_divided_by_the_time_they_took(tmp_path):
    time, force, turn = turning(np.random.default_rng(4), 500)
    took = {"delta_angle": 5000, "delta_velocity": 4900}
    writer = ULogWriter().add(
        "vehicle_imu", 0, time, delta_angle=turn * 5e-3, delta_velocity=force * 4.9e-3,
        **{f"{name}_dt": value for name, value in took.items()},
    )  # fmt: skip
    recording, found = samples_of(writer.write(tmp_path / "flight.ulg"))
    assert recording.metadata.already_corrected
    assert np.allclose(found["accelerometer"], force, rtol=1e-6)
    assert np.allclose(found["gyroscope"], turn, rtol=1e-6)


def test_imu_logged_once_a_second_is_too_slow_with_a_remedy(tmp_path):
    generator = np.random.default_rng(5)
    writer = sensors(ULogWriter(), 0, *turning(generator, 60, rate=1.0), shift=0.3)
    path = writer.write(tmp_path / "flight.ulg")
    result = typed("inspect", path)
    assert "logged at 1 Hz, too slow to pair their readings in motion" in result.text
    assert "SDLOG_PROFILE bits 8 and 9" in result.text


def test_dropouts_are_reported(tmp_path):
    time, force, turn = turning(np.random.default_rng(6), 600)
    writer = sensors(ULogWriter(), 0, time, force, turn).drop(3.0, 87).drop(4.0, 20)
    recording, _ = samples_of(writer.write(tmp_path / "flight.ulg"))
    assert any("2 dropouts, 107 ms in all" in remark for remark in recording.metadata.remarks)


def test_samples_after_damage_are_read_and_the_damage_reported(tmp_path):
    time, force, turn = turning(np.random.default_rng(7), 3000)
    content = bytearray(sensors(ULogWriter(), 0, time, force, turn).content())
    middle = len(content) // 2
    content[middle : middle + 500] = bytes(500)
    path = tmp_path / "flight.ulg"
    path.write_bytes(content[:-17])
    recording, found = samples_of(path)
    assert 2900 < len(found["time"]) < 3000
    assert set(found["time"]) <= set(np.round(1e6 * time) / 1e6)
    said = " ".join(recording.metadata.remarks)
    assert "damaged bytes" in said
    assert "ends in the middle of a message" in said


def test_a_message_of_a_kind_that_came_to_be_later_is_stepped_over(tmp_path):
    time, force, turn = turning(np.random.default_rng(8), 400)
    content = sensors(ULogWriter(), 0, time, force, turn).content()
    path = tmp_path / "flight.ulg"
    path.write_bytes(content + message("Z", b"12345"))
    recording, found = samples_of(path)
    assert len(found["time"]) == 400
    assert not any("damaged" in remark for remark in recording.metadata.remarks)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"ULog\x01\x12\x35\x01", "is cut short in its first 16 bytes"),
        (ULogWriter().content(), "ends, or is damaged, before its data begin"),
        (ULogWriter().add("other", 0, [1.0, 2.0], value=3.0).content(), "holds no samples of an IMU"),
    ],
    ids=["cut", "no data", "no imu"],
)
def test_a_log_without_samples_is_refused_in_one_line(tmp_path, content, said):
    path = tmp_path / "flight.ulg"
    path.write_bytes(content)
    result = typed("inspect", path)
    assert result.code == 2
    assert said in result.err
    assert len(result.err.strip().splitlines()) == 1
