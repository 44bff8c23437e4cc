"""Byte streams: a TCP connection, standard input, a file that grows."""

from __future__ import annotations

import io
import os
import socket
import stat
import sys
from pathlib import Path
from types import TracebackType
from typing import IO, cast

from tumble.foundation import clock
from tumble.foundation.errors import LogError, PlaceError
from tumble.foundation.regular_files import open_regular
from tumble.foundation.words import count_of
from tumble.live.address import Address
from tumble.live.lines import LONGEST_LINE
from tumble.live.transport import NetworkSocket
from tumble.logs.options import ReadOptions
from tumble.logs.standard_input import nothing_piped
from tumble.logs.text import names_delimiter

LINE_END = b"\n"
"""Put behind what may be the last line, or a torn one."""
PIECE = 1 << 16
"""Bytes to take at once."""
CONNECT_WITHIN = 5.0
"""s for a host to answer."""
LINES_BEFORE_NAMES = 20
"""Lines of a file among which the names of its columns are looked for."""


class TcpConnection(NetworkSocket):
    """A connection to a device, or a program, that listens."""

    whole = False
    reorder_window = 0.0
    unread = 0
    sender = None
    joined_midway = True
    notices: tuple[str, ...] = ()

    def __init__(self, address: Address, host: str, port: int) -> None:
        super().__init__()
        self._address = address
        self._place = host, port

    def __enter__(self) -> TcpConnection:
        try:
            self._opened = socket.create_connection(self._place, CONNECT_WITHIN)
        except (OSError, UnicodeError) as error:
            why = getattr(error, "strerror", None) or error
            raise LogError(
                f"{self._address.text}: cannot connect: {why}; is the device on, and does it listen at that "
                "port?"
            ) from error
        self._socket.setblocking(False)
        return self

    def receive(self) -> bytes:
        """Returns the bytes that have come."""
        try:
            piece = self._socket.recv(PIECE)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise self._lost() from error
        if not piece:
            raise self._lost()
        return piece

    def send(self, data: bytes) -> None:
        """Sends bytes to the other end."""
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise self._lost() from error

    def _lost(self) -> LogError:
        return LogError(
            f"{self._address.text}: the connection was lost: was the device switched off, or did its program "
            "end? Start it and this again"
        )


class StandardInput:
    """Standard input, into which another program writes; it ends where that program does."""

    whole = False
    reorder_window = 0.0
    unread = 0
    sender = None
    joined_midway = False
    notices: tuple[str, ...] = ()

    def __init__(self, address: Address) -> None:
        self._address = address
        self._line: int | None = None
        self._has_ended = False

    def __enter__(self) -> StandardInput:
        try:
            self._line = None if sys.stdin is None or sys.stdin.isatty() else sys.stdin.fileno()
        except (io.UnsupportedOperation, ValueError):
            self._line = None
        if self._line is None:
            raise nothing_piped(self._address.text)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._line = None

    def fileno(self) -> int | None:
        """Returns the descriptor; None for a file, which is always ready and cannot be waited for."""
        assert self._line is not None, "standard input is waited for while it is read"
        return None if stat.S_ISREG(os.fstat(self._line).st_mode) else self._line

    def receive(self) -> bytes:
        """Returns the bytes that have come; raises `EOFError` at their end."""
        assert self._line is not None, "standard input is read while it is open"
        if not clock.readable(self._line, 0.0):
            return b""
        if piece := os.read(self._line, PIECE):
            return piece
        if self._has_ended:
            raise EOFError
        self._has_ended = True
        return LINE_END

    def send(self, data: bytes) -> None:
        """Raises `LogError`: a pipe leads one way."""
        raise LogError(f"{self._address.text}: the line is read-only; give a line to which data can be sent")


class GrowingFile:
    """A file that another program writes: what is added to it, and the names of its columns."""

    whole = False
    reorder_window = 0.0
    unread = 0
    sender = None
    joined_midway = False

    def __init__(self, address: Address, path: Path, options: ReadOptions, *, from_start: bool) -> None:
        self._address = address
        self._path = path
        self._options = options
        self._from_start = from_start
        self._file: IO[bytes] | None = None
        self._waiting = b""
        self._truncated = 0
        self._replaced = 0

    @property
    def notices(self) -> tuple[str, ...]:
        """Reports interruptions of the growth of the file."""
        truncated = f"the file was cut short {count_of('time', self._truncated)} and read on from its start"
        replaced = f"the file was replaced {count_of('time', self._replaced)} and the new one read"
        return (*((truncated,) if self._truncated else ()), *((replaced,) if self._replaced else ()))

    def __enter__(self) -> GrowingFile:
        try:
            self._file = self._opened()
        except OSError as error:
            raise LogError(
                f"{self._address.text}: {self._path} cannot be read: {error.strerror or error}; start what "
                "writes it first"
            ) from error
        if not self._from_start:
            self._waiting = self._names()
            self._go_to_last_line()
        return self

    def _opened(self) -> IO[bytes]:
        """Opens what is there by now; anything but a file is refused, and never waited for."""
        try:
            return cast("IO[bytes]", open_regular(self._path).detach())
        except (PlaceError, IsADirectoryError) as error:
            raise LogError(
                f"{self._address.text}: {self._path} is no file; give the file that grows"
            ) from error

    def _names(self) -> bytes:
        """Returns the line that names columns, which stands at the start of the file."""
        assert self._file is not None, "the file was opened"
        for _ in range(LINES_BEFORE_NAMES):
            line = self._file.readline(LONGEST_LINE)
            text = line.decode("utf-8-sig", "replace").strip().lstrip("#%").strip()
            if line.endswith(b"\n") and names_delimiter(text, self._options) is not None:
                return line
        return b""

    def _go_to_last_line(self) -> None:
        """Moves to the beginning of the line that is being written."""
        assert self._file is not None, "the file was opened"
        end = self._file.seek(0, os.SEEK_END)
        begin = self._file.seek(max(0, end - LONGEST_LINE))
        tail = self._file.read(end - begin)
        self._file.seek(begin + tail.rfind(b"\n") + 1 if b"\n" in tail else end)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None

    def fileno(self) -> None:
        """Returns None: a file is always ready and cannot be waited for."""

    def receive(self) -> bytes:
        """Returns what was added to the file."""
        assert self._file is not None, "a file is read while it is open"
        try:
            names, self._waiting = self._waiting, b""
            piece = names + self._file.read(PIECE)
            if not piece:
                self._follow()
        except OSError as error:
            raise LogError(
                f"{self._address.text}: {self._path} cannot be read on: {error.strerror or error}; check the "
                "disk"
            ) from error
        return piece

    def _follow(self) -> None:
        """Moves to the start of a file that was cut short, or of the new one that replaced it."""
        assert self._file is not None, "a file is read while it is open"
        here = os.fstat(self._file.fileno())
        if here.st_size < self._file.tell():
            self._truncated += 1
            self._file.seek(0)
            self._waiting = LINE_END
        try:
            there = self._path.stat()
        except FileNotFoundError:
            # Between the old one's being moved away and the new one's being made.
            return
        if not os.path.samestat(here, there):
            self._replaced += 1
            self._waiting = LINE_END
            self._file.close()
            self._file = self._opened()

    def send(self, data: bytes) -> None:
        """Raises `LogError`: a file is no device."""
        raise LogError(f"{self._address.text}: nothing can be sent to a file")
