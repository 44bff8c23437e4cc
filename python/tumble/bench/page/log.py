"""Screen of a log: a recording of a run, zoomed and read off."""

from __future__ import annotations

from functools import partial

from nicegui.element import Element

from tumble.bench.log.procedure_panel import Workplace
from tumble.bench.log.recording_screen import RecordingScreen, add_style
from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, button
from tumble.bench.run_folder import RunFolder
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_names import SESSION_FOLDER
from tumble.foundation.message import message
from tumble.tools.view.viewing import Viewing

MOST_OFFERED = 50
"""Recordings that are offered at once; to build a button takes 0.2 ms."""


class LogScreen:
    """See the module."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        add_style()
        with block("screen-head"):
            Label(page.words("Log"), "title", "h1")
            Label(page.words("Recordings of the runs in {folder}.", folder=str(page.bench.folder)), "lead")
        self._choices = block("kinds", role="group", aria_label=page.words("Recording"))
        self._place = block()
        self._more: Element | None = None
        self._runs = [run for run in page.bench.earlier() if run.has_recording]
        self._offer()

    def update(self) -> None:
        """Nothing changes by itself: the recording looks for itself."""

    def _offer(self) -> None:
        """Offers the next recordings, the latest first."""
        offered, self._runs = self._runs[:MOST_OFFERED], self._runs[MOST_OFFERED:]
        if self._more is not None:
            self._more.delete()
        with self._choices:
            for run in offered:
                button(run.path.name, partial(self._open, run), "kind")
            if self._runs:
                words = self._page.words("Earlier ones: {count}", count=len(self._runs))
                self._more = button(words, self._offer, "quiet")

    async def _open(self, run: RunFolder) -> None:
        """Shows the recording of a run of this bench; it is opened beside the page, as it may be long."""
        page, place = self._page, self._place
        place.clear()
        with place:
            opening = Label(page.words("Opening the recording …"), "help")
        try:
            viewing = await page.bench.beside.done(partial(self._opened, run, opening))
        except TumbleError as error:
            if not opening.is_deleted:
                opening.classes("trouble").show(page.text(message(str(error))))
            return
        if viewing is None:
            return
        try:
            # Another recording was chosen meanwhile, or the page is gone.
            if not opening.is_deleted:
                place.clear()
                with place:
                    self._show(viewing)
        finally:
            viewing.leave()

    def _opened(self, run: RunFolder, opening: Label) -> Viewing | None:
        """Opens a recording; None where nobody waits for it any more."""
        folder = str(run.path / SESSION_FOLDER)
        return None if opening.is_deleted else self._page.bench.logs.open(folder)

    def _show(self, viewing: Viewing) -> None:
        bench = self._page.bench
        workplace = Workplace(bench.folder, is_bound=True)
        logs = bench.logs
        RecordingScreen(viewing, logs.samples, logs.pages, self._page.language, workplace).show()


def show_log(page: PageContext) -> LogScreen:
    """Builds the screen."""
    return LogScreen(page)
