"""A multi-pose calibration in a notebook: what `_repr_html_` of its result shows."""

from __future__ import annotations

from markupsafe import Markup

from tumble.procedures.multipose.report.ferraris import compared
from tumble.procedures.multipose.report.text import next_sentences, sentences
from tumble.procedures.multipose.result import MultiposeResult
from tumble.report.notebook import figures, paragraphs, row
from tumble.report.parameters import parameter_groups


def multipose_html(result: MultiposeResult) -> str:
    """Prints every parameter with sigma, and how good they are."""
    caption = Markup("<caption><b>{}</b> {}</caption>").format(result.name, result.verdict)
    head = row("th", ("", "parameter", "value", "± sigma", "unit"))
    rows = [
        row("td", (triad.triad, printed.name, *figures(printed, group.unit)))
        for triad in result.triads
        for group in parameter_groups(triad, ())
        for printed in group.rows
    ]
    beside = [
        row("td", (each.triad, each.name, each.ferraris, each.difference, each.unit))
        for each in compared(result)
    ]
    if beside:
        titles = ("", "by the formulas of Ferraris", "value", "sigmas apart", "unit")
        rows += [row("th", titles), *beside]
    notes = (*sentences(result), *next_sentences(result), *result.warnings)
    return Markup("<table>{}{}{}</table>{}").format(caption, head, Markup().join(rows), paragraphs(notes))
