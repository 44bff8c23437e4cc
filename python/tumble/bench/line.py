"""Lines of browsers to the server: silent ones, and too many, leave room for others, with TLS as without."""

from __future__ import annotations

import asyncio
import socket
import ssl
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from uvicorn.protocols.http.auto import AutoHTTPProtocol

from tumble.bench.cookies import only_cookies

MOST_LINES = 256
"""Lines at once; of more, one is closed that the holder of the bench does not use."""
MOST_LINES_OF_ONE = MOST_LINES // 2
"""Lines of one computer; of more, the same."""
PATIENCE = 5.0
"""s in which a line has to be secured, and s in which its first request has to be there."""
WITHOUT_FILES = 0.1
"""s until a line is accepted again where the system has no room for one more."""

_Base: Any = AutoHTTPProtocol
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
    """Line on which a request comes soon, or that is closed."""

    def __init__(self, lines: Lines, **given: Any) -> None:  # noqa: ANN401
        super().__init__(**given)
        self._lines = lines

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Begins to wait for a request."""
        super().connection_made(transport)
        self.loop.call_later(PATIENCE, self._close_if_idle)

    def handle_websocket_upgrade(self, *event: Any) -> None:  # noqa: ANN401 - there is one with h11 only
        """Makes a socket of the line; those of other programs make headers that no socket takes."""
        self.headers[:] = list(_with_own_cookies(self.headers, self._lines.cookies))
        super().handle_websocket_upgrade(*event)

    def _close_if_idle(self) -> None:
        """Closes a line without a request; one that became a socket has another protocol by now."""
        if self.cycle is None and self.transport.get_protocol() is self:
            self.transport.close()


def _with_own_cookies(
    headers: Iterable[tuple[bytes, bytes]], names: Sequence[str]
) -> Iterator[tuple[bytes, bytes]]:
    for key, value in headers:
        yield key, only_cookies(value, names) if key.lower() == b"cookie" else value
