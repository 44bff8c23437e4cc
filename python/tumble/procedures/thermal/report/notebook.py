"""A drift over temperature in a notebook: what `_repr_html_` of its result shows."""

from __future__ import annotations

from markupsafe import Markup

from tumble.procedures.thermal.report.text import COLUMNS, axis_rows, sentences
from tumble.procedures.thermal.result import ThermalResult
from tumble.report.notebook import paragraphs, row


def thermal_html(result: ThermalResult) -> str:
    """Prints drift, hysteresis and scale of every axis, and where they hold."""
    caption = Markup("<caption><b>{}</b> {}</caption>").format(result.name, result.verdict)
    head = row("th", ("", *COLUMNS))
    rows = [row("td", (name, *cells)) for name, cells in axis_rows(result)]
    notes = paragraphs((*sentences(result), *result.warnings))
    return Markup("<table>{}{}{}</table>{}").format(caption, head, Markup().join(rows), notes)
