"""Reports of mistakes: a line on standard error, and with `--json` a document as well."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Final

from tumble.cli.screen import print_event, print_json_line
from tumble.foundation.errors import TumbleError, shown
from tumble.foundation.translation import translated
from tumble.foundation.words import printable

ERROR: Final = "tumble-error/1"
_JSON, _SHORTEST = "--json", len("--js")


def tell_error(error: TumbleError, words: Sequence[str]) -> None:
    """Print an error, escaped, with the name of the program; as JSON too if `words` ask for that."""
    if wants_json(words) and not error.is_told:
        print_json_line(_content(error))
    about = f"{error.about}: " if error.about else ""
    for reason in error.reasons:
        print(f"tumble: {translated('error')}: {printable(about + translated(reason))}", file=sys.stderr)


def print_notice(text: str) -> None:
    """Prints a line on standard error with the name of the program, in the language of the context."""
    print(f"tumble: {shown(translated(text))}", file=sys.stderr, flush=True)


def tell_as_event(error: TumbleError, **figures: str) -> None:
    """Print an error as the last event of a live session, which is its document too."""
    print_event("failed", {"reason": str(error), **figures, **_content(error)})
    error.is_told = True


def _content(error: TumbleError) -> dict[str, object]:
    about = {"kind": type(error).__name__, "about": error.about, "why": error.why, "message": str(error)}
    return {"schema": ERROR, "verdict": "error", "error": about}


def wants_json(words: Sequence[str]) -> bool:
    """Return whether `--json` was typed, cut short or not, before any `--`; other words may make no sense."""
    before = words[: words.index("--")] if "--" in words else words
    return any(len(word) >= _SHORTEST and _JSON.startswith(word) for word in before)
