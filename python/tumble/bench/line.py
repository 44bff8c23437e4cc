"""Lines of browsers to the server: idle ones, and too many of one computer, leave room for others."""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.auto import AutoHTTPProtocol

MOST_LINES = 256
"""Lines at once; of more, each is answered that the server is busy."""
MOST_LINES_OF_ONE = MOST_LINES // 2
"""Lines of one computer; further ones are closed."""
PATIENCE = 5.0
"""s in which the first request of a line has to be there."""

_Base: Any = AutoHTTPProtocol


class BrowserLine(_Base):  # type: ignore[misc]
    """Line on which a request comes soon, or that is closed."""

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Begins a line."""
        super().connection_made(transport)
        others = sum(_address(each) == _address(self) for each in self.connections)
        if others > MOST_LINES_OF_ONE:
            transport.abort()
            return
        self.loop.call_later(PATIENCE, self._close_if_idle)

    def _close_if_idle(self) -> None:
        """Closes a line without a request; one that became a socket has another protocol by now."""
        if self.cycle is None and self.transport.get_protocol() is self:
            self.transport.close()


def _address(line: Any) -> str:  # noqa: ANN401 - a protocol of uvicorn
    client = getattr(line, "client", None)
    return client[0] if client else ""
