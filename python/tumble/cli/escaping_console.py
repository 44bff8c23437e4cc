"""A console that draws with escape sequences of its own and shows those in text, which others wrote."""

from __future__ import annotations

from collections.abc import Iterator
from typing import IO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from tumble.foundation.secrets import without_secrets
from tumble.foundation.words import printable


class EscapingConsole(Console):
    """Escapes in all text what a terminal would obey; colours, bars and screens are drawn as ever."""

    def __init__(self, file: IO[str], width: int | None = None) -> None:
        """Draws on `file`; brackets in text are no markup, and words between colons no emoji."""
        super().__init__(file=file, width=width, markup=False, emoji=False)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        """Pieces of what is to be drawn; of a text within it this is called for the text first."""
        for segment in super().render(renderable, options):
            if segment.control:
                yield segment
                continue
            style = segment.style
            # Rich finds links in what is printed beside a bar, and they may be of others.
            plain = style.update_link(None) if style is not None and style.link else style
            yield Segment(printable(without_secrets(segment.text)), plain)
