"""Sockets of browsers: all that comes on one is part of a message, and each message has its turn."""

from __future__ import annotations

from typing import Any

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from tumble.bench.line import PIECE

MOST_FRAMES = 64
"""Frames up to the last one of a message, pings and pongs among them. Browsers send a pong in 20 s, and large
messages in a few frames (RFC 6455, sections 5.4 and 5.5)."""
ABORT = "tumble.abort"
"""Key, in the scope of a socket, of what closes its line at once."""

_Base: Any = WebSocketsSansIOProtocol


class BrowserSocket(_Base):  # type: ignore[misc]
    """Socket of which no more is taken apart than its messages have turns; see `Gate`.

    Frames that are no message are seen by no application, so that they are counted here.
    """

    def __init__(self, *given: Any, **named: Any) -> None:  # noqa: ANN401
        super().__init__(*given, **named)
        self._unread = b""
        """Bytes that came with a message and wait, as all behind it does, until it is taken."""
        self._frames = 0

    def handle_connect(self, event: Any) -> None:  # noqa: ANN401
        """Begins the socket; whoever serves it may close its line."""
        super().handle_connect(event)
        if not self.handshake_complete:
            self.scope[ABORT] = self.transport.abort

    def data_received(self, data: bytes) -> None:
        """Reads up to the first message."""
        self._unread += data
        self._read_on()

    async def receive(self) -> Any:  # noqa: ANN401
        """Returns the next message, and reads on after the last one."""
        message = await super().receive()
        self._read_on()
        return message

    async def send(self, message: Any) -> None:  # noqa: ANN401
        """Sends a message; reads on where it ends the socket, as the answer to that is the last frame."""
        await super().send(message)
        self._read_on()

    def handle_ping(self) -> None:
        """Answers a ping."""
        if self._has_room():
            super().handle_ping()

    def handle_pong(self, event: Any) -> None:  # noqa: ANN401
        """Takes a pong."""
        if self._has_room():
            super().handle_pong(event)

    def handle_cont(self, event: Any) -> None:  # noqa: ANN401
        """Takes a further part of a message."""
        if self._has_room():
            super().handle_cont(event)

    def send_receive_event_to_app(self) -> None:
        """Hands a whole message on."""
        self._frames = 0
        super().send_receive_event_to_app()

    def _has_room(self) -> bool:
        """Counts a frame; returns whether it is one that a browser sends, and closes the line where not."""
        self._frames += 1
        if self._frames > MOST_FRAMES:
            self.transport.abort()
        return not self.transport.is_closing()

    def _read_on(self) -> None:
        while self._unread and not self.read_paused and not self.transport.is_closing():
            piece, self._unread = self._unread[:PIECE], self._unread[PIECE:]
            super().data_received(piece)
