"""Translation of what is drawn with rich: texts, and cells of tables, wherever they stand in it."""

from __future__ import annotations

from dataclasses import replace

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.foundation.errors import shown
from tumble.foundation.translation import ENGLISH, language, translated


def translated_drawing(drawing: RenderableType) -> RenderableType:
    """Returns a drawing in the language of the context; what is no text, group or table stays as it is."""
    return drawing if language() == ENGLISH else _translated(drawing)


def with_plain_cells(drawing: RenderableType) -> RenderableType:
    """Returns a drawing in which a cell of text is one line: a name from outside begins no other."""
    match drawing:
        case Group():
            return Group(*map(with_plain_cells, drawing.renderables))
        case Table():
            for column in drawing.columns:
                column._cells = [shown(cell) if isinstance(cell, str) else cell for cell in column.cells]
    return drawing


def _translated(drawing: RenderableType) -> RenderableType:
    match drawing:
        case str():
            return translated(drawing)
        case Text():
            return _text(drawing)
        case Group():
            return Group(*map(_translated, drawing.renderables))
        case Table():
            drawing.title = _translated(drawing.title) if drawing.title else None  # type: ignore[assignment]
            drawing.columns = [
                replace(
                    column,
                    header=_translated(column.header),
                    footer=_translated(column.footer),
                    _cells=[_translated(cell) for cell in column.cells],
                )
                for column in drawing.columns
            ]
    return drawing


def _text(text: Text) -> Text:
    """Translates each piece of one style."""
    places = sorted({place for span in text.spans for place in (span.start, span.end)})
    pieces = text.divide(places) if places else [text]
    made = Text(style=text.style, no_wrap=text.no_wrap, overflow=text.overflow, justify=text.justify)
    for piece in pieces:
        made.append(translated(piece.plain), piece.spans[0].style if piece.spans else None)
    return made
