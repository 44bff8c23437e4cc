"""Lines of browsers to the server: silent ones, and too many, leave room for others, with TLS as without."""

from __future__ import annotations

import asyncio
import socket
import ssl
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from tumble.bench.cookies import only_cookies

MOST_LINES = 256
"""Lines at once; of more, one is closed that the holder of the bench does not use."""
MOST_LINES_OF_ONE = MOST_LINES // 2
"""Lines of one computer; of more, the same."""
PATIENCE = 5.0
"""s in which a line has to be secured, and s in which the head of each request has to be there."""
LARGEST_HEAD = 1 << 16
"""Bytes of the head of a request."""
MOST_HEADERS = 128
"""Headers of a request."""
MOST_WAITING = 1
"""Requests of a line behind the one that is served: a browser sends one at the last byte of an answer."""
PIECE = 1 << 12
"""Bytes that are taken apart before limits are looked at: a moment of the processor."""
WITHOUT_FILES = 0.1
"""s until a line is accepted again where the system has no room for one more."""

_Base: Any = HttpToolsProtocol
Client = tuple[str, int]
"""Address and port of the other end of a line."""


class Lines:
    """All lines of one server, the oldest first; each counts from the moment on that it is accepted."""

    def __init__(
        self, cookies: Sequence[str], holds: Callable[[str], bool], tls: ssl.SSLContext | None = None
    ) -> None:
        self.cookies = tuple(cookies)
        """Names of the only cookies that are read."""
        self._holds = holds
        """Returns whether the browser of a key holds the bench."""
        self._tls = tls
        self._open: list[AcceptedLine] = []
        self._known: dict[Client, str] = {}
        """Other ends of lines on which a known browser has asked for something, and its key."""

    async def accept(self, listening: socket.socket, protocol: Callable[[], asyncio.Protocol]) -> None:
        """Accepts lines without end; `listening` does not block."""
        loop = asyncio.get_running_loop()
        while True:
            try:
                end, address = await loop.sock_accept(listening)
            except OSError:  # the other end was gone before, or the system has no room for one more
                await asyncio.sleep(WITHOUT_FILES)
                continue
            self._enter(AcceptedLine(end, (str(address[0]), int(address[1])), protocol, self._tls))

    def note_known(self, client: Client, key: str) -> None:
        """Notes that the known browser of a key uses a line."""
        self._known[client] = key

    def close(self) -> None:
        """Closes all lines that no known browser uses."""
        for each in self._open:
            if each.client not in self._known:
                each.close()

    def _enter(self, line: AcceptedLine) -> None:
        self._open = [each for each in self._open if not each.is_closed]
        self._known = {
            each.client: self._known[each.client] for each in self._open if each.client in self._known
        }
        self._open.append(line)
        of_one = [each for each in self._open if each.client[0] == line.client[0]]
        if len(of_one) > MOST_LINES_OF_ONE:
            self._close_one(of_one)
        elif len(self._open) > MOST_LINES:
            self._close_one(self._open)

    def _close_one(self, lines: Sequence[AcceptedLine]) -> None:
        """Closes the oldest line of unknown browsers, or of those that only look once these have half.

        The newest one may be about to serve whoever holds the bench, so that it goes last but theirs.
        """
        *before, newest = lines
        unknown = [each for each in before if each.client not in self._known]
        guests = [each for each in before if each.client in self._known and not self._is_holders(each)]
        crowd = guests if len(guests) > len(lines) // 2 else unknown or guests or [newest]
        crowd[0].close()

    def _is_holders(self, line: AcceptedLine) -> bool:
        return self._holds(self._known[line.client])


