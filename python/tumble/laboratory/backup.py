"""Copies of a registry: the same entries and hashes in a file of SQLite, with a folder of documents."""

from __future__ import annotations

import re
from pathlib import Path

from sqlalchemy import Connection, Table, insert, select

from tumble.foundation.errors import OutputError
from tumble.foundation.file_status import exists
from tumble.foundation.files import FileKind, make_file, make_folder, move_to, prepare_folder, remove_made
from tumble.laboratory import tables
from tumble.laboratory.address import parse_address
from tumble.laboratory.database import Database, RegistryError
from tumble.laboratory.documents import Documents, documents_beside
from tumble.laboratory.registry import Registry
from tumble.laboratory.verification import Verification, verify

FILE = "registry.db"
_KIND = FileKind(
    "an unfinished copy of a registry",
    re.compile(rb"\ASQLite format 3\0"),
    re.compile(rb"CREATE TABLE alembic_version"),
)
UNFINISHED = "unfinished.db"
"""Copy that is not whole yet: one that was killed must not be taken for a backup."""
_CHUNK = 1000


def backup(registry: Registry, folder: Path) -> Verification:
    """Copy a registry as it is at one moment into an empty folder, and verify the copy.

    All documents go beside it, wherever they lie. Raises `OutputError` where the folder holds a copy, or has
    no room for it, `RegistryError` where the copy is not intact.
    """
    prepare_folder(folder)
    path = folder / FILE
    if exists(path):
        raise OutputError(f"{path}: is there already; give a new folder for each backup")
    unfinished = folder / UNFINISHED
    remove_made(unfinished, kind=_KIND)
    try:
        _copy_all(registry, unfinished, documents_beside(path))
        move_to(unfinished, path)
    finally:
        remove_made(unfinished)
    found = verify(Registry(path))
    if not found.intact:
        raise RegistryError(
            f"{path}: the copy is not intact, since the registry is not: {found.faults[0]}; see "
            "tumble registry verify"
        )
    return found


def _copy_all(registry: Registry, path: Path, documents: Path) -> None:
    make_file(path)
    make_folder(documents)
    copy, kept = Database(parse_address(path)), Documents(documents.name, documents.parent)
    copy.upgrade()
    with registry.database.reading() as source:
        with copy.writing() as target:
            for table in (tables.entry, *tables.OF_ENTRIES):
                _copy(source, target, table)
        for digest in source.execute(select(tables.document.c.sha256)).scalars():
            kept.keep(registry.documents.read(digest))


def _copy(source: Connection, target: Connection, table: Table) -> None:
    chosen = select(table).execution_options(yield_per=_CHUNK)
    for rows in source.execute(chosen).mappings().partitions(_CHUNK):
        target.execute(insert(table), [dict(row) for row in rows])
