"""Transports of bytes: a serial line, or datagrams; see `streams` for others."""

from __future__ import annotations

import errno
import io
import socket
import struct
import sys
from types import TracebackType
from typing import TYPE_CHECKING, Any, Protocol

from tumble.foundation.errors import LogError
from tumble.foundation.words import count_of
from tumble.live.address import Address
from tumble.logs.optional import imported

if TYPE_CHECKING:
    import serial

LARGEST_DATAGRAM = 1 << 16
COUNT_DROPS = 40 if sys.platform == "linux" else None
"""Option of a socket (`SO_RXQ_OVFL`): each datagram comes with how many were dropped before it."""
_COUNT = struct.Struct("=I")
WAITING_BYTES = 1 << 22
"""Size of the buffer of datagrams that wait to be read: seconds of one IMU."""
REORDER_WINDOW = 0.05
"""s for which datagrams may be overtaken by others unless `?reorder=` states it."""
DEFAULT_BAUD = 115200
GET_PERMISSION = "on Linux join the group that owns it, often dialout"


class Transport(Protocol):
    """Carries bytes while it is entered."""

    @property
    def whole(self) -> bool:
        """Indicates whether every piece holds whole messages, as datagrams do, or arbitrary bytes."""

    @property
    def joined_midway(self) -> bool:
        """Indicates whether the first bytes may be the rest of a line that began before the connection."""

    @property
    def sender(self) -> object:
        """Sender of the bytes received last; None where a line has one sender only."""

    @property
    def unread(self) -> int:
        """Messages that the system dropped because nobody read them in time."""

    @property
    def reorder_window(self) -> float:
        """Time, s, for which messages may be overtaken on the way; 0 where they keep their order."""

    @property
    def notices(self) -> tuple[str, ...]:
        """Notices on received bytes, for the user."""

    def fileno(self) -> int | None:
        """Returns the descriptor to wait on; None where the line has none."""

    def receive(self) -> bytes:
        """Returns what has come, without waiting; empty if nothing has.

        Raises `LogError` where the line is lost.
        """

    def send(self, data: bytes) -> None:
        """Answers whoever sends here; raises `LogError` where the line is lost."""

    def __enter__(self) -> Transport: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class SerialLine:
    """A serial port: eight bits, no parity, one stop bit, no flow control."""

    whole = False
    joined_midway = True
    reorder_window = 0.0
    unread = 0
    sender = None
    notices: tuple[str, ...] = ()

    def __init__(self, address: Address, device: str, baud: int) -> None:
        self._address = address
        self._device = device
        self._baud = baud
        self._port: serial.Serial | None = None

    def __enter__(self) -> SerialLine:
        serial = imported("serial", self._address.text, "live")
        try:
            # Two programs that read one line would each get half of it.
            self._port = serial.Serial(self._device, self._baud, timeout=0.0, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise LogError(f"{self._address.text}: {_cannot_open(self._device, error)}") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._port is not None:
            self._port.close()
            self._port = None

    def fileno(self) -> int | None:
        """Returns the descriptor of the port; Windows has none."""
        assert self._port is not None, "a serial line is waited for while it is open"
        try:
            return int(self._port.fileno())
        except io.UnsupportedOperation:
            return None

    def receive(self) -> bytes:
        """Returns the bytes that have come."""
        assert self._port is not None, "a serial line is read while it is open"
        serial = imported("serial", self._address.text, "live")
        try:
            return bytes(self._port.read(max(1, self._port.in_waiting)))
        except (serial.SerialException, OSError) as error:
            raise self._lost() from error

    def send(self, data: bytes) -> None:
        """Sends bytes to the device."""
        assert self._port is not None, "a serial line is written to while it is open"
        serial = imported("serial", self._address.text, "live")
        try:
            self._port.write(data)
        except (serial.SerialException, OSError) as error:
            raise self._lost() from error

    def _lost(self) -> LogError:
        return LogError(
            f"{self._address.text}: the connection was lost: was the device unplugged or reset? "
            "Plug it in and start again"
        )


class NetworkSocket:
    """Common part of transports over a network: the socket, while they are open."""

    def __init__(self) -> None:
        self._opened: socket.socket | None = None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._opened is not None:
            self._opened.close()
            self._opened = None

    def fileno(self) -> int:
        """Returns the descriptor of the socket."""
        return self._socket.fileno()

    @property
    def _socket(self) -> socket.socket:
        assert self._opened is not None, "a socket is used while it is open"
        return self._opened


class DatagramSocket(NetworkSocket):
    """A UDP port that a device sends to: the first host from which anything comes."""

    whole = True
    joined_midway = False

    def __init__(self, address: Address, host: str, port: int) -> None:
        super().__init__()
        self._address = address
        self._host = host
        self._port = port
        self._sender: tuple[Any, ...] | None = None
        """Address of the first that sent anything, its host first."""
        self.sender: object = None
        """Address of the one that sent last."""
        self.unread = 0
        """See `Transport`."""
        self._wanted = address.settings.get("from")
        self._hosts: frozenset[str] = frozenset()
        """Numbers of the only host that counts; empty where it is the first that sends."""
        self._from_others = 0
        self.reorder_window = address.number("reorder", REORDER_WINDOW, least=0.0)
        """See `Transport`."""

    @property
    def notices(self) -> tuple[str, ...]:
        """Reports other senders: alternating samples of two devices are those of none."""
        sender = self._wanted or (self._sender and self._sender[0])
        others = f"left out {count_of('datagram', self._from_others)} not from {sender}"
        unread = f"{count_of('datagram', self.unread)} dropped unread: this computer was too slow"
        return (*((others,) if self._from_others else ()), *((unread,) if self.unread else ()))

    def __enter__(self) -> DatagramSocket:
        self._hosts = self._numbers_of(self._wanted) if self._wanted is not None else frozenset()
        try:
            family, kind, protocol, _, place = socket.getaddrinfo(
                self._host, self._port, type=socket.SOCK_DGRAM, flags=socket.AI_PASSIVE
            )[0]
            self._opened = socket.socket(family, kind, protocol)
            self._socket.setblocking(False)
            # The system may grant less; datagrams wait in this buffer while others are read.
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, WAITING_BYTES)
            if COUNT_DROPS is not None:
                self._socket.setsockopt(socket.SOL_SOCKET, COUNT_DROPS, 1)
            self._socket.bind(place)
        except OSError as error:
            self.__exit__(None, None, None)
            raise LogError(
                f"{self._address.text}: cannot listen there: {error.strerror or error}; is another program "
                "listening? Give an address of this machine, or 0.0.0.0 for all of them, and a free port"
            ) from error
        return self

    def _numbers_of(self, host: str) -> frozenset[str]:
        try:
            found = socket.getaddrinfo(host, None, type=socket.SOCK_DGRAM)
        except (OSError, UnicodeError) as error:
            raise LogError(
                f"{self._address.text}: no host {host!r} to listen to; give its address"
            ) from error
        return frozenset(str(place[0]) for *_, place in found)

    def receive(self) -> bytes:
        """Returns the next datagram that has come."""
        try:
            datagram, sender = self._receive()
        except BlockingIOError:
            return b""
        if self._sender is None and (not self._hosts or sender[0] in self._hosts):
            self._sender = sender
        if self._sender is None or sender[0] != self._sender[0]:
            self._from_others += 1
            return b""
        self.sender = sender
        return datagram

    def _receive(self) -> tuple[bytes, tuple[Any, ...]]:
        if COUNT_DROPS is None:
            return self._socket.recvfrom(LARGEST_DATAGRAM)
        datagram, notes, _, sender = self._socket.recvmsg(LARGEST_DATAGRAM, socket.CMSG_SPACE(_COUNT.size))
        for level, kind, content in notes:
            if (level, kind) == (socket.SOL_SOCKET, COUNT_DROPS):
                (self.unread,) = _COUNT.unpack(content[: _COUNT.size])
        return datagram, sender

    def send(self, data: bytes) -> None:
        """Sends a datagram to where the first one came from; before that there is nobody to send to."""
        if self._sender is None:
            return
        try:
            self._socket.sendto(data, self._sender)
        except OSError as error:
            raise LogError(
                f"{self._address.text}: cannot send to {self._sender[0]}: {error.strerror or error}; "
                "check the network"
            ) from error


def _cannot_open(device: str, error: Exception) -> str:
    if isinstance(error, ValueError):
        return f"{device} cannot be opened: {error}; check the baud rate"
    remedies = {
        errno.ENOENT: "there is no such device; is it plugged in?",
        errno.EACCES: f"no permission to read it; {GET_PERMISSION}",
        errno.EAGAIN: "another program uses it; close that first",
        errno.EBUSY: "another program uses it; close that first",
    }
    remedy = remedies.get(getattr(error, "errno", None) or 0, f"{error}; is it a serial port?")
    return f"{device} cannot be opened: {remedy}"