class AcceptedLine:
    """One line, from its first moment on: it is secured, then it serves requests."""

    def __init__(
        self,
        end: socket.socket,
        client: Client,
        protocol: Callable[[], asyncio.Protocol],
        tls: ssl.SSLContext | None,
    ) -> None:
        self.client = client
        self._transport: Any = None
        self._begun = asyncio.get_running_loop().create_task(self._begin(end, protocol, tls))

    @property
    def is_closed(self) -> bool:
        """Returns whether the line is closed, or about to be."""
        return self._begun.done() and (self._transport is None or self._transport.is_closing())

    def close(self) -> None:
        """Closes the line at once."""
        self._begun.cancel()
        if self._transport is not None:
            self._transport.abort()

    async def _begin(
        self, end: socket.socket, protocol: Callable[[], asyncio.Protocol], tls: ssl.SSLContext | None
    ) -> None:
        patience = None if tls is None else PATIENCE
        loop = asyncio.get_running_loop()
        try:
            self._transport, _ = await loop.connect_accepted_socket(
                protocol, end, ssl=tls, ssl_handshake_timeout=patience
            )
        except (OSError, asyncio.TimeoutError):
            # Whoever does not speak TLS, or is silent, is no browser of this page.
            end.close()
        except asyncio.CancelledError:
            end.close()
            raise


class BrowserLine(_Base):  # type: ignore[misc]
    """Line on which heads of requests come soon and are short, or that is closed.

    It knows httptools, whose time grows with the bytes alone; that of h11 grows with the square of the blanks
    of a header. Neither bounds a head by itself.
    """

    def __init__(self, lines: Lines, **given: Any) -> None:  # noqa: ANN401
        super().__init__(**given)
        self._lines = lines
        self._due: asyncio.TimerHandle | None = None
        """End of the wait for a whole head; None while a request is served."""
        self._head = 0
        """Bytes of a head that is not whole, and of empty lines before it."""
        self._in_body = False

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Begins to wait for a request."""
        super().connection_made(transport)
        self._wait_for_head()

    def connection_lost(self, error: Exception | None) -> None:
        """Waits no more."""
        self._end_wait()
        super().connection_lost(error)

    def data_received(self, data: bytes) -> None:
        """Reads bytes, piece by piece, until there is more of a head than a browser sends."""
        for first in range(0, len(data), PIECE):
            piece = data[first : first + PIECE]
            super().data_received(piece)
            if self.transport.is_closing() or self.transport.get_protocol() is not self:
                return
            self._head += 0 if self._in_body else len(piece)
            if self._head > LARGEST_HEAD or len(self.pipeline) > MOST_WAITING:
                self.transport.abort()
                return

    def on_header(self, name: bytes, value: bytes) -> None:
        """Takes a header; refuses more of them than a browser sends, and bodies of unknown length."""
        if len(self.headers) >= MOST_HEADERS or name.lower() == b"transfer-encoding":
            raise ValueError  # httptools makes it an error of its own, to which uvicorn answers 400
        super().on_header(name, value)

    def on_headers_complete(self) -> None:
        """Serves a request, or makes a socket of the line."""
        self._end_wait()
        self._head, self._in_body = 0, True
        super().on_headers_complete()

    def on_message_complete(self) -> None:
        """Notes the end of a body."""
        self._in_body = False
        super().on_message_complete()

    def on_response_complete(self) -> None:
        """Waits for the next request, unless it is there."""
        super().on_response_complete()
        if self.cycle.response_complete and not self.transport.is_closing():
            self._wait_for_head()

    def handle_websocket_upgrade(self) -> None:
        """Makes a socket of the line; those of other programs make headers that no socket takes."""
        self.headers[:] = list(_with_own_cookies(self.headers, self._lines.cookies))
        super().handle_websocket_upgrade()

    def _wait_for_head(self) -> None:
        self._end_wait()
        self._due = self.loop.call_later(PATIENCE, self.transport.close)

    def _end_wait(self) -> None:
        if self._due is not None:
            self._due.cancel()
            self._due = None


def _with_own_cookies(
    headers: Iterable[tuple[bytes, bytes]], names: Sequence[str]
) -> Iterator[tuple[bytes, bytes]]:
    for key, value in headers:
        yield key, only_cookies(value, names) if key.lower() == b"cookie" else value
