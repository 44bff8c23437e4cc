"""`tumble view` as a page: what is typed is opened, read in the background, and served."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from nicegui import ui

from tumble.bench.connecting import add_connecting
from tumble.bench.log.procedure_panel import ResultPages
from tumble.bench.log.recording_screen import RecordingScreen, add_style
from tumble.bench.log.samples_route import SamplesRoute
from tumble.bench.log.server import PageServer
from tumble.bench.settings import BenchSettings
from tumble.foundation.translation import accepted_language, speak, translated
from tumble.tools.view.viewing import Viewing


def serve(viewing: Viewing, port: int, *, opens_browser: bool, tell: Callable[[str], None]) -> None:
    """Serves a viewing until Ctrl-C; `tell` receives the address once it can be opened.

    Raises `CommandError` where the port is taken.
    """
    samples, pages = SamplesRoute(), ResultPages()

    def page() -> None:
        request = ui.context.client.request
        language = accepted_language(request.headers.get("accept-language", ""))
        speak(language)
        ui.page_title(f"{viewing.title} - Tumble")
        add_style()
        add_connecting(translated("Connecting …"))
        RecordingScreen(viewing, samples, pages, language).show()

    settings = BenchSettings(folder=Path(), port=port)
    server = PageServer(settings, viewing.title, page, (samples.router, pages.router), viewing.gather)
    tell(server.address)
    server.run(opens_browser=opens_browser)
