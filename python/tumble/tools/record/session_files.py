"""Writes `session.yaml`."""

from __future__ import annotations

from pathlib import Path

from tumble.foundation.documents import write_document
from tumble.foundation.file_names import SESSION_FILE
from tumble.logs.session import Session

HEADER = """Recorded by tumble record. Samples are in NAME.parquet, or while it runs in NAME.parts.
Read a unit as SESSION:NAME, such as: tumble inspect SESSION:NAME"""


def write_session(folder: Path, session: Session) -> None:
    """Writes what there is to know of a session."""
    write_document(folder / SESSION_FILE, HEADER, session.content(), renews=True)
