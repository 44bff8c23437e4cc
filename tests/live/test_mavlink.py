"""MAVLink as autopilots send it: several messages, several systems, units stated or not, garbage between."""

from __future__ import annotations

import socket

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from live_fixtures import (
    Scripted,
    chunks_of,
    first_samples,
    pieces_of,
    resting,
    samples_of,
    serial_device,
)
from mavlink_fixtures import UDP, autopilot, highres, over, scripted
from ports import free_port
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import LogError
from tumble.live import open_source

pytestmark = pytest.mark.usefixtures("simulated_clock")

TABLE = resting(120)


def scaled(table, kind="scaled_imu", sender=None, temperature=2150):
    """SCALED_IMU and its like, in whole mg and mrad/s."""
    sender = sender or autopilot()
    message = getattr(mavlink, f"MAVLink_{kind}_message")
    force = np.round(table[:, 1:4] / STANDARD_GRAVITY * 1e3).astype(int)
    rate = np.round(table[:, 4:7] * 1e3).astype(int)
    return [
        message(round(1e3 * row[0]), *a, *g, 0, 0, 0, temperature).pack(sender)
        for row, a, g in zip(table, force.tolist(), rate.tolist(), strict=True)
    ]


def raw(table, sender=None):
    """RAW_IMU with 1000 counts a g, as ArduPilot sends it."""
    sender = sender or autopilot()
    force = np.round(table[:, 1:4] / STANDARD_GRAVITY * 1e3).astype(int)
    rate = np.round(table[:, 4:7] * 1e3).astype(int)
    return [
        mavlink.MAVLink_raw_imu_message(round(1e6 * row[0]), *a, *g, 0, 0, 0, 0, 0).pack(sender)
        for row, a, g in zip(table, force.tolist(), rate.tolist(), strict=True)
    ]


def heartbeats(count, sender=None):
    sender = sender or autopilot()
    return [mavlink.MAVLink_heartbeat_message(10, 3, 0, 0, 4, 3).pack(sender) for _ in range(count)]


def interleaved(*streams):
    """Messages of several streams in turn."""
    return [message for together in zip(*streams, strict=True) for message in together]


def refusal(pieces, text=UDP, **options):
    with pytest.raises(LogError) as caught:
        samples_of(scripted(pieces, text, **options))
    message = str(caught.value)
    assert "\n" not in message
    return message


def near(found, table, atol):
    return found.shape == table.shape and np.allclose(found, table, rtol=0.0, atol=atol)


