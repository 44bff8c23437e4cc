"""Commands that were given on the page, a line each in the session's recording: who reads it knows them too.

A restarted server finds there which of them were not yet carried out.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from tumble.foundation.bounded_json import parse_json
from tumble.foundation.documents import well_typed
from tumble.foundation.file_names import SESSION_FOLDER
from tumble.foundation.file_reading import bounded_lines, opened
from tumble.foundation.file_status import exists, is_folder
from tumble.foundation.files import append_line, refuse_links_to
from tumble.foundation.plain import finite
from tumble.foundation.provenance import date_now

COMMANDS = "commands.jsonl"
LONGEST_LINE = 1 << 16
"""Bytes of a command; its subject is a pose, or a reason in words."""
CARRIED_OUT = "carried out"
"""Word of a line that ends the command of the same subject before it."""


@dataclass(frozen=True, slots=True)
class GivenCommand:
    """One command, or that it was carried out."""

    command: str
    """`pause`, `go on`, `finish`, `leave`, `accepted`, or an action of the run such as `redo`."""
    subject: str = ""
    """Thing that it was about, such as a pose; of a pause its reason, where nobody asked for it."""
    elapsed: float = float("nan")
    """s since the run began; NaN where nothing was recorded at the time."""
    date: str = ""
    """UTC, ISO 8601."""


class CommandLog:
    """The commands of one run; nothing is stored before it has a recording."""

    def __init__(self, run: Path) -> None:
        self._runs = run.parent
        self._path = run / SESSION_FOLDER / COMMANDS

    def add(self, command: str, subject: str = "", elapsed: float = float("nan")) -> None:
        """Stores a command; raises `OutputError` where the file cannot be written, or lies behind a link."""
        refuse_links_to(self._path, self._runs)
        if not is_folder(self._path.parent):
            return
        given = GivenCommand(command, subject, elapsed, date_now())
        append_line(self._path, json.dumps(finite(asdict(given))))

    def commands(self) -> Iterator[GivenCommand]:
        """Returns the commands in their order; a line that a power cut left unfinished is none.

        The file of a run may be of any length. Raises `PlaceError` where it is none.
        """
        if not exists(self._path):
            return
        with opened(self._path) as file:
            for _, line in bounded_lines(file, LONGEST_LINE):
                if (found := _command(line)) is not None:
                    yield found

    def left(self, actions: frozenset[str]) -> list[GivenCommand]:
        """Returns those of some actions that were not carried out, each once."""
        waiting: dict[str, GivenCommand] = {}
        for each in self.commands():
            if each.command in actions and each.subject:
                waiting[each.subject] = each
            elif each.command == CARRIED_OUT:
                waiting.pop(each.subject, None)
        return list(waiting.values())


def _command(line: bytes | None) -> GivenCommand | None:
    try:
        content = parse_json(line or b"")
        elapsed = content.pop("elapsed")
        given = GivenCommand(**content, elapsed=float("nan") if elapsed is None else float(elapsed))
        return well_typed(given)
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
