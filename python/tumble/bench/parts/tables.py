"""Tables of texts, with a head, and a title above."""

from __future__ import annotations

from collections.abc import Sequence

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block
from tumble.report.numbers import typeset

MOST_ROWS = 12
"""Rows that are shown."""


def show_table(
    page: PageContext, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], rest: str
) -> None:
    """Adds a table; `rest` is where its further rows stand: `on the page`."""
    Label(title, "subsection", "h3")
    with block("scrolled", tabindex="0", role="region", aria_label=title), block("figures-table", "table"):
        with block("", "thead"), block("", "tr"):
            for column in columns:
                Label(page.words(column), tag="th")._props["scope"] = "col"
        with block("", "tbody"):
            for row in rows[:MOST_ROWS]:
                with block("", "tr"):
                    Label(row[0], tag="th")._props["scope"] = "row"
                    for cell in row[1:]:
                        Label(typeset(page.words(cell)), tag="td")
    if len(rows) > MOST_ROWS:
        Label(page.words("and {count} more {where}", count=len(rows) - MOST_ROWS, where=rest), "help")
