"""A spin in a notebook: what `_repr_html_` of its result shows."""

from __future__ import annotations

from markupsafe import Markup

from tumble.procedures.spin.report import text
from tumble.procedures.spin.report.parameters import spin_groups
from tumble.procedures.spin.result import SpinResult
from tumble.report.notebook import figures, paragraphs, row


def spin_html(result: SpinResult) -> str:
    """Prints the biases that the spins agree on, and every parameter of each spin with sigma."""
    caption = Markup("<caption><b>{}</b> {}</caption>").format(result.name, text.found_sentence(result))
    biases = (
        text.bias_sentence("Accelerometer bias", "m/s^2", result.accelerometer_bias),
        text.bias_sentence("Gyroscope bias", "rad/s", result.gyroscope_bias),
    )
    head = row("th", ("", "parameter", "value", "± sigma", "unit"))
    rows = [
        row("td", (spin.label, printed.name, *figures(printed, group.unit)))
        for spin in result.spins
        for group in spin_groups(spin)
        for printed in group.rows
    ]
    notes = (*biases, *text.trust_sentences(result), *text.unobserved_sentences(result))
    return Markup("<table>{}{}{}</table>{}").format(caption, head, Markup().join(rows), paragraphs(notes))
