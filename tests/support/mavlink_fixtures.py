"""Messages as autopilots send them, and a source that reads them."""

from __future__ import annotations

from pymavlink.dialects.v20 import common as mavlink

from live_fixtures import Scripted
from tumble.live import parse_address
from tumble.live.mavlink import MavlinkLine
from tumble.logs import ReadOptions

UDP = "mavlink:udpin:127.0.0.1:14555"


def autopilot(system=1):
    """A sender of messages."""
    return mavlink.MAVLink(None, srcSystem=system, srcComponent=1)


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
