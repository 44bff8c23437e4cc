"""A replayed redundant set in a notebook: what `_repr_html_` of its result shows."""

from __future__ import annotations

from markupsafe import Markup

from tumble.procedures.redundancy.report import text
from tumble.procedures.redundancy.report.parameters import error_groups
from tumble.procedures.redundancy.result import RedundancyResult
from tumble.report.notebook import figures, paragraphs, row


def redundancy_html(result: RedundancyResult) -> str:
    """Prints what happened in a replay, and every parameter of each error found with sigma."""
    result = result.from_start()
    caption = Markup("<caption><b>{}</b></caption>").format(result.primary)
    head = row("th", ("", "", "parameter", "value", "± sigma", "unit")) if result.errors else Markup()
    rows = [
        row("td", (error.unit, error.sensor, printed.name, *figures(printed, group.unit)))
        for unit in result.secondaries
        for error in text.errors_of(result, unit)
        for group in error_groups(error)
        for printed in group.rows
    ]
    notes = (*text.summary(result), *text.unobserved_sentences(result))
    return Markup("<table>{}{}{}</table>{}").format(caption, head, Markup().join(rows), paragraphs(notes))
