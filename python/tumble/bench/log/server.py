"""A page on this computer behind the gate: loopback only, with a token, until Ctrl-C."""

from __future__ import annotations

import socket
import threading
import webbrowser
from collections.abc import Callable, Iterable
from typing import Final

from fastapi import APIRouter, FastAPI
from nicegui import app, core, ui

from tumble.bench.access import Access
from tumble.bench.address import entrances
from tumble.bench.gate import Gate
from tumble.bench.line import Lines
from tumble.bench.line_server import LineServer
from tumble.bench.messages import Dropped, guard_messages
from tumble.bench.settings import BenchSettings
from tumble.foundation.errors import CommandError

_QUEUE: Final = 64
"""Connections that wait to be accepted."""


class PageServer:
    """Serves one page until it is stopped, and does the work behind it on a thread of its own."""

    def __init__(
        self,
        settings: BenchSettings,
        title: str,
        build: Callable[[], None],
        routers: Iterable[APIRouter],
        work: Callable[[], None],
    ) -> None:
        listening = _listening(settings)
        port = int(listening.getsockname()[1])
        access = Access(needs_token=True, cookie=f"tumble_view_{port}")
        self.address = entrances(settings, access, port)["operator"]
        """Address to open, with the token."""
        pages = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
        for router in routers:
            pages.include_router(router)
        core.app.config.socket_io_js_transports = ["websocket"]
        # Otherwise a bar runs over the page with every range that is fetched.
        core.app.config.quasar_config["loadingBar"] = {"skipHijack": True}
        ui.run_with(
            pages,
            root=build,
            title=title,
            dark=None,
            language="en-US",
            tailwind=False,
            show_welcome_message=False,
            gzip_middleware_factory=None,  # the gate marks the scripts of a page
        )
        # While it starts, NiceGUI looks through all objects of the process, also tuples that are being
        # filled; CPython then fails to fill them. So no other thread works before that.
        app.on_startup(threading.Thread(target=work, daemon=True).start)
        guard_messages(Dropped())
        lines = Lines(access.cookies, access.operates)
        gate = Gate(pages, access, settings, lines.note_known)
        self._server = LineServer(gate, listening, lines, timeout_graceful_shutdown=1)

    def run(self, *, opens_browser: bool) -> None:
        """Serves until Ctrl-C."""
        if opens_browser:
            threading.Thread(target=webbrowser.open, args=(self.address,), daemon=True).start()
        self._server.run(sockets=[])


def _listening(settings: BenchSettings) -> socket.socket:
    """Listens at a port of this computer, any free one for 0; raises `CommandError` where it is taken."""
    try:
        return socket.create_server((settings.host, settings.port), backlog=_QUEUE)
    except (OSError, OverflowError) as error:
        raise CommandError(
            f"--port {settings.port}: cannot be used ({error}); give another, or leave it out"
        ) from error
