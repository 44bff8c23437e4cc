"""Compact tables for notebooks: what `_repr_html_` of a result shows. Draws nothing, so it is quick."""

from __future__ import annotations

from collections.abc import Iterable

from markupsafe import Markup, escape

from tumble.report.parameters import ParameterRow


def figures(printed: ParameterRow, unit: str) -> tuple[str, str, str]:
    """Prints value, sigma and unit of a parameter, or that it is not observable."""
    return ("not observable", "", "") if printed.reason else (printed.value, printed.sigma, unit)


def paragraphs(sentences: Iterable[str]) -> Markup:
    """Prints each sentence as a paragraph."""
    return Markup().join(Markup("<p>{}</p>").format(sentence) for sentence in sentences)


def row(tag: str, cells: tuple[str, ...]) -> Markup:
    """Prints a row of a table; `tag` is `th` or `td`."""
    opening, closing = Markup(f"<{tag}>"), Markup(f"</{tag}>")
    return Markup("<tr>{}</tr>").format(Markup().join(opening + escape(cell) + closing for cell in cells))
