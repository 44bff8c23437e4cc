"""A calibrated magnetometer in a notebook: what `_repr_html_` of its result shows."""

from __future__ import annotations

from markupsafe import Markup

from tumble.procedures.magnetometer.report.page import parameter_groups_of
from tumble.procedures.magnetometer.report.text import next_sentences, sentences
from tumble.procedures.magnetometer.result import MagnetometerResult
from tumble.report.notebook import figures, paragraphs, row


def magnetometer_html(result: MagnetometerResult) -> str:
    """Prints every parameter with sigma, and how good they are."""
    caption = Markup("<caption><b>{}</b> {}</caption>").format(result.name, result.verdict)
    head = row("th", ("parameter", "value", "± sigma", "unit"))
    rows = [
        row("td", (printed.name, *figures(printed, group.unit)))
        for group in parameter_groups_of(result)
        for printed in group.rows
    ]
    notes = (*sentences(result), *next_sentences(result), *result.warnings)
    return Markup("<table>{}{}{}</table>{}").format(caption, head, Markup().join(rows), paragraphs(notes))
