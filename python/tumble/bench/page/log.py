"""Screen of a log: a recording of a run, zoomed and read off."""

from __future__ import annotations

from functools import partial

from tumble.bench.log.procedure_panel import Workplace
from tumble.bench.log.recording_screen import RecordingScreen, add_style
from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, button
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_names import SESSION_FOLDER
from tumble.foundation.message import message


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
        with self._choices:
            for run in page.bench.earlier():
                if run.has_recording:
                    button(run.path.name, partial(self._open, run.path.name), "kind")

    def update(self) -> None:
        """Nothing changes by itself: the recording looks for itself."""

    def _open(self, name: str) -> None:
        """Shows the recording of a run of this bench."""
        page = self._page
        folder = next(run.path for run in page.bench.earlier() if run.path.name == name)
        try:
            viewing = page.bench.logs.open(str(folder / SESSION_FOLDER))
        except TumbleError as error:
            page.notify(page.text(message(str(error))))
            return
        self._place.clear()
        workplace = Workplace(page.bench.folder, is_bound=True)
        logs = page.bench.logs
        with self._place:
            RecordingScreen(viewing, logs.samples, logs.pages, page.language, workplace).show()


def show_log(page: PageContext) -> LogScreen:
    """Builds the screen."""
    return LogScreen(page)
