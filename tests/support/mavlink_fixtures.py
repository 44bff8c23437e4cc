"""Messages as autopilots send them, and a source that reads them."""

from __future__ import annotations

from pymavlink.dialects.v20 import common as mavlink

from live_fixtures import Scripted
from tumble.live import parse_address
from tumble.live.mavlink import MavlinkLine
from tumble.logs import ReadOptions

UDP = "mavlink:udpin:127.0.0.1:14555"


def autopilot(system=1, component=1):
    """A sender of messages."""
    return mavlink.MAVLink(None, srcSystem=system, srcComponent=component)


def highres(table, sender=None, updated=0xFFFF, sensor=0):
    """HIGHRES_IMU, a message a sample."""
    sender = sender or autopilot()
    return [
        mavlink.MAVLink_highres_imu_message(
            round(1e6 * row[0]), *row[1:], 0, 0, 0, 1013.0, 0, 0, 31.5, updated, sensor
        ).pack(sender)
        for row in table
    ]


def scripted(pieces, text=UDP, **options):
    """A MAVLink source that reads these pieces."""
    return over(Scripted(pieces, whole=True), text, **options)


def over(transport, text=UDP, **options):
    """A MAVLink source that reads this transport."""
    address = parse_address(text)
    return MavlinkLine(address, transport, "test").unit(address, ReadOptions(**options))


def scaled(count, sender, message="scaled_imu", **fields):
    """SCALED_IMU at 50 Hz, a message a sample, with 1000 mg along z."""
    make = getattr(mavlink, f"MAVLink_{message}_message")
    per_second = 1_000_000 if message == "raw_imu" else 1000
    values = {"xacc": 3, "yacc": -7, "zacc": -1000, "xgyro": 4, "ygyro": -5, "zgyro": 6} | fields
    return [
        make(round(per_second * (5.0 + 0.02 * at)), *values.values(), 0, 0, 0).pack(sender)
        for at in range(count)
    ]


def tlog_of(packets, start=1_700_000_000.0, interval=0.02):
    """A telemetry log: each message behind the time of its arrival, us, as a big number."""
    return b"".join(
        round(1e6 * (start + interval * at)).to_bytes(8, "big") + bytes(packet)
        for at, packet in enumerate(packets)
    )
