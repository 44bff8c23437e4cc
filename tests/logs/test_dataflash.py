"""Logs of ArduPilot: every IMU, filtered, raw and in batches, as pymavlink reads them."""

import numpy as np
import pytest
from pymavlink import mavutil

from dataflash_fixtures import DataFlashWriter
from tumble.logs import ReadOptions, list_imus, open_recording
from tumble.tools.inspect.procedure import inspect
from turntable_sessions import typed
from ulog_fixtures import turning


def samples_of(source, **options):
    recording = open_recording(str(source), ReadOptions(**options))
    chunks = list(recording.chunks())
    joined = {
        name: np.concatenate([getattr(chunk, name) for chunk in chunks])
        for name in ("time", "accelerometer", "gyroscope")
    }
    return recording, joined


@pytest.mark.parametrize("name", ["flight.bin", "flight.log"])
def test_imus_hold_what_pymavlink_reads(tmp_path, name):
    time, force, turn = turning(np.random.default_rng(1), 400)
    writer = DataFlashWriter({"INS_ACC_ID": 2753028})
    writer.triads("IMU", time, force, turn).triads("IMU", time, force + 1.0, turn, instance=1)
    path = writer.write(tmp_path / name)
    assert list_imus(path) == ("imu_0", "imu_1")
    recording, found = samples_of(f"{path}:imu_1")
    assert recording.metadata.already_corrected
    theirs = mavutil.mavlink_connection(str(path))
    expected = []
    while (message := theirs.recv_match(type="IMU")) is not None:
        if message.I == 1:
            expected.append([message.TimeUS / 1e6, message.AccX, message.AccY, message.AccZ, message.GyrZ])
    # It leaves its file open, of which a later test would be warned.
    theirs.filehandle.close()
    expected = np.array(expected)
    assert np.array_equal(found["time"], expected[:, 0])
    assert np.array_equal(found["accelerometer"], expected[:, 1:4])
    assert np.array_equal(found["gyroscope"][:, 2], expected[:, 4])
    assert open_recording(f"{path}:imu_0").metadata.serial == "2753028"


def test_imus_of_older_logs_are_known_by_their_messages(tmp_path):
    time, force, turn = turning(np.random.default_rng(2), 300)
    path = DataFlashWriter().triads("IMU2", time, force, turn).write(tmp_path / "flight.bin")
    recording, found = samples_of(path)
    assert recording.metadata.source.endswith(":imu_1")
    assert np.allclose(found["accelerometer"], force, rtol=1e-6)


@pytest.mark.parametrize("name", ["flight.bin", "flight.log"])
def test_raw_readings_are_joined_on_sensor_time_and_come_first(tmp_path, name):
    time, force, turn = turning(np.random.default_rng(3), 500)
    writer = DataFlashWriter().triads("IMU", time[::8], force[::8], turn[::8])
    path = writer.triads("ACC", time, force, turn).write(tmp_path / name)
    recording, found = samples_of(path)
    assert recording.metadata.source.endswith(":raw_0")
    assert "reads raw_0; the log also holds imu_0" in recording.metadata.remarks
    assert np.allclose(found["accelerometer"], force, rtol=1e-6)
    assert np.allclose(found["gyroscope"], turn, rtol=1e-6)
    assert np.allclose(found["time"], time, atol=2e-5)


def test_gyroscopes_logged_without_accelerometers_are_read(tmp_path):
    time, _, turn = turning(np.random.default_rng(4), 300)
    writer = DataFlashWriter()
    for at, w in zip((1e6 * time).astype(int).tolist(), turn, strict=True):
        writer.add("GYR", at, 0, at, *w)
    recording, found = samples_of(writer.write(tmp_path / "flight.bin"))
    assert recording.metadata.triads == ("gyroscope",)
    assert np.allclose(found["gyroscope"], turn, rtol=1e-6)


