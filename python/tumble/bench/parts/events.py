"""Events of a set as they come, the latest first."""

from __future__ import annotations

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block
from tumble.tools.guided.figures import EventFigure

SHOWN = 12
"""Events on the screen; all are in the file of events."""


class EventPart:
    """The list."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._shown: EventFigure | None = None
        with block("panel figure wide"):
            self._title = Label("", "section", "h2")
            self._list = block("events", "ol", aria_live="polite")

    def show(self, figure: EventFigure) -> None:
        """Draws a figure, where it differs from the last."""
        if figure == self._shown:
            return
        self._shown = figure
        page = self._page
        self._title.show(page.text(figure.title))
        self._list.clear()
        with self._list:
            for line in figure.lines[:SHOWN]:
                with block("event fault" if line.is_fault else "event", "li"):
                    Label(f"{line.time:.1f} s", "event-time", "span")
                    Label("▲" if line.is_fault else "·", "event-sign", "span")._props["aria-hidden"] = "true"
                    Label(line.unit, "event-unit", "span")
                    Label(page.text(line.text), "event-text", "span")
