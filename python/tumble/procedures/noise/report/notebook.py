"""The noise of a sensor in a notebook: what `_repr_html_` of its result shows."""

from __future__ import annotations

from markupsafe import Markup

from tumble.procedures.noise.report.text import printed_terms, unidentified, used_sentence
from tumble.procedures.noise.result import ASKED_FOR, NoiseResult
from tumble.report.notebook import paragraphs, row


def noise_html(result: NoiseResult) -> str:
    """Prints the terms asked for of every channel with their intervals, or the bounds on them."""
    caption = Markup("<caption><b>{}</b> {}</caption>").format(result.name, result.verdict)
    head = row("th", ("95 % intervals", *ASKED_FOR))
    rows = []
    for triad in result.triads:
        channels = [channel for channel in result.channels if channel.triad == triad]
        columns = [printed_terms([channel.term(name) for channel in channels]) for name in ASKED_FOR]
        rows += [
            row("td", (channel.name, *cells))
            for channel, cells in zip(channels, zip(*columns, strict=True), strict=True)
        ]
    hidden = [f"not identifiable: {line}" for line in unidentified(result)]
    notes = paragraphs((used_sentence(result.still), *hidden, *result.warnings))
    return Markup("<table>{}{}{}</table>{}").format(caption, head, Markup().join(rows), notes)
