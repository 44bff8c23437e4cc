"""A guided run: begun from an order, looked at by its views, ended by its outcome."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import Protocol, cast

from tumble.foundation.message import NOTHING, Message
from tumble.foundation.procedures import PROCEDURES
from tumble.tools.guided.field import RunField, UnitRole
from tumble.tools.guided.order import RunOrder
from tumble.tools.guided.outcome import RunOutcome
from tumble.tools.guided.view import RunView


class GuidedRun(Protocol):
    """One run. `views` is exhausted by one thread; `stop` and `act` may be called by any other."""

    def views(self) -> Iterator[RunView]:
        """Guides and records until all is done, or until `stop`; gives a view of each event.

        Views come at most 30 times a second.

        Raises `TumbleError`, in one line, where that cannot be done.
        """

    def stop(self) -> None:
        """Stops a table at once, whatever `views` waits for, and requests `views` to end soon.

        Recordings stay, and an order with `resume` goes on. Raises `TableError` where the table does not
        answer.
        """

    def act(self, action: str, subject: str = "") -> None:
        """Does one of the `actions` of the newest view; one that is no longer offered does nothing."""

    def outcome(self) -> RunOutcome:
        """Calibrates what was recorded as the command does with the session, and writes the same files.

        It is called once `views` are exhausted. Raises `TumbleError` where nothing can be calibrated.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class RunKind:
    """Runs of one procedure: what they ask, whom they take, and how one is begun."""

    word: str
    """Word of the procedure in `PROCEDURES`."""
    title: Message
    """Name on a button: `Turntable`."""
    summary: Message
    """One sentence for an operator: what is calibrated, and what he does."""
    roles: tuple[UnitRole, ...]
    fields: tuple[RunField, ...]
    takes_table: bool = False
    """Indicates whether a rate table can turn the units."""
    has_screen: bool = False
    """Indicates whether it has a place of its own among the screens of a page."""
    resumes: bool = True
    """Indicates whether a recording can go on; a run is paused by that."""
    begin: Callable[[RunOrder], GuidedRun]
    """Makes the run; raises `TumbleError` where the order cannot be carried out."""
    note: Message = NOTHING
    """Further words where the run is chosen."""


def run_kinds() -> Iterator[RunKind]:
    """Returns the kinds of runs there are, in the order of the procedures."""
    for each in PROCEDURES:
        if each.guided:
            yield run_kind(each.word)


def run_kind(word: str) -> RunKind:
    """Returns the kind of a procedure that can be guided: `RUN_KIND` of its `guided_run.py`."""
    (folder,) = (each.folder for each in PROCEDURES if each.word == word and each.guided)
    return cast("RunKind", import_module(f"{folder}.guided_run").RUN_KIND)
