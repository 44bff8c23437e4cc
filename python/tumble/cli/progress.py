"""Progress of a command: in a log of known or unknown length, in a batch."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeAlias

from tumble.cli.screen import message_console

if TYPE_CHECKING:
    from tumble.foundation.recording import SampleProgress

BatchProgress: TypeAlias = Callable[[int, str], None]
"""Receives the number done, and in words how they ended."""

FEWEST_FOR_LINES = 20
"""Smallest batch with progress lines where there is no terminal; smaller ones end sooner than one can
read."""


@contextmanager
def sample_progress(what: str, *, quiet: bool = False) -> Iterator[SampleProgress]:
    """Show samples done on standard error while the block runs; nothing where that is no terminal."""
    if quiet or not sys.stderr.isatty():
        yield lambda _done, _expected: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    console = message_console()
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


@contextmanager
def batch_progress(what: str, total: int) -> Iterator[BatchProgress]:
    """Shows how many of a batch are done while the block runs, on standard error.

    On a terminal as a bar; elsewhere, of batches worth it, as a line every tenth.
    """
    if not sys.stderr.isatty():
        yield _tenths(total) if total >= FEWEST_FOR_LINES else lambda _done, _counts: None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn(what),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[counts]}"),
    )
    with Progress(*columns, console=message_console(), transient=True) as bar:
        task = bar.add_task(what, total=total, counts="")
        yield lambda done, counts: bar.update(task, completed=done, counts=counts)


def _tenths(total: int) -> BatchProgress:
    def advance(done: int, counts: str) -> None:
        if 10 * done // total > 10 * (done - 1) // total:
            print(
                f"tumble: {done} of {total} ({100 * done // total} %): {counts}", file=sys.stderr, flush=True
            )

    return advance
