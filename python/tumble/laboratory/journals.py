"""Files beside a database of SQLite, which SQLite itself opens: each is of this registry, and of no other.

A registry of others comes with what lies beside it. SQLite would wait for a pipe there, empty another
file through a hard link, and remove a file that a rollback journal names.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from tumble.foundation.errors import PlaceError
from tumble.foundation.file_reading import opened
from tumble.foundation.file_status import stands_there
from tumble.foundation.files import refuse_others_name

_ROLLBACK: Final = "-journal"
_ENDINGS: Final = (_ROLLBACK, "-wal", "-shm")
_NAMES_ANOTHER: Final = bytes.fromhex("d9d505f920a163d7")
"""End of a journal that names another file, as one of changes to several databases at once does."""


def refuse_unfit_journals(database: Path) -> None:
    """Raises `OutputError` for a journal that is a link or no file, `PlaceError` where it names a file."""
    place = database.resolve()
    for ending in _ENDINGS:
        journal = place.with_name(place.name + ending)
        if not stands_there(journal):
            continue
        refuse_others_name(journal)
        if ending == _ROLLBACK and _end_of(journal) == _NAMES_ANOTHER:
            raise PlaceError(
                f"{journal}: names a file that SQLite would remove; restore the registry from a backup"
            )


def _end_of(journal: Path) -> bytes:
    with opened(journal, "journal of a registry") as file:
        file.seek(-min(len(_NAMES_ANOTHER), file.seek(0, os.SEEK_END)), os.SEEK_END)
        return file.read()
