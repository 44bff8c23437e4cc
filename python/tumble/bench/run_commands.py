"""Commands that were given on the page, a line each in the session's recording: who reads it knows them too.

A restarted server finds there which of them were not yet carried out.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from tumble.foundation.bounded_json import parse_json
from tumble.foundation.documents import LARGEST_DOCUMENT
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_names import SESSION_FOLDER
from tumble.foundation.file_reading import read_text_whole
from tumble.foundation.file_status import is_folder
from tumble.foundation.files import append_line
from tumble.foundation.plain import finite
from tumble.foundation.provenance import date_now

COMMANDS = "commands.jsonl"
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
        self._path = run / SESSION_FOLDER / COMMANDS

    def add(self, command: str, subject: str = "", elapsed: float = float("nan")) -> None:
        """Stores a command; raises `OutputError` where the file cannot be written."""
        if not is_folder(self._path.parent):
            return
        given = GivenCommand(command, subject, elapsed, date_now())
        append_line(self._path, json.dumps(finite(asdict(given))))

    def commands(self) -> list[GivenCommand]:
        """Returns the commands in their order; a line that a power cut left unfinished is none."""
        try:
            lines = read_text_whole(self._path, LARGEST_DOCUMENT).splitlines()
        except TumbleError:
            return []
        return [found for line in lines if (found := _command(line)) is not None]

    def left(self, actions: frozenset[str]) -> list[GivenCommand]:
        """Returns those of some actions that were not carried out, each once."""
        waiting: dict[str, GivenCommand] = {}
        for each in self.commands():
            if each.command in actions and each.subject:
                waiting[each.subject] = each
            elif each.command == CARRIED_OUT:
                waiting.pop(each.subject, None)
        return list(waiting.values())


def _command(line: str) -> GivenCommand | None:
    try:
        content = parse_json(line)
        elapsed = content.pop("elapsed")
        return GivenCommand(**content, elapsed=float("nan") if elapsed is None else float(elapsed))
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
