"""Telemetry logs: IMU samples of MAVLink, by the units that its definitions state."""

import numpy as np
import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mavlink

from mavlink_fixtures import autopilot, highres, scaled, tlog_of
from tumble.logs import list_imus, open_recording
from turntable_sessions import typed
from ulog_fixtures import turning

MG, MRAD = 9.80665e-3, 1e-3


def written(path, *streams):
    """Writes messages of several streams, one after another in time."""
    packets = [packet for together in zip(*streams, strict=True) for packet in together]
    path.write_bytes(tlog_of(packets, interval=0.02 / len(streams)))
    return path


def samples_of(source):
    recording = open_recording(str(source))
    chunks = list(recording.chunks())
    names = ("time", "accelerometer", "gyroscope")
    return recording, {name: np.concatenate([getattr(each, name) for each in chunks]) for name in names}


def heartbeats(count, sender, kind):
    return [mavlink.MAVLink_heartbeat_message(2, kind, 0, 0, 0, 3).pack(sender) for _ in range(count)]


def test_whole_milli_units_become_si_and_their_steps_are_reported(tmp_path):
    path = written(tmp_path / "flight.tlog", scaled(300, autopilot(), "scaled_imu2"))
    recording, found = samples_of(path)
    assert recording.metadata.already_corrected
    assert found["accelerometer"][7] == pytest.approx([3 * MG, -7 * MG, -1000 * MG], rel=1e-12)
    assert found["gyroscope"][7] == pytest.approx([4 * MRAD, -5 * MRAD, 6 * MRAD], rel=1e-12)
    assert np.allclose(found["time"], 5.0 + 0.02 * np.arange(300), atol=1e-9)
    assert any("whole mg, mrad/s and ms" in remark for remark in recording.metadata.remarks)


def test_highres_imu_equals_pymavlink_and_comes_before_raw_messages(tmp_path):
    time, force, turn = turning(np.random.default_rng(1), 300)
    sender = autopilot()
    fine = highres(np.column_stack([time, force, turn]), sender)
    path = written(tmp_path / "flight.tlog", fine, scaled(300, sender))
    recording, found = samples_of(path)
    assert "reads HIGHRES_IMU; the log also holds SCALED_IMU" in recording.metadata.remarks
    theirs, expected = mavutil.mavlink_connection(str(path)), []
    while (message := theirs.recv_match(type="HIGHRES_IMU")) is not None:
        expected.append([message.time_usec / 1e6, message.xacc, message.zgyro])
    theirs.close()
    mine = np.column_stack([found["time"], found["accelerometer"][:, 0], found["gyroscope"][:, 2]])
    assert np.array_equal(mine, np.array(expected))


def test_several_imus_and_several_vehicles_are_distinguished(tmp_path):
    streams = [scaled(100, autopilot(system), f"scaled_imu{n}") for system in (1, 2) for n in ("", 2)]
    path = written(tmp_path / "flight.tlog", *streams)
    assert list_imus(path) == (
        "SCALED_IMU.system1", "SCALED_IMU.system2", "SCALED_IMU2.system1", "SCALED_IMU2.system2",
    )  # fmt: skip
    assert "name one, as flight.tlog:SCALED_IMU.system1" in typed("noise", path).err


@pytest.mark.parametrize("message", ["scaled_imu", "highres"])
@pytest.mark.parametrize("force_v1", [False, True])
def test_components_of_a_vehicle_are_imus_of_their_own(tmp_path, message, force_v1):
    senders = [autopilot(component=number) for number in (1, 7)]
    tables = [np.tile([float(number), 0.0, -9.8, 0.0, 0.0, 0.1], (100, 1)) for number in (3, 5)]
    time = 5.0 + 0.02 * np.arange(100)
    streams = [
        highres(np.column_stack([time, table]), sender)
        if message == "highres"
        else scaled(100, sender, xacc=1000 * int(table[0, 0]))
        for sender, table in zip(senders, tables, strict=True)
    ]
    if force_v1 and message == "scaled_imu":
        for number, sender in enumerate(senders):
            again = [
                mavlink.MAVLink_scaled_imu_message(
                    round(1000 * at), 1000 * (3 + 2 * number), 0, -1000, 0, 0, 0, 0, 0, 0
                ).pack(sender, force_mavlink1=True)
                for at in time
            ]
            streams[number] = again
    path = written(tmp_path / "flight.tlog", *streams)
    name = "HIGHRES_IMU" if message == "highres" else "SCALED_IMU"
    names = (f"{name}.component1", f"{name}.component7")
    assert list_imus(path) == names
    assert f"name one, as flight.tlog:{names[0]}" in typed("noise", path).err
    for each, expected in zip(names, (3.0, 5.0), strict=True):
        _, found = samples_of(f"{path}:{each}")
        unit = 1.0 if message == "highres" else 9.80665
        assert found["accelerometer"][:, 0] == pytest.approx(np.full(100, expected * unit))


@pytest.mark.parametrize(("kind", "names"), [(3, ("RAW_IMU",)), (12, ())])
def test_units_of_raw_imu_are_known_of_ardupilot_only(tmp_path, kind, names):
    sender = autopilot()
    path = written(tmp_path / "flight.tlog", heartbeats(100, sender, kind), scaled(100, sender, "raw_imu"))
    result = typed("inspect", path)
    if names:
        assert list_imus(path) == names
        assert result.code == 0
    else:
        assert result.code == 2
        assert "RAW_IMU of ArduPilot only" in result.err


def test_garbled_messages_are_left_out_and_reported(tmp_path):
    content = bytearray(tlog_of(scaled(300, autopilot())))
    content[3000:3004] = b"\x01\x02\x03\x04"
    content[6000:6100] = bytes(100)
    path = tmp_path / "flight.tlog"
    path.write_bytes(content)
    recording, found = samples_of(path)
    assert 290 < len(found["time"]) < 300
    assert (found["accelerometer"][:, 2] == -1000 * MG).all()
    said = " ".join(recording.metadata.remarks)
    assert "damaged bytes" in said
    assert "garbled message" in said


def test_telemetry_cannot_be_undone_and_says_what_can(tmp_path):
    path = written(tmp_path / "flight.tlog", scaled(100, autopilot()))
    result = typed("inspect", path, "--undo-correction")
    assert result.code == 2
    assert "give the log that the autopilot itself wrote (.ulg, .bin)" in result.err
