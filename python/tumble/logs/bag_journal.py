"""Databases of ROS 2 bags whose recorder was not closed: what it wrote last stands in a journal beside them.

The library opens a database as one that never changes, and leaves its journal aside. The database is copied,
with its journal, and SQLite joins the two there: the files of the user stay as they are.
"""

from __future__ import annotations

from pathlib import Path

import apsw

from tumble.foundation.file_status import entries, is_file, is_folder
from tumble.foundation.files import copied_aside, note_input

JOURNAL = "-wal"
"""Ending of the journal behind the name of its database."""
_OTHER_JOURNAL = "-journal"
"""Ending of a journal that no recorder leaves, and by which SQLite removes any file that it names."""


class JoinedBag:
    """A bag together with the journals of its databases; `path` is where it can be read."""

    def __init__(self, bag: Path) -> None:
        self.path = bag
        self.journals = tuple(journal for journal in _journals_of(bag) if journal.stat().st_size)
        if not self.journals:
            return
        for journal in self.journals:
            note_input(journal)
        folder = is_folder(bag)
        parts = _parts_of(bag) if folder else [bag, *self.journals]
        self._copy = copied_aside(parts, bag.name if folder else "")
        beside = Path(self._copy.name) / (bag.name if folder else "")
        self.path = beside if folder else beside / bag.name
        for journal in self.journals:
            _join(beside / journal.name.removesuffix(JOURNAL))

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on what was joined, for the user."""
        return tuple(
            f"its recorder was not closed: read together with {journal.name}" for journal in self.journals
        )


def _journals_of(bag: Path) -> list[Path]:
    if is_folder(bag):
        return [part for part in entries(bag) if part.name.endswith(f".db3{JOURNAL}") and is_file(part)]
    journal = bag.with_name(bag.name + JOURNAL)
    return [journal] if is_file(journal) else []


def _parts_of(bag: Path) -> list[Path]:
    return [part for part in entries(bag) if is_file(part) and not part.name.endswith(_OTHER_JOURNAL)]


def _join(database: Path) -> None:
    connection = apsw.Connection(str(database))
    try:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
        connection.execute("PRAGMA journal_mode=DELETE").fetchall()
    finally:
        connection.close()
