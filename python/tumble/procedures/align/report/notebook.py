"""An alignment in a notebook: what `_repr_html_` of its result shows."""

from __future__ import annotations

from markupsafe import Markup

from tumble.procedures.align.report.page import unobserved_sentences
from tumble.procedures.align.result import AlignResult
from tumble.report.columns import parameter_cell, parameter_scales
from tumble.report.notebook import paragraphs, row


def align_html(result: AlignResult) -> str:
    """Print every parameter of every unit, and what the motion did not show."""
    caption = Markup("<caption><b>relative to {}</b> {}</caption>").format(result.primary, result.verdict)
    head = row("th", ("", *(unit.name for unit in result)))
    scales = parameter_scales(parameter for unit in result for parameter in unit.parameters)
    rows = [
        row("td", (each[0].name, *(parameter_cell(parameter, scales) for parameter in each)))
        for each in zip(*(unit.parameters for unit in result), strict=True)
    ]
    warnings = (f"{unit.name}: {line}" for unit in result for line in unit.warnings)
    notes = paragraphs((*unobserved_sentences(result), *warnings, *result.warnings))
    return Markup("<table>{}{}{}</table>{}").format(caption, head, Markup().join(rows), notes)
