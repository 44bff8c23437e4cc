"""Screen of a log: a recording, zoomed and read off."""

from __future__ import annotations

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Text, block


class LogScreen:
    """See the module."""

    def __init__(self, page: PageContext) -> None:
        with block("screen-head"):
            Text(page.words("Log"), "title", "h1")
            Text(page.words("Recordings of the runs in {folder}.", folder=str(page.bench.folder)), "lead")

    def update(self) -> None:
        """Nothing changes by itself."""


def show_log(page: PageContext) -> LogScreen:
    """Builds the screen."""
    return LogScreen(page)
