"""Screen of a run: what it asks before it begins, then what to do now."""

from __future__ import annotations

from tumble.bench.page.context import PageContext
from tumble.bench.page.run_form import RunForm
from tumble.bench.page.run_view import RunPanel
from tumble.bench.parts.elements import block

PREPARED = ("idle", "result")
"""States of the engine in which the next run is prepared."""


class RunScreen:
    """The form, or the run: whichever the engine is at."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._content = block("run-screen")
        self._shown = ""
        """Form or run that is shown."""
        self._part: RunForm | RunPanel | None = None

    def update(self) -> None:
        """Shows the form before a run, and the run from its first moment on."""
        bench = self._page.bench
        wants_form = bench.engine.state in PREPARED
        wanted = f"form of {bench.choice.word}" if wants_form else "run"
        if wanted != self._shown:
            self._shown = wanted
            self._content.clear()
            with self._content:
                self._part = RunForm(self._page) if wants_form else RunPanel(self._page)
        if self._part is not None:
            self._part.update()


def show_run(page: PageContext) -> RunScreen:
    """Builds the screen."""
    return RunScreen(page)
