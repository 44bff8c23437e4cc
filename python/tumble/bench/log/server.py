"""A page on this computer behind the gate: loopback only, with a token, until Ctrl-C."""

from __future__ import annotations

import socket
import threading
import webbrowser
from collections.abc import Callable, Iterable
from typing import Any, Final

import uvicorn
from fastapi import APIRouter, FastAPI
from nicegui import app, core, ui

from tumble.bench.access import Access
from tumble.bench.address import entrances
from tumble.bench.gate import LARGEST_MESSAGE, Gate
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
        self._socket = _listening(settings)
        port = int(self._socket.getsockname()[1])
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
        gate: Any = Gate(pages, access, settings)
        self._server = uvicorn.Server(
            uvicorn.Config(
                gate,
                log_level="error",
                ws="websockets-sansio",
                ws_max_size=LARGEST_MESSAGE,
                timeout_graceful_shutdown=1,
                server_header=False,
            )
        )

    def run(self, *, opens_browser: bool) -> None:
        """Serves until Ctrl-C."""
        if opens_browser:
            threading.Thread(target=webbrowser.open, args=(self.address,), daemon=True).start()
        self._server.run(sockets=[self._socket])


def _listening(settings: BenchSettings) -> socket.socket:
    """Listens at a port of this computer, any free one for 0; raises `CommandError` where it is taken."""
    try:
        return socket.create_server((settings.host, settings.port), backlog=_QUEUE)
    except (OSError, OverflowError) as error:
        raise CommandError(
            f"--port {settings.port}: cannot be used ({error}); give another, or leave it out"
        ) from error
