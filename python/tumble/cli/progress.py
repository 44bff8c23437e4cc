"""A progress bar for reading a log of known or unknown length."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tumble.recording import SampleProgress


@contextmanager
def sample_progress(what: str) -> Iterator[SampleProgress]:
    """Show samples done on standard error while the block runs; nothing where that is no terminal."""
    if not sys.stderr.isatty():
        yield lambda _done, _expected: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(file=sys.stderr)
    columns = (
        TextColumn(what),
        BarColumn(),
        TextColumn("{task.completed:,.0f} samples"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=None)

        def advance(done: int, expected: int | None) -> None:
            total = None if expected is None else max(done, expected)
            bar.update(task, completed=done, total=total)

        yield advance