def test_highres_imu_comes_over_udp():
    port = free_port()
    found = []
    with (
        open_source(f"mavlink:udpin:127.0.0.1:{port}") as source,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        chunks = iter(source)
        for message in highres(TABLE):
            sender.sendto(message, ("127.0.0.1", port))
            chunk = next(chunks)
            found.append(np.column_stack([chunk.time, chunk.accelerometer, chunk.gyroscope]))
    assert near(np.concatenate(found), TABLE, 1e-6)


def test_highres_imu_comes_over_a_serial_line_with_garbage_before_it():
    with serial_device() as device, open_source(f"mavlink:{device.path}?baud=57600") as source:
        device.write(b"\x00nsh> \xfd\x10" + b"".join(highres(TABLE)))
        # The length that the garbage claims swallows the first message.
        found = first_samples(source, len(TABLE) - 1)
    assert near(found, TABLE[1:], 1e-6)


def test_messages_may_be_cut_anywhere():
    data = b"".join(highres(TABLE))
    for size in (1, 7, 64, 4096):
        assert near(samples_of(scripted(pieces_of(data, size))), TABLE, 1e-6)


def test_a_message_corrupted_on_the_way_is_left_out():
    messages = highres(TABLE)
    corrupted = bytearray(messages[60])
    corrupted[20] ^= 0xFF
    messages[60] = bytes(corrupted)
    found = samples_of(scripted(messages))
    assert near(found, np.delete(TABLE, 60, axis=0), 1e-6)


def test_whole_milli_units_are_converted_and_reported_as_coarse():
    source = scripted(scaled(TABLE))
    assert near(samples_of(source), TABLE, 0.51e-3 * STANDARD_GRAVITY)
    assert any("SCALED_IMU comes in whole mg, mrad/s and ms" in remark for remark in source.remarks)
    assert not source.gyroscope_unit_is_assumed


def test_the_finest_message_is_chosen_and_the_others_are_named():
    source = scripted(interleaved(scaled(TABLE), heartbeats(120), highres(TABLE)))
    assert near(samples_of(source), TABLE, 1e-6)
    assert any(
        "reads HIGHRES_IMU of system 1; there are also SCALED_IMU of system 1" in remark
        for remark in source.remarks
    )


def test_a_message_that_comes_seldom_is_not_chosen_for_being_fine():
    often, seldom = scaled(TABLE), highres(TABLE[::30])
    mixed = [m for k, each in enumerate(often) for m in ([seldom[k // 30], each] if k % 30 == 0 else [each])]
    found = samples_of(scripted(mixed))
    assert len(found) == len(TABLE)


def test_the_user_may_choose_message_and_system():
    two = interleaved(highres(TABLE), highres(TABLE[:, [0, 3, 2, 1, 4, 5, 6]], autopilot(2)))
    assert "systems 1, 2 send; pick one, as ?system=1" in refusal(two)
    assert near(samples_of(scripted(two, f"{UDP}?system=1")), TABLE, 1e-6)
    both = interleaved(highres(TABLE), scaled(TABLE, "scaled_imu2"))
    coarse = scripted(both, f"{UDP}?message=SCALED_IMU2")
    assert near(samples_of(coarse), TABLE, 0.51e-3 * STANDARD_GRAVITY)


def test_raw_imu_has_no_known_unit():
    message = refusal(raw(TABLE))
    assert "RAW_IMU does not state its units" in message
    assert "--gyroscope-unit mrad/s" in message
    stated = scripted(raw(TABLE), gyroscope_unit="mrad/s")
    assert near(samples_of(stated), TABLE, 0.51e-3 * STANDARD_GRAVITY)


def test_a_message_that_renews_no_gyroscope_is_no_sample():
    between = TABLE + np.array([0.005, *[1.0] * 6])
    pressure_only = highres(between, updated=0x0E00)
    good = highres(TABLE)
    assert near(samples_of(scripted(interleaved(good, pressure_only))), TABLE, 1e-6)


def test_temperature_is_that_of_the_message_where_it_has_one():
    assert np.allclose(np.concatenate([c.temperature for c in chunks_of(scripted(highres(TABLE)))]), 31.5)
    assert np.allclose(np.concatenate([c.temperature for c in chunks_of(scripted(scaled(TABLE)))]), 21.5)
    without = chunks_of(scripted(scaled(TABLE, temperature=0)))
    assert np.isnan(np.concatenate([chunk.temperature for chunk in without])).all()


def test_a_link_without_imu_is_refused_with_what_to_do():
    assert "none was HIGHRES_IMU" in refusal(heartbeats(600))
    garbage = bytes(np.random.default_rng(3).integers(0, 256, 100_000, dtype=np.uint8))
    assert "check ?baud=" in refusal(pieces_of(garbage, 200))
    assert "none was RAW_IMU" in refusal(highres(np.tile(TABLE, (5, 1))), f"{UDP}?message=RAW_IMU")


def test_possible_correction_by_an_autopilot_is_reported():
    source = scripted(highres(TABLE))
    samples_of(source)
    assert any("calibration of its own" in remark for remark in source.remarks)


def asked(transport):
    """Requests that were sent: system, component, command, message, interval in us."""
    commands = mavlink.MAVLink(None).parse_buffer(b"".join(transport.sent)) or []
    return [
        (each.target_system, each.target_component, each.command, each.param1, each.param2)
        for each in commands
    ]


def answer(result):
    """Answer of an autopilot to a request for a message."""
    command = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
    return mavlink.MAVLink_command_ack_message(command, result).pack(autopilot())


def test_autopilot_gets_one_rate_request_and_a_release_at_the_end():
    pieces = [*heartbeats(2), answer(mavlink.MAV_RESULT_ACCEPTED), *highres(TABLE), *heartbeats(2)]
    transport = Scripted(pieces, whole=True)
    source = over(transport, f"{UDP}?rate=200")
    assert near(samples_of(source), TABLE, 1e-6)
    command, number = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAVLINK_MSG_ID_HIGHRES_IMU
    assert asked(transport) == [(1, 1, command, number, 5000.0), (1, 1, command, number, 0.0)]


def test_nothing_is_sent_to_a_vehicle_unless_a_rate_is_asked_for():
    transport = Scripted([*heartbeats(2), *highres(TABLE)], whole=True)
    samples_of(over(transport, UDP))
    assert transport.sent == []


def test_ground_station_and_other_vehicles_are_not_asked_for_samples():
    other = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    station = mavlink.MAVLink_heartbeat_message(6, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3).pack(other)
    transport = Scripted([station, *heartbeats(1, autopilot(2)), *highres(TABLE)], whole=True)
    samples_of(over(transport, f"{UDP}?rate=200&system=1"))
    assert transport.sent == []


def test_autopilot_that_will_not_send_is_reported_with_a_remedy():
    denied = [*heartbeats(1), answer(mavlink.MAV_RESULT_UNSUPPORTED)]
    message = refusal(denied, f"{UDP}?rate=200&message=SCALED_IMU3")
    assert "the autopilot will not send SCALED_IMU3 at that rate" in message


def test_a_request_reaches_the_autopilot_over_udp():
    port = free_port()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.bind(("127.0.0.1", 0))
        with open_source(f"mavlink:udpin:127.0.0.1:{port}?rate=50") as source:
            vehicle.sendto(heartbeats(1)[0], ("127.0.0.1", port))
            next(iter(source))
            request = mavlink.MAVLink(None).parse_buffer(vehicle.recv(1000))
    assert [each.param2 for each in request] == [20000.0]
