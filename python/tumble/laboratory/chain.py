"""The chain of entries: each holds the hash of its content and of the entry before.

A change of any number or letter of any row changes the hash of its entry, and so breaks the chain from there.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from tumble.foundation.words import in_utf8

Value: TypeAlias = str | int | float | None
Record: TypeAlias = Mapping[str, Value]
TableRows: TypeAlias = Mapping[str, Sequence[Record]]
"""Rows of an entry, by table."""

FIRST = "0" * 64
"""Stands for the entry before the first one."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A step of the record: who added what, and when."""

    number: int
    """From 1 on, without gaps."""
    date: str
    """UTC, ISO 8601."""
    who: str
    what: str
    content: str
    """Hash of the rows that it added."""
    previous: str
    """Hash of the entry before."""
    hash: str

    @property
    def expected_hash(self) -> str:
        """Hash that follows from the rest."""
        return sha256_of_json(
            [self.number, self.date, self.who, self.what, self.content, self.previous],
        )


def next_entry(last: Entry | None, date: str, who: str, what: str, rows: TableRows) -> Entry:
    """Return the entry that adds rows behind the last one, and is of no earlier date whatever clocks show."""
    number, previous = (1, FIRST) if last is None else (last.number + 1, last.hash)
    date = date if last is None else max(date, last.date)
    content = content_hash(rows)
    digest = sha256_of_json([number, date, who, what, content, previous])
    return Entry(number, date, who, what, content, previous, digest)


def content_hash(rows: TableRows) -> str:
    """Return the hash of rows, in whatever order they come.

    Columns without a value do not count, so that a column that a later version adds changes no hash.
    """
    tables = {
        table: sorted(
            _json({name: value for name, value in row.items() if value is not None}) for row in found
        )
        for table, found in rows.items()
        if found
    }
    return sha256_of_json(tables)


def stored(value: Value) -> Value:
    """Return a value as both engines give it back: text without NUL, 0 for -0, None for what is no number."""
    if isinstance(value, str):
        return in_utf8(value).replace("\x00", "\\x00")
    if isinstance(value, float):
        return value + 0.0 if math.isfinite(value) else None
    return value


def sha256_of_json(content: object) -> str:
    """Return the SHA-256 of plain data, in hexadecimal: the same on every computer."""
    return hashlib.sha256(_json(content).encode("ascii")).hexdigest()


def _json(content: object) -> str:
    # A damaged row may hold bytes where text stood; its hash then differs.
    return json.dumps(content, sort_keys=True, separators=(",", ":"), default=repr)