@pytest.mark.parametrize(("option", "corrected"), [(0, True), (1, False), (np.inf, True)])
def test_batches_are_taken_apart_by_their_multiplier_and_rate(tmp_path, option, corrected):
    generator = np.random.default_rng(5)
    writer, counts = DataFlashWriter({"INS_LOG_BAT_OPT": option}), []
    for number in range(6):
        counts.append(generator.integers(-2000, 2000, (1000, 3)))
        writer.batch(2 * number, 0, 1, 5.0 + number, 4000.0, 2048, counts[-1])
        writer.batch(2 * number + 1, 1, 1, 5.5 + number, 4000.0, 939, counts[-1])
    path = writer.write(tmp_path / "flight.bin")
    assert list_imus(path) == ("batch_accelerometer_1", "batch_gyroscope_1")
    recording, found = samples_of(f"{path}:batch_accelerometer_1")
    assert recording.metadata.already_corrected is corrected
    assert np.array_equal(found["accelerometer"], np.vstack(counts) / 2048)
    expected = np.concatenate([5.0 + number + np.arange(1000) / 4000.0 for number in range(6)])
    assert np.allclose(found["time"], expected, atol=1e-9)
    _, turns = samples_of(f"{path}:batch_gyroscope_1")
    assert np.array_equal(turns["gyroscope"], np.vstack(counts) / 939)


def test_samples_after_damage_are_read_and_empty_end_pages_are_fine(tmp_path):
    time, force, turn = turning(np.random.default_rng(6), 2000)
    content = bytearray(DataFlashWriter().triads("IMU", time, force, turn).content())
    path = tmp_path / "flight.bin"
    path.write_bytes(bytes(content) + b"\xff" * 300)
    assert not any("damaged" in remark for remark in open_recording(path).metadata.remarks)
    content[70_000:70_400] = bytes(range(200)) * 2
    path.write_bytes(content[:-10])
    recording, found = samples_of(path)
    assert 1980 < len(found["time"]) < 2000
    assert set(found["time"]) <= set(np.round(1e6 * time) / 1e6)
    assert any("damaged bytes" in remark for remark in recording.metadata.remarks)


def test_unreadable_line_of_text_is_left_out_and_reported(tmp_path):
    time, force, turn = turning(np.random.default_rng(7), 300)
    text = DataFlashWriter().triads("IMU", time, force, turn).text().replace("\nIMU, 3", "\nIMU, x", 1)
    path = tmp_path / "flight.log"
    path.write_text(text)
    recording, found = samples_of(path)
    assert len(found["time"]) == 299
    assert "left out 1 line that cannot be read" in " ".join(recording.metadata.remarks)


def test_lines_before_a_log_of_text_are_passed_over(tmp_path):
    time, force, turn = turning(np.random.default_rng(9), 300)
    path = tmp_path / "flight.log"
    path.write_text("ArduCopter V3.1\n\n" + DataFlashWriter().triads("IMU", time, force, turn).text())
    recording, found = samples_of(path)
    assert recording.metadata.format == "dataflash"
    assert len(found["time"]) == 300


def test_every_imu_of_a_log_is_inspected(tmp_path):
    time, force, turn = turning(np.random.default_rng(8), 500)
    writer = DataFlashWriter().triads("IMU", time, force, turn).triads("ACC", time, force, turn)
    result = typed("inspect", writer.write(tmp_path / "flight.bin"))
    assert result.code == 0
    assert "flight.bin:raw_0" in result.text
    assert "flight.bin:imu_0" in result.text
    assert "the log is already corrected" in result.text
    assert inspect(open_recording(tmp_path / "flight.bin")).timing.samples == 500


@pytest.mark.parametrize("name", ["flight.bin", "flight.log"])
def test_a_log_without_an_imu_is_refused_in_one_line(tmp_path, name):
    result = typed("inspect", DataFlashWriter({"INS_ACC_ID": 1}).write(tmp_path / name))
    assert result.code == 2
    assert "holds no samples of an IMU; it needs messages IMU, ACC and GYR, or ISBH and ISBD" in result.err
    assert len(result.err.strip().splitlines()) == 1
