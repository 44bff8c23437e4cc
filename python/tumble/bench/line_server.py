"""A server that accepts its lines itself, so that each counts from its first moment on."""

from __future__ import annotations

import asyncio
import socket
from typing import Any

import uvicorn

from tumble.bench.browser_socket import BrowserSocket
from tumble.bench.gate import LARGEST_MESSAGE
from tumble.bench.line import BrowserLine, Lines


class LineServer(uvicorn.Server):
    """Serves an application on a listening socket; `more` are settings of uvicorn."""

    def __init__(self, application: Any, listening: socket.socket, lines: Lines, **more: Any) -> None:  # noqa: ANN401
        listening.setblocking(False)
        self.socket = listening
        self._lines = lines
        self._accepting: asyncio.Task[None] | None = None
        super().__init__(
            uvicorn.Config(
                application,
                log_level="error",
                log_config=None,
                ws=BrowserSocket,
                ws_max_size=LARGEST_MESSAGE,
                server_header=False,
                **more,
            )
        )

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Starts as uvicorn does, and accepts lines from then on."""
        await super().startup(sockets)
        if not self.should_exit:
            await self.before_lines()
            accepting = self._lines.accept(self.socket, self._line)
            self._accepting = asyncio.get_running_loop().create_task(accepting, name="accept")

    async def before_lines(self) -> None:
        """Prepares for the first line."""

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Ends as uvicorn does, and waits for no line that nobody uses."""
        if self._accepting is not None:
            self._accepting.cancel()
        self.socket.close()
        self._lines.close()
        await super().shutdown(sockets)

    def _line(self) -> BrowserLine:
        """Makes the protocol of a line, as uvicorn does of those that it accepts itself."""
        return BrowserLine(
            self._lines, config=self.config, server_state=self.server_state, app_state=self.lifespan.state
        )
