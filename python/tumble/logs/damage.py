"""Damaged files, in one line: what a library makes of damaged bytes is whatever it happens to trip over."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tumble.foundation.errors import LogError, TumbleError

LONGEST_REASON = 200
"""Letters of a library's words, which may hold all that stands in the file."""
COPY_OR_SAVE = "copy it again, or save it again"
"""Remedy for a damaged file that no tool repairs."""


@contextmanager
def damage_said(path: Path, remedy: str) -> Iterator[None]:
    """Turns what is raised within the block into a `LogError` that reports the damaged file, and the remedy.

    One that is raised already is left as it is, and so is the lack of a library, which no copy mends.
    """
    try:
        yield
    except (TumbleError, ModuleNotFoundError):
        raise
    except Exception as error:
        words = str(error).splitlines()
        reason = words[0][:LONGEST_REASON] if words else type(error).__name__
        raise LogError(f"{path}: the file is damaged or cut short ({reason}); {remedy}") from error
