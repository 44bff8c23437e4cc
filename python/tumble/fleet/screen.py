"""Progress of a fleet on a terminal, and its summary in words."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from tumble.cli.screen import message_console, print_line
from tumble.fleet.driver import ShowProgress
from tumble.fleet.ledger import SILENT_AFTER, JobStatus
from tumble.fleet.reduction import FALSE_DISCOVERIES, FleetSummary
from tumble.foundation import clock
from tumble.foundation.words import count_of, length_of_time

if TYPE_CHECKING:
    from rich.console import RenderableType

MOST_LINES = 10
"""Lines of a list on the screen; the page and `--json` have more."""
_LINE_EVERY = 10.0
"""s between two lines where there is no terminal."""


@contextmanager
def progress(quiet: bool) -> Iterator[ShowProgress]:
    """Shows progress on standard error while the block runs."""
    if quiet:
        yield lambda _: None
    elif not sys.stderr.isatty():
        yield _Spaced(lambda status: print_line(f"tumble: {status_words(status)}", is_message=True))
    else:
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[words]}"),
        )
        with Progress(*columns, console=message_console(), transient=True) as bar:
            task = bar.add_task("inputs", total=None, words="")
            yield lambda status: bar.update(
                task, total=status.inputs, completed=status.done, words=_counts(status)
            )


class _Spaced:
    """Shows a status now and then, and the last one."""

    def __init__(self, show: ShowProgress) -> None:
        self._show = show
        self._next = _LINE_EVERY

    def __call__(self, status: JobStatus) -> None:
        if status.state == "running" and status.seconds < self._next:
            return
        self._next = status.seconds + _LINE_EVERY
        self._show(status)


def status_words(status: JobStatus) -> str:
    """Describes how far a job is."""
    left = status.seconds_left
    ahead = f", {length_of_time(left)} left" if status.state == "running" and left is not None else ""
    reason = f": {status.reason}" if status.reason else ""
    silence = status.silence(clock.utc())
    if silence > SILENT_AFTER:
        reason = f"; nothing was written for {length_of_time(silence)}: if it was killed, go on with --resume"
    return f"{status.state}: {status.done} of {status.inputs} inputs, {_counts(status)}{ahead}{reason}"


def _counts(status: JobStatus) -> str:
    lost = f", {count_of('task', status.retried)} lost" if status.retried else ""
    return f"{status.failed} failed, {status.not_well} not all well{lost}, {status.rate:.3g} a second"


def drawn(summary: FleetSummary) -> RenderableType:
    """Draws what a person wants to know at once."""
    from rich.console import Group
    from rich.text import Text

    head = f"{count_of('input', summary.inputs)} of {count_of('unit', summary.units)}"
    ended = [f"{count} {verdict}" for verdict, count in summary.verdicts.items()]
    failed = sum(summary.failures.values())
    lines = [Text(f"{head}: {', '.join([*ended, *([f'{failed} failed'] if failed else [])])}")]
    lines += [Text(f"Failed: {place}: {why}", "yellow") for place, why in summary.failed[:MOST_LINES]]
    if failed > MOST_LINES:
        lines.append(Text(f"and {failed - MOST_LINES} more; --json lists them", "yellow"))
    tables = [
        _table(
            "Drift, per root of a year",
            ("model", "parameter", "sigma", "95 % interval"),
            _drift_rows(summary),
        ),
        _table("Due first", ("unit", "parameter", "due"), _due_rows(summary)),
        _table(
            f"Moved beyond chance (false discoveries {FALSE_DISCOVERIES:.0%}, {summary.tested} tested)",
            ("unit", "parameter", "change", "sigma"),
            _moved_rows(summary),
        ),
        _table("Capability of lots", ("lot", "parameter", "units", "Cpk"), _lot_rows(summary)),
    ]
    return Group(*lines, *(table for table in tables if table is not None))


def _drift_rows(summary: FleetSummary) -> list[tuple[str, ...]]:
    return [
        (
            each.model,
            each.parameter,
            f"{each.walk.q**0.5:.3g} {each.unit}",
            f"{each.walk.low**0.5:.3g} to {each.walk.high**0.5:.3g}",
        )
        for each in summary.drift
    ]


def _due_rows(summary: FleetSummary) -> list[tuple[str, ...]]:
    return [(each.name, each.parameter, each.date) for each in summary.due]


def _moved_rows(summary: FleetSummary) -> list[tuple[str, ...]]:
    return [
        (each.name, each.parameter, f"{each.change:+.3g} {each.unit}", f"{each.sigma:.2g}")
        for each in summary.moved
    ]


def _lot_rows(summary: FleetSummary) -> list[tuple[str, ...]]:
    return [
        (each.lot, each.parameter, str(each.found.units), f"{each.found.cpk:.2f}") for each in summary.lots
    ]


def _table(title: str, columns: tuple[str, ...], rows: list[tuple[str, ...]]) -> Any:  # noqa: ANN401 - rich is imported late
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    if not rows:
        return None
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    for column in columns:
        table.add_column(column, no_wrap=True)
    for row in rows[:MOST_LINES]:
        table.add_row(*(Text(cell) for cell in row))
    return table
