"""Where samples leave the bench: a UDP port, a serial line, a TCP port, or MAVLink."""

from __future__ import annotations

import errno
import math
import os
import select
import socket
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any

import numpy as np

from tumble.foundation import clock
from tumble.foundation.files import link, remove_link
from tumble.logs.mavlink_messages import DIALECT
from tumble.logs.optional import imported
from tumble.tools.simulate.live.ports import free_port
from tumble.tools.simulate.live.samples import Samples
from tumble.tools.simulate.scenario import ScenarioError

COLUMNS = ("time_us", *(f"a{axis}_mps2" for axis in "xyz"), *(f"g{axis}_radps" for axis in "xyz"))
"""Columns of a sample; names state their units."""
_JSON = "{" + ", ".join(f'"{name}": {"%d" if name == "time_us" else "%.9g"}' for name in COLUMNS) + "}\n"
_ROW = ",".join("%d" if name == "time_us" else "%.9g" for name in COLUMNS) + "\n"
HEADER = ",".join(COLUMNS) + "\n"
ALL_CHANNELS = 0b111111
"""Bits of HIGHRES_IMU that mark its measured fields: accelerometer and gyroscope."""


class Outlet(ABC):
    """Carries samples of one unit."""

    lost = 0
    """Samples that nobody took: the line was full."""

    @property
    @abstractmethod
    def address(self) -> str:
        """Address from which a program reads, for `--live`."""

    @abstractmethod
    def send(self, samples: Samples, garble: np.random.Generator | None, share: float) -> None:
        """Sends samples; with `garble`, that share of their bytes is damaged on the way."""

    @abstractmethod
    def is_heard(self) -> bool:
        """Indicates whether a client listens, as far as that can be known."""

    @abstractmethod
    def plug(self) -> None:
        """Plugs the unit in, or in again."""

    @abstractmethod
    def unplug(self) -> None:
        """Disconnects the line."""


def texts(samples: Samples, form: str) -> list[str]:
    """Writes samples, one text each."""
    stamps = np.round(1e6 * samples.time).tolist()
    values = np.hstack([samples.accelerometer, samples.gyroscope]).tolist()
    return [form % (int(stamp), *row) for stamp, row in zip(stamps, values, strict=True)]


def damaged(data: bytes, garble: np.random.Generator | None, share: float) -> bytes:
    """Replaces a share of the bytes by others."""
    if garble is None:
        return data
    taken = np.frombuffer(data, dtype=np.uint8)
    hit = garble.random(len(taken)) < share
    return np.where(hit, garble.integers(0, 256, len(taken), dtype=np.uint8), taken).tobytes()


