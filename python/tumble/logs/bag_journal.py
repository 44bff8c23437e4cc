"""Databases of ROS 2 bags whose recorder was not closed: what it wrote last stands in a journal beside them.

The library opens a database as one that never changes, and leaves its journal aside. The database is copied,
with its journal, and SQLite joins the two there: the files of the user stay as they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path, PurePath

import apsw

from tumble.foundation.bounded_yaml import parse
from tumble.foundation.documents import LARGEST_DOCUMENT
from tumble.foundation.errors import LogError
from tumble.foundation.file_reading import read_text_whole
from tumble.foundation.file_status import is_file, is_folder, status_of
from tumble.foundation.files import note_input
from tumble.foundation.temporary_folders import copied_aside

METADATA = "metadata.yaml"
"""File in a folder that names the files of a bag."""
JOURNAL = "-wal"
"""Ending of the journal behind the name of its database."""


class JoinedBag:
    """A bag together with the journals of its databases; `path` is where it can be read.

    Raises `LogError` for a list of files that is none, and `OutputError` where the copy has no room.
    """

    def __init__(self, bag: Path) -> None:
        self.path = bag
        parts = list(_parts_of(bag)) if is_folder(bag) else [bag]
        self.journals = tuple(filter(_is_filled, (part.with_name(part.name + JOURNAL) for part in parts)))
        if not self.journals:
            return
        for journal in self.journals:
            note_input(journal)
        folder = bag.name if is_folder(bag) else ""
        # The library reads these alone: nothing else in the folder is copied.
        self._copy = copied_aside([*filter(is_file, parts), *self.journals], folder)
        beside = Path(self._copy.name) / folder
        self.path = beside if folder else beside / bag.name
        for journal in self.journals:
            _join(beside / journal.name.removesuffix(JOURNAL))

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on what was joined, for the user."""
        return tuple(
            f"its recorder was not closed: read together with {journal.name}" for journal in self.journals
        )


def _parts_of(bag: Path) -> Iterator[Path]:
    """Yields the list of a bag's files, and each file that it names, by which the library reads them.

    Raises `ValueError` where it names one twice: its messages would be read again.
    """
    # Bounds of nesting, size and files; the library has none.
    text = read_text_whole(bag / METADATA, LARGEST_DOCUMENT, "list of a bag's files", error=LogError)
    content = parse(text)[1]
    yield bag / METADATA
    inside = content.get("rosbag2_bagfile_information") if isinstance(content, dict) else None
    listed = inside.get("relative_file_paths") if isinstance(inside, dict) else None
    names = [PurePath(str(each)).name for each in listed] if isinstance(listed, list) else []
    if len(set(names)) < len(names):
        name = next(each for number, each in enumerate(names) if each in names[:number])
        raise ValueError(f"it names the file {name} twice")
    yield from (bag / name for name in names)


def _is_filled(journal: Path) -> bool:
    status = status_of(journal)
    return is_file(journal) and status is not None and status.st_size > 0


def _join(database: Path) -> None:
    connection = apsw.Connection(str(database))
    try:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
        connection.execute("PRAGMA journal_mode=DELETE").fetchall()
    finally:
        connection.close()
