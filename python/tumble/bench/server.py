"""The server: NiceGUI behind the gate, on one port, until it is ended."""

from __future__ import annotations

import asyncio
import gc
import socket
from collections.abc import Callable, Iterator, MutableMapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from fastapi import FastAPI
from fastapi.responses import FileResponse, HTMLResponse, Response
from nicegui import app as nicegui_app
from nicegui import background_tasks, core, ui
from starlette.middleware.gzip import GZipMiddleware

from tumble.bench.access import COOKIE, Browser
from tumble.bench.authority import acting
from tumble.bench.backlog import MOST_SENT_AGAIN, close_slow_sockets
from tumble.bench.bench import Bench
from tumble.bench.gate import BROWSER, LARGEST_MESSAGE, Gate
from tumble.bench.line import MOST_LINES, Lines
from tumble.bench.line_server import LineServer
from tumble.bench.messages import Dropped, guard_messages
from tumble.bench.page.fleet import fleet_page
from tumble.bench.page.frame import show_page
from tumble.bench.registry_view import RegistryView
from tumble.bench.settings import BenchSettings
from tumble.bench.tls import server_context
from tumble.foundation import clock
from tumble.foundation.ending import end_of, stopped_by_signals
from tumble.foundation.errors import CommandError, TumbleError
from tumble.foundation.file_names import SESSION_FOLDER
from tumble.foundation.file_status import is_file

STATIC = Path(__file__).parent / "static"
REPORTS = (".html", ".pdf", ".xml", ".yaml", ".csv", ".json")
"""Endings of files of a run that pages link to."""
COMPRESSION = 4
"""Level of gzip: a page comes over a hall's wireless network, and the server has samples to read."""
PDF = "application/pdf"
BETWEEN_PULSES = 0.1
"""s between two signs that the server has time for its pages."""
FORGOTTEN_AFTER = 5.0
"""s after which a page is forgotten whose browser has no socket; NiceGUI asks for a sign of life in 0.8 of it
and waits for 0.4 of it. A browser that comes back later loads the page again."""
GRACE = 2
"""s for open connections to end once the server is to."""


class BenchServer(LineServer):
    """Serves a bench until `should_exit`, or any signal that would end the program."""

    def __init__(self, bench: Bench) -> None:
        settings = bench.settings
        tls = server_context(settings.certificate, settings.key)
        listening = _listening(settings)
        self.port: int = listening.getsockname()[1]
        """Port at which it listens."""
        bench.access.cookie = f"{COOKIE}_{self.port}"
        self.dropped = Dropped()
        self._pages = _application(bench)
        guard_messages(self.dropped)
        lines = Lines(bench.access.cookies, bench.access.operates, tls)
        gate = Gate(self._pages, bench.access, settings, lines.note_known)
        super().__init__(
            GZipMiddleware(gate, compresslevel=COMPRESSION),
            listening,
            lines,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=GRACE,
            date_header=False,
        )

    def serve_until_ended(self, tell: Callable[[], None] = lambda: None) -> None:
        """Serves until `should_exit` or a signal; calls `tell` once a page would come at once.

        Raises `end_of` the signal.
        """
        self._tell = tell
        self.run(sockets=[])

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Ends the server in order at any signal that would end the program, which ends by it afterwards."""
        with stopped_by_signals(self._end_soon) as received:
            yield
        if received:
            raise end_of(received[0])

    async def before_lines(self) -> None:
        """Builds one page: the first takes long, as it imports and compiles.

        All that is there by then stays to the end, and is not looked through for garbage again: that held up
        a stop by 70 ms.
        """
        await _build_page(self._pages)
        gc.collect()
        gc.freeze()
        self._tell()

    def _end_soon(self) -> None:
        self.should_exit = True


async def _build_page(pages: FastAPI) -> None:
    """Builds the first screen for a browser that does not exist, and forgets it."""
    scope = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": "GET",
        "scheme": "http",
        "path": "/",
        "raw_path": b"/",
        "query_string": b"",
        "headers": [(b"host", b"localhost")],
        "client": ("", 0),
        "server": ("localhost", 0),
        BROWSER: Browser("", "viewer", "", 0),
    }

    async def receive() -> MutableMapping[str, Any]:
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(_: MutableMapping[str, Any]) -> None:
        """Drops what a browser would show."""

    await pages(scope, receive, send)


def _listening(settings: BenchSettings) -> socket.socket:
    """Listens at the port; raises `CommandError` where it is taken, or no address of this computer."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    try:
        return socket.create_server((settings.host, settings.port), family=family, backlog=MOST_LINES)
    except OSError as error:
        raise CommandError(
            f"{settings.host}:{settings.port}: {error.strerror or error}; give another --port, or --port 0"
        ) from error


