"""Telemetry logs: MAVLink messages that a ground station received, each behind the time of its arrival.

Samples keep the time that the autopilot gave them. pymavlink decodes those messages that hold IMU samples.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.files import once_per_file
from tumble.foundation.recording import FloatArray
from tumble.foundation.regular_files import open_regular
from tumble.foundation.units import Triad
from tumble.logs.flight import FlightImu, FlightMagnetometer, Times, list_of, open_flight_imu
from tumble.logs.mavlink_messages import (
    DIALECT,
    KINDS,
    SCALED,
    Kind,
    MavlinkMessage,
    coarseness,
    holds_both_triads,
    holds_field,
    magnetic_of,
    samples_of,
)
from tumble.logs.optional import imported
from tumble.logs.options import ReadOptions
from tumble.logs.track import LoggedImu, RawMagnetic, RawSamples
from tumble.logs.units import UNITS
from tumble.logs.walk import Damage, walk

SOUGHT = f"messages {', '.join(KINDS)}, RAW_IMU of ArduPilot only"
ARRIVAL = 8
"""Bytes of the time before each message."""
VERSION_1, VERSION_2 = 0xFE, 0xFD
"""First byte of a message."""
ARDUPILOT = 3
"""MAV_AUTOPILOT_ARDUPILOTMEGA."""
HEARTBEAT = "HEARTBEAT"
FINE = "HIGHRES_IMU"
_EARLIEST, _LATEST = 0x0003, 0x0010
"""First two bytes of times of arrival from 1996 to 2112."""
_HEAD_1, _HEAD_2 = 6, 10
"""Bytes before the contents of a message."""
_SENSORS = {105: 62, 27: 26}
"""Places of the number of the sensor in HIGHRES_IMU and RAW_IMU."""
_SIGNED = 0x01
_SIGNATURE = 13
_BLOCK = 1 << 16
"""Bytes read at a time: decoding them takes as long as other formats take for far more."""
_MAGIC = re.compile(b"[\xfd\xfe]")


@dataclass(frozen=True, slots=True, order=True)
class _Sender:
    """One IMU among those that a link carries."""

    message: str
    system: int
    component: int
    sensor: int


@dataclass(slots=True)
class _Scan:
    """Result of one pass over the whole log."""

    senders: dict[_Sender, Times] = field(default_factory=dict)
    ardupilots: set[int] = field(default_factory=set)
    """Systems that report to be ArduPilot."""
    remarks: tuple[str, ...] = ()


def recognises(path: Path, head: bytes) -> bool:
    """Returns whether a file begins with a time of arrival, and a message behind it, and the same again."""
    first = _length(head, 0)
    if not first or not _EARLIEST <= int.from_bytes(head[:2], "big") <= _LATEST:
        return False
    return len(head) < first + ARRIVAL + 2 or (
        head[first : first + 2] == head[:2] and bool(_length(head, first))
    )


def _length(data: bytes, at: int) -> int:
    """Returns the bytes of the message that begins there, its time among them; 0 where none does."""
    if at + ARRIVAL + 3 > len(data):
        return 0
    magic, size = data[at + ARRIVAL], data[at + ARRIVAL + 1]
    if magic == VERSION_1:
        return ARRIVAL + 8 + size
    if magic == VERSION_2:
        return ARRIVAL + 12 + size + (_SIGNATURE if data[at + ARRIVAL + 2] & _SIGNED else 0)
    return 0


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the names of all IMUs: messages, with the number of the sensor and of the vehicle if needed."""
    return list_of(path, _imus(path), SOUGHT)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds an IMU; raises `LogError` where there is no such one, or several and none is named."""
    imus = _imus(path)
    list_of(path, imus, SOUGHT)
    clock = f"{path.resolve()}#time of the autopilot"
    return open_flight_imu(path, imus, imu, options, "tlog", clock, _magnetometers(path, imus, imu))


def _imus(path: Path) -> list[FlightImu]:
    scan = _scanned(path)
    names = _names(scan)
    order = list(KINDS)
    return [
        FlightImu(
            name=names[sender],
            form="fine" if sender.message == FINE else "coarse",
            rate=times.rate,
            count=times.count,
            read=partial(_read, path, sender, _kind(sender, scan)),
            already_corrected=True,
            corrections=partial(_refuse, path),
            notices=(*coarseness(sender.message), *scan.remarks),
        )
        for sender, times in sorted(
            scan.senders.items(), key=lambda item: (order.index(item[0].message), item[0])
        )
        if _kind(sender, scan).accelerometer_unit is not None
    ]


def _magnetometers(path: Path, imus: Sequence[FlightImu], wanted: str | None) -> list[FlightMagnetometer]:
    """Returns the magnetometers, which have the names of their IMUs; the first is that of the wanted one."""
    scan = _scanned(path)
    found = {name: sender for sender, name in _names(scan).items()}
    names = sorted(
        (each.name for each in imus), key=lambda name: name.casefold() != (wanted or "").casefold()
    )
    return [
        FlightMagnetometer(
            name,
            unit,
            partial(_read_magnetic, path, found[name], _kind(found[name], scan)),
            already_corrected=True,
            notices=("the magnetometer of telemetry was corrected by the autopilot",),
            row_wise=True,
        )
        for name in names
        if (unit := _kind(found[name], scan).magnetometer_unit)
    ]


def _read_magnetic(path: Path, sender: _Sender, kind: Kind) -> RawMagnetic:
    mine = [
        each
        for messages in _messages(path, Damage(), (sender.message,))
        for each in messages
        if _sender(each) == sender and holds_field(each, sender.message)
    ]
    raw = magnetic_of(mine, kind)
    assert raw.time is not None
    return RawMagnetic(raw.time / round(1.0 / UNITS["time"][kind.time_unit]), raw.field)


def _names(scan: _Scan) -> dict[_Sender, str]:
    """Returns names, with the system where there are several, and the component where a system has several.

    A component without an IMU is no other: a ground station, a gimbal.
    """
    several = len({sender.system for sender in scan.senders}) > 1
    components: dict[int, set[int]] = {}
    for sender in scan.senders:
        components.setdefault(sender.system, set()).add(sender.component)
    return {
        sender: ".".join(
            [
                sender.message,
                *([str(sender.sensor)] if sender.sensor else []),
                *([f"system{sender.system}"] if several else []),
                *([f"component{sender.component}"] if len(components[sender.system]) > 1 else []),
            ]
        )
        for sender in scan.senders
    }


def _kind(sender: _Sender, scan: _Scan) -> Kind:
    """Returns units; those of RAW_IMU are known of ArduPilot."""
    kind = KINDS[sender.message]
    if kind.accelerometer_unit is None and sender.system in scan.ardupilots:
        return replace(SCALED, time=kind.time, time_unit=kind.time_unit)
    return kind


def _refuse(path: Path) -> dict[Triad, Any]:
    raise LogError(
        f"{path}: --undo-correction: telemetry holds too little of what was done to its samples; give the "
        "log that the autopilot itself wrote (.ulg, .bin)"
    )


@once_per_file
def _scanned(path: Path) -> _Scan:
    scan, damage = _Scan(), Damage()
    dialect = _dialect(path)
    known: dict[tuple[int, int, int, int], _Sender] = {}
    """Senders by the bytes of a message, once one of that kind was decoded."""
    for packets in _packets(path, dialect, damage, (*KINDS, HEARTBEAT)):
        for packet in packets:
            key = _key(packet.content)
            if key not in known:
                for message in _decoded(dialect, [packet], damage):
                    if message.get_type() == HEARTBEAT:
                        scan.ardupilots |= (
                            {message.get_srcSystem()} if message.autopilot == ARDUPILOT else set()
                        )
                    else:
                        known[key] = _sender(message)
            if key in known:
                _note(scan, known[key], packet.content)
    scan.remarks = damage.notices()
    return scan


def _key(packet: bytes) -> tuple[int, int, int, int]:
    """Returns number, system, component and sensor of a message that is not decoded."""
    number = _number(packet, 0)
    head = _HEAD_1 if packet[0] == VERSION_1 else _HEAD_2
    last = _SENSORS.get(number, 0)
    sensor = packet[head + last] if last and last < packet[1] else 0
    system = 3 if packet[0] == VERSION_1 else 5
    return number, packet[system], packet[system + 1], sensor


def _note(scan: _Scan, sender: _Sender, packet: bytes) -> None:
    kind = KINDS[sender.message]
    head = _HEAD_1 if packet[0] == VERSION_1 else _HEAD_2
    size = 8 if kind.time_unit == "us" else 4
    # MAVLink 2 leaves out zeros at the end of a message.
    stamp = packet[head : min(head + size, head + packet[1])]
    now = int.from_bytes(stamp, "little") * UNITS["time"][kind.time_unit]
    scan.senders.setdefault(sender, Times()).note(now, now, 1)


def _sender(message: MavlinkMessage) -> _Sender:
    # A message without a field of that name has its own number there.
    sensor = message.id if "id" in message.fieldnames else 0
    return _Sender(message.get_type(), message.get_srcSystem(), message.get_srcComponent(), sensor)


def _read(path: Path, sender: _Sender, kind: Kind) -> Iterator[RawSamples]:
    for messages in _messages(path, Damage(), (sender.message,)):
        mine = [
            each for each in messages if _sender(each) == sender and holds_both_triads(each, sender.message)
        ]
        if mine:
            samples = _in_si(samples_of(mine, kind), kind)
            samples.received = np.array([each._timestamp for each in mine])
            yield samples


def _in_si(samples: RawSamples, kind: Kind) -> RawSamples:
    assert samples.time is not None
    samples.time = samples.time / round(1.0 / UNITS["time"][kind.time_unit])
    samples.accelerometer = _scaled(samples.accelerometer, "accelerometer", kind.accelerometer_unit)
    samples.gyroscope = _scaled(samples.gyroscope, "gyroscope", kind.gyroscope_unit)
    if samples.temperature is not None and np.isnan(samples.temperature).all():
        samples.temperature = None
    return samples


def _scaled(readings: FloatArray, triad: Triad, unit: str | None) -> FloatArray:
    assert unit is not None
    return readings * UNITS[triad][unit]


def _messages(path: Path, damage: Damage, names: Sequence[str]) -> Iterator[list[MavlinkMessage]]:
    """Returns the decoded messages of these names, those of about a megabyte of file at a time."""
    dialect = _dialect(path)
    for packets in _packets(path, dialect, damage, names):
        yield list(_decoded(dialect, packets, damage))


def _dialect(path: Path) -> Any:  # noqa: ANN401 - pymavlink has no types
    return imported(DIALECT, path, "formats")


class _Packet(NamedTuple):
    """A message as it stands in the file."""

    arrival: float
    """s since 1970, by the clock of the ground station."""
    content: bytes


def _packets(path: Path, dialect: Any, damage: Damage, names: Sequence[str]) -> Iterator[list[_Packet]]:  # noqa: ANN401
    """Returns the messages of these names as they stand in the file."""
    numbers = frozenset(getattr(dialect, f"MAVLINK_MSG_ID_{name}") for name in names)
    packets = _Packets(numbers, damage)
    with open_regular(path) as file:
        for _ in walk(file, 0, path.stat().st_size, packets.take, damage, _BLOCK):
            yield packets.found
            packets.found = []


def _decoded(dialect: Any, packets: Sequence[_Packet], damage: Damage) -> Iterator[MavlinkMessage]:  # noqa: ANN401
    decoder = dialect.MAVLink(None)
    for packet in packets:
        try:
            message = decoder.decode(bytearray(packet.content))
        except Exception:  # pymavlink lets through whatever its unpacking raises
            damage.messages += 1
            continue
        message._timestamp = packet.arrival
        yield message


@dataclass(slots=True)
class _Packets:
    """Messages of some numbers, not decoded."""

    numbers: frozenset[int]
    damage: Damage
    found: list[_Packet] = field(default_factory=list)
    _time: bytes = b""
    """First bytes of times of arrival, which stay the same for years."""

    def take(self, data: bytes, position: int, whole: bool) -> int:
        """Splits off complete messages; returns their number of bytes."""
        at, length = 0, len(data)
        self._time = self._time or data[:2]
        while at + ARRIVAL + 3 <= length:
            size = _length(data, at) if data[at : at + 2] == self._time else 0
            if not size:
                end = self._next(data, at)
                self.damage.add(position + at, end - at)
                at = end
                continue
            if at + size > length:
                break
            if _number(data, at + ARRIVAL) in self.numbers:
                arrival = int.from_bytes(data[at : at + ARRIVAL], "big") * UNITS["time"]["us"]
                self.found.append(_Packet(arrival, data[at + ARRIVAL : at + size]))
            at += size
        return at

    def _next(self, data: bytes, at: int) -> int:
        """Finds where the next message may begin."""
        found = _MAGIC.search(data, at + ARRIVAL + 1)
        return found.start() - ARRIVAL if found else max(at + 1, len(data) - ARRIVAL - 2)


def _number(data: bytes, at: int) -> int:
    if data[at] == VERSION_1:
        return data[at + 5] if at + 5 < len(data) else -1
    return int.from_bytes(data[at + 7 : at + 10], "little")
