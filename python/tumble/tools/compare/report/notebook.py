"""Calibrations held against each other in a notebook: what `_repr_html_` of the result shows."""

from __future__ import annotations

from markupsafe import Markup

from tumble.report.notebook import paragraphs, row
from tumble.tools.compare.report.text import (
    PARAMETER_COLUMNS,
    drift_sentence,
    parameter_rows,
    sentences,
    verdict_sentence,
)
from tumble.tools.compare.result import CompareResult, Pair


def compare_html(result: CompareResult) -> str:
    """Prints every parameter of every pair, and what it comes to."""
    drift = paragraphs(filter(None, [drift_sentence(result)]))
    return Markup().join([*map(_table, result.pairs), drift])


def _table(pair: Pair) -> Markup:
    caption = Markup("<caption><b>{}</b></caption>").format(verdict_sentence(pair))
    head = row("th", ("", *PARAMETER_COLUMNS))
    rows = [row("td", (name, *cells)) for name, cells in parameter_rows(pair)]
    notes = paragraphs((*sentences(pair), *pair.notes))
    return Markup("<table>{}{}{}</table>{}").format(caption, head, Markup().join(rows), notes)
