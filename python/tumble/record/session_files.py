"""`session.yaml` out, and the hold that one recorder has on a folder."""

from __future__ import annotations

import os
from pathlib import Path

from tumble.documents import write_document
from tumble.errors import OutputError
from tumble.file_names import SESSION_FILE
from tumble.logs.session import Session

HEADER = """Recorded by tumble record. Samples are in NAME.parquet, or while it runs in NAME.parts.
Read a unit as SESSION:NAME, such as: tumble inspect SESSION:NAME"""


def write_session(folder: Path, session: Session) -> None:
    """Write what there is to know of a session."""
    write_document(folder / SESSION_FILE, HEADER, session.content(), renews=True)


def hold(folder: Path) -> int | None:
    """Keep other recorders out of a folder until what is given is closed, or this process ends.

    Raises `OutputError` where another one is at it. Where the system has no such locks, None.
    """
    try:
        import fcntl
    except ModuleNotFoundError:  # Windows
        return None
    opened = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(opened)
        raise OutputError(
            f"{folder}: is being recorded into; stop that first, or give another folder"
        ) from error
    return opened


def release(held: int | None) -> None:
    """Let others into a folder again."""
    if held is not None:
        os.close(held)
