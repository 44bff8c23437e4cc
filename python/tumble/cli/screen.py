"""Results on standard output: tables for people, JSON for machines."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

FILE_WIDTH = 128
"""What is no terminal has no width of its own, and a table folded to 80 columns is hard to read."""


def print_json(content: object) -> None:
    """Print one JSON document."""
    json.dump(content, sys.stdout, indent=2, allow_nan=False)
    print()


def print_json_line(content: Mapping[str, object]) -> None:
    """Print an object on a line of its own, at once; `null` for what is not finite."""
    from tumble.plain import finite

    print(json.dumps(finite(content), allow_nan=False), flush=True)


def print_summary(summary: RenderableType) -> None:
    """Print what is drawn with rich, as wide as the terminal."""
    result_console().print(summary)


def result_console() -> Console:
    """Give standard output to draw on, as wide as the terminal."""
    from rich.console import Console

    console = Console()
    return console if console.is_terminal else Console(width=FILE_WIDTH)