class UdpOutlet(Outlet):
    """A datagram of JSON a sample."""

    def __init__(self, host: str, port: int) -> None:
        self._place = (host, port or free_port(host))
        self._socket: socket.socket | None = None
        self._probe: socket.socket | None = None
        """Asks whether somebody listens, while that is asked."""
        self.plug()

    @property
    def address(self) -> str:
        """See `Outlet`."""
        return f"udp://{self._place[0]}:{self._place[1]}"

    def plug(self) -> None:
        """See `Outlet`."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def is_heard(self) -> bool:
        """Returns whether an empty datagram was not refused since the last call, as a closed port does."""
        if self._probe is None:
            self._probe = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        elif self._probe.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) == 0:
            self._probe.close()
            self._probe = None
            return True
        try:
            self._probe.connect(self._place)
            self._probe.send(b"")
        except OSError:
            # Nobody is there, which is what was asked.
            self._probe.close()
            self._probe = None
        return False

    def unplug(self) -> None:
        """See `Outlet`."""
        for each in (self._socket, self._probe):
            if each is not None:
                each.close()
        self._socket = self._probe = None

    def send(self, samples: Samples, garble: np.random.Generator | None, share: float) -> None:
        """See `Outlet`."""
        if self._socket is None:
            return
        for text in texts(samples, _JSON):
            self._datagram(damaged(text.encode(), garble, share))

    def _datagram(self, data: bytes) -> None:
        assert self._socket is not None, "a datagram is sent while the unit is plugged in"
        try:
            self._socket.sendto(data, self._place)
        except OSError:
            self.lost += 1


class MavlinkOutlet(UdpOutlet):
    """HIGHRES_IMU, each unit by its id, all to one port."""

    def __init__(self, host: str, port: int, number: int) -> None:
        dialect = imported(DIALECT, "--transport mavlink", "live")
        self._link: Any = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        self._dialect = dialect
        self._number = number
        super().__init__(host, port)

    @property
    def address(self) -> str:
        """See `Outlet`."""
        return f"mavlink:udpin:{self._place[0]}:{self._place[1]}:HIGHRES_IMU.{self._number}"

    def send(self, samples: Samples, garble: np.random.Generator | None, share: float) -> None:
        """See `Outlet`."""
        if self._socket is None:
            return
        nothing = (0.0,) * 7
        values = np.hstack([samples.accelerometer, samples.gyroscope]).tolist()
        for stamp, row in zip(np.round(1e6 * samples.time).tolist(), values, strict=True):
            message = self._dialect.MAVLink_highres_imu_message(
                max(0, int(stamp)), *row, *nothing, ALL_CHANNELS, self._number
            )
            self._datagram(damaged(message.pack(self._link), garble, share))


class _LineOutlet(Outlet):
    """Lines of text to whoever opens the line: names of columns first, then a sample a line."""

    def send(self, samples: Samples, garble: np.random.Generator | None, share: float) -> None:
        """See `Outlet`."""
        if not self._is_read():
            return
        for text in texts(samples, _ROW):
            self._put(damaged(text.encode(), garble, share))

    def is_heard(self) -> bool:
        """See `Outlet`."""
        return self._is_read()

    @abstractmethod
    def _is_read(self) -> bool:
        """Indicates whether a client has the line open; sends a new one the names of the columns."""

    @abstractmethod
    def _write(self, data: bytes) -> int:
        """Writes what can be written without waiting."""

    def _put(self, line: bytes) -> None:
        """Writes a whole line, or none where the line is full."""
        rest = self._rest + line
        if len(self._rest) > 0 and len(rest) > _LONGEST_REST:
            self.lost += 1
            return
        try:
            self._rest = rest[self._write(rest) :]
        except BlockingIOError:
            self._rest = rest
        except OSError:
            self._rest = b""

    _rest = b""
    """Bytes that the line has not accepted yet."""


BOOT = 0.2
"""s after a serial line was opened until a device speaks: programs throw away what came by then."""
_LONGEST_REST = 4096
"""Bytes kept for a line that is full, as the memory of a small device."""


class PtyOutlet(_LineOutlet):
    """A serial line: the link `path` leads to a pseudo-terminal, anew after every plugging in."""

    def __init__(self, path: Path) -> None:
        try:
            import pty
        except ImportError as error:
            raise ScenarioError(
                "--transport pty: this system has no pseudo-terminals; give another"
            ) from error
        self._pty = pty
        self._path = path
        self._device: int | None = None
        self._opened = math.inf
        """s of `clock.now()` at which somebody opened it."""
        self._is_named = False
        """Indicates whether the client that has it open received the names of the columns."""
        self.plug()

    @property
    def address(self) -> str:
        """See `Outlet`."""
        return f"serial:{self._path}"

    def plug(self) -> None:
        """See `Outlet`."""
        import tty

        self._device, line = self._pty.openpty()
        tty.setraw(line)
        os.set_blocking(self._device, False)
        self._line = os.ttyname(line)
        link(self._path, self._line)
        # Once it was open and is no more, the device can detect whether somebody has it open.
        os.close(line)
        self._opened, self._is_named = math.inf, False

    def unplug(self) -> None:
        """See `Outlet`."""
        if self._device is not None:
            remove_link(self._path, self._line)
            os.close(self._device)
            self._device = None

    def _is_read(self) -> bool:
        if self._device is None:
            return False
        poll = select.poll()
        poll.register(self._device, select.POLLHUP)
        is_open = not any(event & select.POLLHUP for _, event in poll.poll(0))
        if not is_open:
            self._opened = math.inf
            self._is_named = False
            return False
        self._opened = min(self._opened, clock.now())
        if not self._is_named and clock.now() - self._opened > BOOT:
            self._is_named = True
            self._rest = b""
            self._put(HEADER.encode())
        return self._is_named

    def _write(self, data: bytes) -> int:
        assert self._device is not None, "a line is written to while it is plugged in"
        return os.write(self._device, data)


class TcpOutlet(_LineOutlet):
    """A TCP port that serves one program at a time."""

    def __init__(self, host: str, port: int) -> None:
        self._place = (host, port or free_port(host))
        self._server: socket.socket | None = None
        self._client: socket.socket | None = None
        self.plug()

    @property
    def address(self) -> str:
        """See `Outlet`."""
        return f"tcp://{self._place[0]}:{self._place[1]}"

    def plug(self) -> None:
        """See `Outlet`."""
        try:
            self._server = socket.create_server(self._place)
        except OSError as error:
            raise ScenarioError(f"{self.address}: {error.strerror or error}; give another --port") from error
        self._server.setblocking(False)

    def unplug(self) -> None:
        """See `Outlet`."""
        for each in (self._client, self._server):
            if each is not None:
                each.close()
        self._client = self._server = None

    def _is_read(self) -> bool:
        if self._client is None and self._server is not None:
            try:
                self._client, _ = self._server.accept()
            except BlockingIOError:
                return False
            self._client.setblocking(False)
            self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._rest = b""
            self._put(HEADER.encode())
        return self._client is not None

    def _write(self, data: bytes) -> int:
        if self._client is None:  # gone while samples were sent
            return len(data)
        try:
            return self._client.send(data)
        except OSError as error:
            if error.errno not in (errno.EAGAIN, errno.EWOULDBLOCK):
                self._client.close()
                self._client = None
            raise
