"""Results on standard output: tables for people, JSON for machines."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tumble.cli.standard_output import drawn
from tumble.foundation.errors import shown
from tumble.foundation.secrets import without_secrets

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

FILE_WIDTH = 128
"""Width of output that is no terminal: a table folded to 80 columns is hard to read."""


LISTED = "listed"
"""Verdict of a document that lists what there is."""


def print_document(schema: str, verdict: str, content: Mapping[str, Any]) -> None:
    """Print one JSON document, of a schema that `tumble schema` has; `verdict` is the result in a word."""
    document = _without_secrets({"schema": schema, **content, "verdict": verdict})
    json.dump(document, sys.stdout, indent=2, allow_nan=False)
    print()


def print_event(event: str, content: Mapping[str, object], *, keeps_secrets: bool = False) -> None:
    """Print an event of a live session on a line of its own, at once; the rest is as of `print_json_line`."""
    print_json_line({"event": event, **content}, keeps_secrets=keeps_secrets)


def print_json_line(content: Mapping[str, object], *, keeps_secrets: bool = False) -> None:
    """Prints an object on a line of its own, at once; `null` for what is not finite.

    `keeps_secrets` is for the link to a page, whose token is the way in.
    """
    from tumble.foundation.plain import finite

    found = finite(content)
    print(json.dumps(found if keeps_secrets else _without_secrets(found), allow_nan=False), flush=True)


def _without_secrets(value: object) -> object:
    """Returns plain data with secrets of addresses hidden in each text, which holds no other."""
    if isinstance(value, str):
        return without_secrets(value, is_message=True)
    if isinstance(value, Mapping):
        return {key: _without_secrets(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_without_secrets(each) for each in value]
    return value


def print_line(text: str, *, is_message: bool = False) -> None:
    """Prints one line, on standard error where it is a message: a name from outside begins no other."""
    print(shown(text), file=sys.stderr if is_message else sys.stdout)


def print_summary(summary: RenderableType) -> None:
    """Prints what is drawn with rich, as wide as the terminal, in the language of the context."""
    from tumble.cli.drawn_translation import translated_drawing, with_plain_cells

    result_console().print(translated_drawing(with_plain_cells(summary)))


def result_console() -> Console:
    """Returns standard output to draw on, as wide as the terminal."""
    return _screen(sys.stdout)


def message_console() -> Console:
    """Returns standard error to draw on, as wide as the terminal."""
    return _screen(sys.stderr)


def _screen(stream: Any) -> Console:  # noqa: ANN401 - whatever stands for standard output or error
    from tumble.cli.escaping_console import EscapingConsole

    console = EscapingConsole(file=drawn(stream))
    return console if console.is_terminal else EscapingConsole(file=drawn(stream), width=FILE_WIDTH)
