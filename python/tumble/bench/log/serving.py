"""`tumble view` as a page: what is typed is opened, read in the background, and served."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from nicegui import ui

from tumble.bench.log.procedure_panel import ResultPages
from tumble.bench.log.samples_route import SamplesRoute
from tumble.bench.log.screen import LogScreen
from tumble.bench.log.server import PageServer
from tumble.tools.view.viewing import Viewing

STYLE = Path(__file__).with_name("log.css")


def serve(viewing: Viewing, port: int, *, opens_browser: bool, tell: Callable[[str], None]) -> None:
    """Serves a viewing until Ctrl-C; `tell` receives the address once it can be opened.

    Raises `TumbleError` where the port is taken.
    """
    samples, pages = SamplesRoute(), ResultPages()

    def page() -> None:
        ui.page_title(f"{viewing.title} - Tumble")
        ui.add_css(STYLE.read_text(encoding="utf-8"))
        LogScreen(viewing, samples, pages).show()

    server = PageServer(viewing.title, page, (samples.router, pages.router), port, viewing.gather)
    tell(server.address)
    server.run(opens_browser=opens_browser)
