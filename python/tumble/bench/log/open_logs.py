"""Recordings that pages of a bench show: each is opened and read once, whoever looks at it."""

from __future__ import annotations

import threading

from fastapi import APIRouter

from tumble.bench.log.procedure_panel import ResultPages
from tumble.bench.log.samples_route import SamplesRoute
from tumble.foundation.errors import TumbleError
from tumble.tools.view.viewing import Viewing, open_viewing

MOST = 4
"""Recordings that are kept; of more, that which was opened longest ago is closed once no page shows it."""


class OpenLogs:
    """Recordings by what was typed, with the routes of their samples and of results made of them."""

    def __init__(self) -> None:
        self.samples = SamplesRoute()
        self.pages = ResultPages()
        self._open: dict[str, Viewing] = {}
        self._readers: list[threading.Thread] = []
        self._lock = threading.Lock()

    @property
    def routers(self) -> tuple[APIRouter, APIRouter]:
        """Routes that a server has to include."""
        return self.samples.router, self.pages.router

    def open(self, source: str) -> Viewing:
        """Opens LOG, RESULT or SESSION, which may take long, and reads it in the background.

        Whoever opens it has entered it, and leaves it. Raises `TumbleError`, in one line, where it cannot be
        opened, or as many as are kept are being read.
        """
        with self._lock:
            if source not in self._open:
                self._readers = [each for each in self._readers if each.is_alive()]
                if len(self._readers) >= MOST:
                    raise TumbleError(f"{MOST} recordings are being read; open this one once they are there")
                self._open[source] = open_viewing([source])
                self._readers.append(threading.Thread(target=self._open[source].gather, daemon=True))
                self._readers[-1].start()
            viewing = self._open[source]
            viewing.enter()
            while len(self._open) > MOST:
                self._open.pop(next(iter(self._open))).close()
            return viewing

    def close(self) -> None:
        """Closes all recordings."""
        with self._lock:
            while self._open:
                self._open.popitem()[1].close()
