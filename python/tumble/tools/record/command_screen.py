"""Screen of a recording: a table on a terminal, else lines; or JSON for machines."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, TypeAlias

from tumble.cli.screen import print_event
from tumble.foundation.translation import translated
from tumble.foundation.words import LISTENING, count_of

if TYPE_CHECKING:
    from rich.table import Table

    from tumble.live.losses import SampleLoss
    from tumble.tools.record.procedure import RecordStep, UnitProgress

Show: TypeAlias = "Callable[[RecordStep], None]"

BETWEEN_LINES = 10.0
"""s between two lines about each unit, where there is no terminal."""
STYLES = {"waiting": "dim", "rest": "green", "motion": "cyan", "silent": "red", "lost": "red"}


def is_whole(losses: Iterable[SampleLoss]) -> bool:
    """Warns of each unit of which many samples are missing; returns True where there is none."""
    heavy = [loss for loss in losses if loss.is_heavy]
    for loss in heavy:
        print(f"tumble: warning: {loss}", file=sys.stderr, flush=True)
    return not heavy


@contextmanager
def shown(as_json: bool) -> Iterator[Show]:
    """Give what shows each step while the block runs, on standard error; JSON on standard output."""
    from rich.live import Live

    from tumble.cli.drawn_translation import translated_drawing
    from tumble.cli.screen import message_console

    console = message_console()
    if as_json:
        yield _print_json
    elif not console.is_terminal:
        yield _Lines().show
    else:
        with Live(console=console, auto_refresh=False) as screen:

            def show(step: RecordStep) -> None:
                if words := _happened(step):
                    screen.console.print(translated(words), highlight=False)
                screen.update(translated_drawing(_table(step)), refresh=True)

            yield show


def _print_json(step: RecordStep) -> None:
    content = asdict(step)
    print_event(content.pop("kind"), content)


class _Lines:
    """A line for all that happens, and now and then one for each unit."""

    def __init__(self) -> None:
        self._due = BETWEEN_LINES

    def show(self, step: RecordStep) -> None:
        if words := _happened(step):
            print(translated(words), file=sys.stderr, flush=True)
        if step.kind == "progress" and step.elapsed >= self._due:
            self._due = step.elapsed + BETWEEN_LINES
            for unit in step.units:
                print(translated(", ".join(_cells(unit))), file=sys.stderr, flush=True)


def _happened(step: RecordStep) -> str:
    names = ", ".join(unit.name for unit in step.units)
    return {
        LISTENING: f"Recording {names}. Ctrl-C ends.",
        "lost": step.reason if step.is_final else f"{step.reason}; trying again every second",
        "returned": f"{step.unit}: is there again",
        "silent": f"{step.unit}: sends nothing; is it on, does it send to this address, at this baud rate?",
        "done": f"Ended after {step.elapsed:.1f} s: {step.reason}.",
    }.get(step.kind, "")


def _table(step: RecordStep) -> Table:
    from rich.table import Table

    table = Table(
        "unit",
        "samples",
        "rate",
        "gaps",
        "now",
        caption=f"{step.elapsed:.0f} s, {step.bytes / 1e6:.1f} MB on disk",
    )
    for unit in step.units:
        *cells, condition = _cells(unit)
        table.add_row(*cells, f"[{STYLES[condition]}]{condition}")
    return table


def _cells(unit: UnitProgress) -> tuple[str, ...]:
    rate = "" if math.isnan(unit.rate) else f"{unit.rate:.4g} Hz"
    gaps = count_of("gap", unit.gaps) + (f" ({unit.missing} missing)" if unit.missing else "")
    return unit.name, count_of("sample", unit.samples), rate, gaps, unit.condition
