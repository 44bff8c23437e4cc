"""Lines of browsers to the server: silent ones, and too many, leave room for others, with TLS as without."""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Iterable, Iterator
from functools import partial
from typing import Any, cast

from uvicorn.protocols.http.auto import AutoHTTPProtocol

from tumble.bench.cookies import only_cookie

MOST_LINES = 256
"""Lines at once; of more, the oldest one that no known browser uses is closed."""
MOST_LINES_OF_ONE = MOST_LINES // 2
"""Lines of one computer; of more, the same."""
PATIENCE = 5.0
"""s in which a line has to be secured, and s in which its first request has to be there."""

_Base: Any = AutoHTTPProtocol


class Lines:
    """All lines of one server, the oldest first; each counts from the moment on that it is accepted."""

    def __init__(self, cookie: str, tls: ssl.SSLContext | None = None) -> None:
        self.cookie = cookie
        """Name of the only cookie that is read."""
        self.tls = tls
        self._open: list[Door] = []
        self._known: set[tuple[str, int]] = set()
        """Other ends of lines on which a known browser has asked for something."""

    def doors(self, **given: Any) -> Door:  # noqa: ANN401 - whatever uvicorn gives a protocol
        """Makes the protocol of one line that was accepted."""
        return Door(self, given)

    def enter(self, door: Door) -> None:
        """Counts a line, and closes others, or itself, where there are too many."""
        self._open = [each for each in self._open if not each.is_closing]
        self._known &= {each.client for each in self._open}
        self._open.append(door)
        of_one = [each for each in self._open if each.client[0] == door.client[0]]
        if len(of_one) > MOST_LINES_OF_ONE:
            self._close_one(of_one)
        elif len(self._open) > MOST_LINES:
            self._close_one(self._open)

    def note_known(self, client: tuple[str, int]) -> None:
        """Notes that a known browser uses a line."""
        self._known.add(client)

    def close(self) -> None:
        """Closes all lines that are not in use."""
        for each in self._open:
            if each.client not in self._known:
                each.close()

    def _close_one(self, lines: Iterable[Door]) -> None:
        """Closes the oldest line that no known browser uses: the newest, where all are in use."""
        *others, newest = lines
        next((each for each in others if each.client not in self._known), newest).close()


class Door(asyncio.Protocol):
    """Beginning of a line: it is counted, then secured, then it serves requests."""

    def __init__(self, lines: Lines, given: dict[str, Any]) -> None:
        self.client: tuple[str, int] = ("", 0)
        """Address and port of the other end."""
        self._lines, self._given = lines, given
        self._transport: asyncio.Transport | None = None
        self._securing: asyncio.Task[None] | None = None

    @property
    def is_closing(self) -> bool:
        """Returns whether the line is closed, or about to be."""
        return self._transport is None or self._transport.is_closing()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begins a line."""
        transport = cast("asyncio.Transport", transport)  # that of a stream, also where uvloop made it
        self._transport = transport
        peer = transport.get_extra_info("peername")
        self.client = (str(peer[0]), int(peer[1])) if peer else ("", 0)
        self._lines.enter(self)
        if transport.is_closing():
            return
        line = BrowserLine(self._lines, **self._given)
        if self._lines.tls is None:
            transport.set_protocol(line)
            line.connection_made(transport)
            return
        transport.pause_reading()
        self._securing = asyncio.get_running_loop().create_task(self._secure(transport, line))

    def close(self) -> None:
        """Closes the line at once."""
        if self._transport is not None:
            self._transport.abort()

    async def _secure(self, transport: asyncio.Transport, line: BrowserLine) -> None:
        loop, tls = asyncio.get_running_loop(), self._lines.tls
        assert tls is not None, "a line is secured by TLS"
        start = partial(loop.start_tls, server_side=True, ssl_handshake_timeout=PATIENCE)
        try:
            secured = await start(transport, line, tls)
        except (OSError, asyncio.TimeoutError):
            # Whoever does not speak TLS, or is silent, is no browser of this page.
            transport.abort()
            return
        if secured is not None:
            line.connection_made(secured)


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
        self.headers[:] = list(_with_own_cookie(self.headers, self._lines.cookie))
        super().handle_websocket_upgrade(*event)

    def _close_if_idle(self) -> None:
        """Closes a line without a request; one that became a socket has another protocol by now."""
        if self.cycle is None and self.transport.get_protocol() is self:
            self.transport.close()


def _with_own_cookie(headers: Iterable[tuple[bytes, bytes]], name: str) -> Iterator[tuple[bytes, bytes]]:
    for key, value in headers:
        yield key, only_cookie(value, name) if key.lower() == b"cookie" else value
