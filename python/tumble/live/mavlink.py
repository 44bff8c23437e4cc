"""MAVLink: what autopilots send, over UDP, TCP or a serial line, read by pymavlink."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

from tumble.foundation.errors import LogError
from tumble.foundation.numbers import whole_number
from tumble.live.address import Address, host_and_port
from tumble.live.mavlink_request import MessageRequest
from tumble.live.readings import Readings, StreamFacts
from tumble.live.shared_line import LineUnit, SharedLine
from tumble.live.source import Source
from tumble.live.streams import TcpConnection
from tumble.live.transport import DEFAULT_BAUD, DatagramSocket, SerialLine, Transport
from tumble.logs.mavlink_messages import (
    DIALECT,
    KINDS,
    MavlinkMessage,
    coarseness,
    holds_both_triads,
    magnetic_of,
    samples_of,
)
from tumble.logs.optional import imported
from tumble.logs.options import ReadOptions
from tumble.logs.track import DEFINED, StatedUnit

CHOICE_MESSAGES = 20
"""Messages of one kind to hear before choosing among those that come about as often."""
MOST_WITHOUT_IMU = 500
"""Messages, or pieces that are none, beyond which no IMU is to be expected."""


@dataclass(frozen=True, slots=True, order=True)
class _Sender:
    """One IMU among all that a link carries."""

    message: str
    system: int
    component: int
    sensor: int

    @property
    def unit(self) -> str:
        """Unit by which the user selects it: `HIGHRES_IMU.1`."""
        return f"{self.message}.{self.sensor}" if self.sensor else self.message

    @property
    def words(self) -> str:
        return f"{self.unit} of system {self.system}"


def mavlink_line(address: Address, options: ReadOptions) -> MavlinkLine:
    """Creates the line of `mavlink:udpin:HOST:PORT`, `mavlink:tcp:HOST:PORT` or `mavlink:DEVICE?baud=115200`.

    `system=1` picks one of several vehicles; `rate=100` asks for so many messages a second.
    """
    link, _, place = address.place.partition(":")
    if link == "tcp":
        address.refuse_other_settings("message", "system", "rate")
        host, port = host_and_port(address, place)
        return MavlinkLine(address, TcpConnection(address, host, port), f"mavlink-{port}")
    if link in ("udpin", "udp"):
        address.refuse_other_settings("message", "system", "rate", "from", "reorder")
        host, port = host_and_port(address, place)
        return MavlinkLine(address, DatagramSocket(address, host, port), f"mavlink-{port}")
    address.refuse_other_settings("baud", "message", "system", "rate")
    line = SerialLine(address, address.place, int(address.number("baud", DEFAULT_BAUD)))
    return MavlinkLine(address, line, PurePath(address.place).name)


class MavlinkLine(SharedLine[MavlinkMessage]):
    """A line that carries MAVLink."""

    def __init__(self, address: Address, transport: Transport, name: str) -> None:
        super().__init__(address, transport, name)
        self.system = int(address.number("system", 0.5))
        """Number of the vehicle; 0 for any."""
        self._parser: Any = None
        self._rate = address.number("rate", math.nan)
        self._requests: dict[str, MessageRequest] = {}
        """Requests by message."""

    def unit(self, address: Address, options: ReadOptions) -> MavlinkUnit:
        """See `SharedLine`."""
        return MavlinkUnit(self, address, options)

    def _open(self) -> None:
        self._parser = imported(DIALECT, self.address.text, "live").MAVLink(None)
        self._parser.robust_parsing = True
        super()._open()

    def request(self, message: str) -> None:
        """Asks for a message at the rate that is stated, if one is."""
        if not math.isnan(self._rate):
            dialect = imported(DIALECT, self.address.text, "live")
            request = MessageRequest(self.address, dialect, message, self.system, self._rate)
            self._requests.setdefault(message, request)

    def _close(self) -> None:
        # A line that was lost cannot carry a request either.
        with suppress(LogError):
            for request in self._requests.values():
                request.restore_rate(self.transport)
        super()._close()
        asked, self._requests = self._requests, {}
        for message in asked:
            self.request(message)

    def _parts(self, piece: bytes) -> Sequence[MavlinkMessage]:
        messages: Sequence[MavlinkMessage] = self._parser.parse_buffer(piece) or ()
        for message in messages:
            for request in self._requests.values():
                request.handle(message, self.transport)
        return messages


class MavlinkUnit(LineUnit[MavlinkMessage]):
    """One of the IMUs of which a system sends messages."""

    def __init__(self, line: MavlinkLine, address: Address, options: ReadOptions) -> None:
        super().__init__(line, address, options)
        self._address = address
        self._options = options
        self._system = line.system
        self._wanted, self._sensor = _message_and_sensor(address, self.wanted)
        self._heard: dict[_Sender, list[MavlinkMessage]] = {}
        self._chosen: _Sender | None = None
        self._others = 0
        line.request(self._wanted or next(iter(KINDS)))

    def follow(self, previous: Source) -> None:
        """See `ConditionedSource`: the message stays the same, as another has other units."""
        super().follow(previous)
        if isinstance(previous, MavlinkUnit):
            self._chosen, self._heard = previous._chosen, previous._heard

    def _readings(self, parts: Sequence[MavlinkMessage]) -> tuple[Readings, StreamFacts] | None:
        messages = self._mine(parts)
        if not messages or self._chosen is None:
            return None
        kind = KINDS[self._chosen.message]
        field = None if kind.magnetometer_unit is None else magnetic_of(messages, kind).field
        return Readings(samples_of(messages, kind), magnetic=field), self._facts(self._chosen)

    @property
    def _keeps(self) -> bool:
        """See `LineUnit`."""
        return self._chosen is None and bool(self._heard)

    def _concerns(self, part: MavlinkMessage) -> bool:
        """See `LineUnit`."""
        return self._sender(part) is not None

    def _mine(self, messages: Sequence[MavlinkMessage]) -> list[MavlinkMessage]:
        """Returns the messages of the chosen sender; keeps them back until there is one."""
        mine = []
        for message in messages:
            sender = self._sender(message)
            if sender is None:
                self._count_other()
            elif self._chosen is None:
                self._heard.setdefault(sender, []).append(message)
                mine += self._choose() if len(self._heard[sender]) >= CHOICE_MESSAGES else []
            elif sender == self._chosen:
                mine.append(message)
        return mine

    def _sender(self, message: MavlinkMessage) -> _Sender | None:
        """Returns the sender of a message; None where it holds no requested IMU sample."""
        name = message.get_type()
        if name not in KINDS or self._wanted not in (None, name):
            return None
        system = message.get_srcSystem()
        if self._system not in (0, system) or not holds_both_triads(message, name):
            return None
        # A message without a field of that name has its own number there.
        sensor = message.id if "id" in message.fieldnames else 0
        if self._sensor not in (None, sensor):
            return None
        return _Sender(name, system, message.get_srcComponent(), sensor)

    def _choose(self) -> list[MavlinkMessage]:
        """Chooses, of those that come about as often, the message with the most fields."""
        often = [sender for sender, heard in self._heard.items() if 2 * len(heard) >= CHOICE_MESSAGES]
        # A corrupted message may have any number.
        systems = sorted({sender.system for sender in often})
        if len(systems) > 1:
            listed = ", ".join(map(str, systems))
            raise LogError(f"{self._address.text}: systems {listed} send; pick one, as ?system={systems[0]}")
        self._chosen = min(often, key=lambda sender: (list(KINDS).index(sender.message), sender))
        self._refuse_unknown_unit(self._chosen)
        return self._heard[self._chosen]

    def _refuse_unknown_unit(self, chosen: _Sender) -> None:
        stated = self._options.gyroscope_unit is not None or self._options.gyroscope_scale is not None
        if KINDS[chosen.message].gyroscope_unit is None and not stated:
            raise LogError(
                f"{self._address.text}: {chosen.message} does not state its units; with ArduPilot give "
                "--gyroscope-unit mrad/s, else --gyroscope-scale (counts per unit) and --gyroscope-unit"
            )

    def _count_other(self) -> None:
        if self._chosen is not None:
            return
        self._others += 1
        if self._others >= MOST_WITHOUT_IMU and not self._heard:
            wanted = self._wanted or ", ".join(KINDS)
            raise LogError(
                f"{self._address.text}: {MOST_WITHOUT_IMU} messages came and none was {wanted}; have the "
                "autopilot send it (MAV_CMD_SET_MESSAGE_INTERVAL), and check ?baud=, ?system= and ?message="
            )

    def _facts(self, chosen: _Sender) -> StreamFacts:
        kind = KINDS[chosen.message]
        others = sorted(sender.words for sender in self._heard if sender != chosen)
        beside = f"; there are also {', '.join(others)}" if others else ""
        notices = [
            f"reads {chosen.words}{beside}",
            "an autopilot may correct what it sends with a calibration of its own; this one holds on top "
            "of it",
        ]
        notices += coarseness(chosen.message)
        return StreamFacts(
            self._address.text,
            True,
            _stated(kind.accelerometer_unit),
            _stated(kind.gyroscope_unit),
            _stated(kind.time_unit),
            _stated("degC"),
            _stated(kind.magnetometer_unit),
            notices=tuple(notices),
        )


def _message_and_sensor(address: Address, unit: str | None) -> tuple[str | None, int | None]:
    """Reads `HIGHRES_IMU.1`: a message, and which of the sensors it may be from; None for any."""
    stated = address.settings.get("message")
    if stated is not None and stated not in KINDS:
        raise LogError(f"{address.text}: message={stated}: give one of {', '.join(KINDS)}")
    if unit is None:
        return stated, None
    message, dot, digits = unit.partition(".")
    number = whole_number(digits)
    if message not in KINDS or stated not in (None, message) or (dot and number is None):
        raise LogError(
            f"{address.text}: no unit {unit!r}; give one of {', '.join(KINDS)}, or HIGHRES_IMU.1 for the "
            "sensor of that number"
        )
    return message, number


def _stated(unit: str | None) -> StatedUnit | None:
    return None if unit is None else StatedUnit(unit, DEFINED)
