"""Recomputes all hashes of a registry: of rows, of the chain, and of documents."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import groupby
from typing import Any

from sqlalchemy import Connection, func, select, text
from sqlalchemy.exc import SQLAlchemyError

from tumble.foundation.errors import TumbleError
from tumble.foundation.words import count_of
from tumble.laboratory import tables
from tumble.laboratory.chain import FIRST, Entry, Record, content_hash
from tumble.laboratory.database import raise_interruption
from tumble.laboratory.registry import Registry
from tumble.laboratory.schema_faults import schema_faults

MOST_FAULTS = 100
"""Faults after which the search ends."""


@dataclass(frozen=True, slots=True)
class Verification:
    """Outcome of a check of a whole registry."""

    entries: int
    documents: int
    head: str
    """Hash of the last entry; noted elsewhere, it shows later whether entries were cut off at the end."""
    unreferenced: int
    """Documents that no row refers to, as a run that was killed leaves them; they do no harm."""
    faults: tuple[str, ...]

    @property
    def intact(self) -> bool:
        """Return True if nothing was changed, lost or added behind the registry's back."""
        return not self.faults

    def content(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self) | {"intact": self.intact, "faults": list(self.faults)}


def verify(registry: Registry, *, head: str = "") -> Verification:
    """Check a registry; `head` is the hash of an entry that it held once. Raises `TumbleError`."""
    search = _Search(registry, head)
    try:
        with registry.database.reading() as connection:
            search.run(connection)
    except TumbleError as error:
        search.faults.append(error.why)
    return Verification(
        search.entries, search.documents, search.last, search.unreferenced, tuple(search.faults[:MOST_FAULTS])
    )


class _Search:
    def __init__(self, registry: Registry, head: str) -> None:
        self._registry = registry
        self._head = head
        self.faults: list[str] = []
        self.entries = self.documents = self.unreferenced = 0
        self.last = FIRST

    def run(self, connection: Connection) -> None:
        """Collect all faults."""
        if connection.dialect.name == "sqlite":
            # Text that a flipped bit made no UTF-8 is a fault of its entry, not of the driver.
            driver: Any = connection.connection.driver_connection
            driver.text_factory = _lenient
        self.faults += schema_faults(connection)
        if connection.dialect.name == "sqlite" and not self.faults:
            # The check evaluates expressions of the schema, which in a file of others may never end.
            self.faults += _sqlite_faults(connection)
        self.faults += self._chain_faults(connection)
        self.faults += self._document_faults(connection)

    def _chain_faults(self, connection: Connection) -> Iterator[str]:
        """Hold each entry against its rows, its own hash and the entry before."""
        rows = {table.name: _by_entry(connection, table) for table in tables.OF_ENTRIES}
        waiting = {name: next(found, None) for name, found in rows.items()}
        met, date = self._head in ("", FIRST), ""
        for row in connection.execute(select(tables.entry).order_by(tables.entry.c.number)).mappings():
            entry = Entry(**row)
            self.entries += 1
            number = self.entries
            own: dict[str, list[Record]] = {}
            for name, found in waiting.items():
                while found is not None and found[0] < entry.number:
                    yield f"{name}: rows of entry {found[0]}, which does not exist"
                    found = waiting[name] = next(rows[name], None)
                if found is not None and found[0] == entry.number:
                    own[name] = found[1]
                    waiting[name] = next(rows[name], None)
            if entry.number != number:
                yield f"entry {entry.number}: is number {number} of the chain; entries are missing before it"
                self.entries = entry.number
            if content_hash(own) != entry.content:
                held = ", ".join(own) or "no table"
                yield f"entry {entry.number} of {entry.date}: its rows ({held}) are not those it added"
            if entry.expected_hash != entry.hash:
                yield f"entry {entry.number}: was changed: its hash is not that of its content"
            if entry.previous != self.last:
                yield f"entry {entry.number}: does not follow the entry before it"
            if entry.date < date:
                yield f"entry {entry.number}: is of {entry.date}, before the entry before it, of {date}"
            self.last, date = entry.hash, entry.date
            met = met or entry.hash == self._head
            if len(self.faults) > MOST_FAULTS:
                return
        for name, found in waiting.items():
            if found is not None:
                yield f"{name}: rows of entry {found[0]}, which does not exist"
        if not self.entries:
            yield "the chain has no entry"
        if not met:
            yield f"no entry has the hash {self._head}: entries at the end are missing"

    def _document_faults(self, connection: Connection) -> Iterator[str]:
        known: set[str] = set()
        for row in connection.execute(select(tables.document)).mappings():
            self.documents += 1
            known.add(row["sha256"])
            try:
                found = self._registry.documents.read(row["sha256"])
            except TumbleError as error:
                yield str(error)
                continue
            if len(found) != row["size"]:
                size = count_of("byte", len(found))
                yield f"document {row['sha256']}: has {size}, recorded are {row['size']}"
        self.unreferenced = sum(digest not in known for digest in self._registry.documents.hashes())


def _by_entry(connection: Connection, table: Any) -> Iterator[tuple[int, list[Record]]]:  # noqa: ANN401
    """Yield the rows of each entry, in the order of entries, a thousand in memory at a time."""
    chosen = select(table).order_by(table.c.entry).execution_options(yield_per=1000)
    found = (dict(row) for row in connection.execute(chosen).mappings())
    for number, rows in groupby(found, key=lambda row: row["entry"]):
        yield number, list(rows)


def _sqlite_faults(connection: Connection) -> Iterator[str]:
    """Have SQLite check its pages and indices, and pointers from table to table."""
    try:
        for (line,) in connection.execute(text("PRAGMA integrity_check(10)")):
            if line != "ok":
                yield f"the file is damaged: {' '.join(str(line).split())}"
        broken = connection.execute(text("PRAGMA foreign_key_check")).first()
        if broken is not None:
            yield f"{broken[0]}: a row refers to a row of {broken[2]} that does not exist"
    except (SQLAlchemyError, sqlite3.Error) as error:
        raise_interruption(connection.connection.driver_connection, "", error)
        yield f"the file is damaged: {' '.join(str(getattr(error, 'orig', error)).split())}"


def _lenient(content: bytes) -> str:
    return content.decode("utf-8", "surrogateescape")


def head_of(registry: Registry) -> tuple[int, str]:
    """Return number and hash of the last entry."""
    e = tables.entry.c
    with registry.database.reading() as connection:
        last = connection.execute(select(func.max(e.number))).scalar() or 0
        found = connection.execute(select(e.hash).where(e.number == last)).scalar()
    return int(last), str(found or FIRST)
