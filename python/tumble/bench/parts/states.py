"""States of the units of a set: a table, and below it what is wrong and what to do about it."""

from __future__ import annotations

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, set_class
from tumble.foundation.message import message
from tumble.tools.guided.figures import StateFigure, StateRow

SIGNS = {True: "✓", False: "✕", None: "○"}
"""By whether a unit is healthy; None while that is not known."""
CLASSES = {True: "good", False: "bad", None: "idle"}
SOURCE = message("source")


class StatePart:
    """The table."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._shown: StateFigure | None = None
        self._box = block("panel figure wide")

    def show(self, figure: StateFigure) -> None:
        """Draws a figure, where it differs from the last."""
        if figure == self._shown:
            return
        self._shown = figure
        self._box.clear()
        with self._box:
            Label(self._page.text(figure.title), "section", "h2")
            self._wrongs(figure)
            self._table(figure)

    def _wrongs(self, figure: StateFigure) -> None:
        """Lists what is wrong and why, which a person looks for first."""
        for row in figure.rows:
            if row.why:
                kind = "bad" if row.healthy is False else "warn"
                with block(f"wrong {kind}"):
                    Label("✕" if kind == "bad" else "▲", "wrong-sign")._props["aria-hidden"] = "true"
                    Label(row.name, "wrong-name")
                    Label(self._page.text(row.why), "wrong-why")

    def _table(self, figure: StateFigure) -> None:
        page = self._page
        with block("state-table", "table"):
            with block("", "thead"), block("", "tr"):
                for head in (message("unit"), message("state"), *figure.columns):
                    Label(page.text(head), tag="th")._props["scope"] = "col"
            with block("", "tbody"):
                for row in figure.rows:
                    self._row(row)

    def _row(self, row: StateRow) -> None:
        page = self._page
        with block("source-row" if row.is_source else "", "tr"):
            name = f"{row.name} ({page.text(SOURCE)})" if row.is_source else row.name
            Label(name, "state-name", "th")._props["scope"] = "row"
            Label(f"{SIGNS[row.healthy]} {page.text(row.state)}", f"state-word {CLASSES[row.healthy]}", "td")
            exceeded = row.exceeded or (False,) * len(row.cells)
            for cell, is_beyond in zip(row.cells, exceeded, strict=True):
                element = Label(_marked(page.text(cell), is_beyond), "", "td")
                set_class(element, "beyond", is_beyond)


def _marked(text: str, is_beyond: bool) -> str:
    """Marks what is beyond its threshold: colour never stands alone."""
    return f"✕ {text}" if is_beyond and text else text