def _application(bench: Bench) -> FastAPI:
    application = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    nicegui_app.add_static_files("/bench", STATIC, max_cache_age=0)
    for router in bench.logs.routers:
        nicegui_app.include_router(router)

    @nicegui_app.get("/runs/{run}/{name}")
    def report(run: str, name: str) -> Response:
        """Returns a file of a run."""
        return _file(bench, run, name)

    @nicegui_app.get("/history/{unit}")
    async def history(unit: str) -> Response:
        """Returns the page of a unit over time."""
        return await _of_registry(bench, lambda registry: HTMLResponse(registry.history_page(unit)))

    @nicegui_app.get("/certificates/{number}.pdf")
    async def certificate(number: str) -> Response:
        """Returns a certificate."""
        return await _of_registry(
            bench, lambda registry: Response(registry.certificate(number), media_type=PDF)
        )

    @nicegui_app.get("/compared/{first}/{second}")
    async def comparison(first: str, second: str) -> Response:
        """Returns the page of two results that were held against each other."""
        return await _of_registry(
            bench, lambda registry: HTMLResponse(registry.comparison_page(first, second))
        )

    @nicegui_app.get("/fleets/{job}")
    async def fleet(job: str, limits: str = "") -> Response:
        """Returns the page of a fleet."""
        return await _answered(bench, lambda: HTMLResponse(fleet_page(bench, job, limits)))

    nicegui_app.on_startup(partial(_pulse, bench))
    core.app.config.quasar_config["loadingBar"] = {"skipHijack": True}
    core.app.config.socket_io_js_transports = ["websocket"]
    core.sio.eio.max_http_buffer_size = LARGEST_MESSAGE
    ui.run_with(
        application,
        root=partial(show_page, bench),
        title="Tumble",
        dark=None,
        language="en-US",
        tailwind=False,
        reconnect_timeout=FORGOTTEN_AFTER,
        message_history_length=MOST_SENT_AGAIN,
        show_welcome_message=False,
        binding_refresh_interval=None,
        favicon=STATIC / "favicon.svg",
        gzip_middleware_factory=None,  # the gate marks the scripts of a page, and compresses after that
    )
    return application


async def _pulse(bench: Bench) -> None:
    """Notes again and again that the server has time for its pages; closes sockets that take too little."""

    async def beat() -> None:
        while True:
            with acting(lambda: True):
                bench.pulse = clock.now()
            close_slow_sockets(bench.access.operates)
            await asyncio.sleep(BETWEEN_PULSES)

    background_tasks.create(beat(), name="pulse")


async def _of_registry(bench: Bench, answer: Callable[[RegistryView], Response]) -> Response:
    def answered() -> Response:
        registry = bench.registry()
        return Response("no registry is set", 404) if registry is None else answer(registry)

    return await _answered(bench, answered)


async def _answered(bench: Bench, answer: Callable[[], Response]) -> Response:
    """Answers beside the pages, and leaves threads to requests that wait for no server."""
    try:
        return await bench.beside.done(answer)
    except TumbleError as error:
        return Response(str(error), 404)


def _file(bench: Bench, run: str, name: str) -> Response:
    """Returns a report, a calibration or a summary of a run of this bench, and nothing else."""
    folder = next((each.path for each in bench.earlier() if each.path.name == run), None)
    if folder is None or "/" in name or name == SESSION_FOLDER or Path(name).suffix not in REPORTS:
        return Response("no such file", 404)
    path = folder / name
    if not is_file(path) or path.resolve().parent != folder.resolve():
        return Response("no such file", 404)
    return FileResponse(path)
